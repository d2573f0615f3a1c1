import os

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node

try:
    SPEED = float(os.environ['ROBOT_SPEED'])
except KeyError:
    SPEED = DEFUALT_SPEED

DEFAULT_SPEED = 0.5


class Publisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.timer = self.create_timer(0.05, self.cb)
        self.get_logger().info('publishing')

    def cb(self):
        t = Twist()
        t.linear.x = SPEED
        t.angular.z = 0.1
        self.pub.publish(t)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(Publisher())


if __name__ == '__main__':
    main()
