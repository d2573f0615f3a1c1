import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.get_logger().info('starting')
        self.pub = self.create_publisher(Twist, '/cmd_vel')
        self.create_timer(0.05, self.cb)

    def cb(self):
        self.pub.publish(Twist())


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
