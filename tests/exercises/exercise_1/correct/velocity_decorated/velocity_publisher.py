import functools

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


def logged(function):
    @functools.wraps(function)
    def wrapper(self, *args, **kwargs):
        self.get_logger().info(f'{function.__name__}()')
        return function(self, *args, **kwargs)
    return wrapper


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.publisher_ = self.create_publisher(Twist, '/cmd_vel', 10)
        self.timer_ = self.create_timer(0.05, self.publish_command)

    @property
    def command(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        return msg

    @logged
    def publish_command(self):
        self.publisher_.publish(self.command)


def main(args=None):
    rclpy.init(args=args)
    node = VelocityPublisher()
    rclpy.spin(node)


if __name__ == '__main__':
    main()
