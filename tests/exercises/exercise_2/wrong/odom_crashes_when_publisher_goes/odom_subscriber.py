import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.p = None
        self.heard = None
        self.create_subscription(Odometry, '/odom', self.odom_callback, 10)
        self.create_timer(1.0, self.log_position)

    def odom_callback(self, msg):
        self.p = msg.pose.pose.position
        self.heard = self.get_clock().now()

    def log_position(self):
        if self.p is None:
            return
        if (self.get_clock().now() - self.heard).nanoseconds > 1e9:
            raise RuntimeError('odometry lost')
        self.get_logger().info(f'Position: x={self.p.x:.2f}, y={self.p.y:.2f}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
