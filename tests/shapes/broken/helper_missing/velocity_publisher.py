import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist
from velocity_utils import make_twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, lambda: self.pub.publish(make_twist(0.5, 0.1)))


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
