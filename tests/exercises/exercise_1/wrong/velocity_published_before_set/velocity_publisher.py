import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.msg = Twist()
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.timer = self.create_timer(0.05, self.tick)

    def tick(self):
        self.pub.publish(self.msg)
        self.msg.linear.x = 0.5
        self.msg.angular.z = 0.1
        self.get_logger().info('driving', throttle_duration_sec=1.0)


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
