import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.get_logger().info('starting')
        self.sub = self.create_subscription(Odometry, '/odom', self.odom_callback, 10)

    def odom_callback(self):
        self.get_logger().info('got odometry')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
