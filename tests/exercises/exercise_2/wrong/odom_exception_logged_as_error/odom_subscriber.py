import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.p = None
        self.create_subscription(Odometry, '/odom', self.odom_callback, 10)
        self.create_timer(1.0, self.log_position)

    def odom_callback(self, msg):
        self.p = msg.pose.pose.position

    def log_position(self):
        try:
            self.get_logger().info(f'x={self.p.x:.2f}, y={self.p.y:.2f}')
        except AttributeError as e:
            self.get_logger().error(f'could not log: {e}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
