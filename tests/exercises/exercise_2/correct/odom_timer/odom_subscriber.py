import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    """Logs the robot position once per second."""

    def __init__(self):
        super().__init__('odom_subscriber')
        self.subscription = self.create_subscription(Odometry, '/odom', self.odom_callback, 10)
        self.subscription  # prevent unused variable warning
        self.latest = None
        self.timer = self.create_timer(1.0, self.timer_callback)
        self.get_logger().info('Odometry subscriber 1 started, waiting for data on /odom')

    def odom_callback(self, msg: Odometry):
        self.latest = msg

    def timer_callback(self):
        if self.latest is None:
            return
        p = self.latest.pose.pose.position
        self.get_logger().info(f'Position: x={p.x:.2f}, y={p.y:.2f}')


def main(args=None):
    rclpy.init(args=args)
    node = OdomSubscriber()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
