import rclpy
from rclpy.node import Node

from geometry_msgs.msg import Twist

from commands import circle_command


class VelocityPublisher(Node):

    def __init__(self):
        super().__init__('velocity_publisher')
        self.cmd_pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.05, self.on_timer)

    def on_timer(self):
        self.cmd_pub.publish(circle_command())
        self.get_logger().info('command sent')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
