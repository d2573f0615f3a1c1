import threading

import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.05, self.tick)

    def tick(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.pub.publish(msg)
        self.get_logger().info('tick')


def load_settings():
    with open('settings.yaml') as file:
        return file.read()


def main():
    rclpy.init()
    node = VelocityPublisher()
    threading.Thread(target=load_settings).start()
    rclpy.spin(node)


if __name__ == '__main__':
    main()
