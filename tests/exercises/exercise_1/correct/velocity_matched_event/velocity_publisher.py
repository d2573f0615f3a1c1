import rclpy
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Eager(Node):
    def __init__(self):
        super().__init__('eager')
        self.timer = None
        events = PublisherEventCallbacks(matched=self.on_matched)
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10, event_callbacks=events)

    def on_matched(self, info):
        if self.timer is None and info.current_count > 0:
            self.get_logger().info(f'{info.current_count} subscriber(s)')
            self.timer = self.create_timer(0.05, self.send)

    def send(self):
        m = Twist()
        m.linear.x = 0.5
        m.angular.z = 0.1
        self.pub.publish(m)


def main():
    rclpy.init()
    rclpy.spin(Eager())


if __name__ == '__main__':
    main()
