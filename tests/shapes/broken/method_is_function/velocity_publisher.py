import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


def make_command():
    cmd = Twist()
    cmd.linear.x = 0.5
    cmd.angular.z = 0.1
    return cmd


class Sender(Node):
    def __init__(self):
        super().__init__('sender')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, self.send)
        self.get_logger().info('sending')

    def send(self):
        self.pub.publish(self.make_command())


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(Sender())


if __name__ == '__main__':
    main()
