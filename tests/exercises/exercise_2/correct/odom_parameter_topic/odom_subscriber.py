import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomLogger(Node):
    def __init__(self):
        super().__init__('odom_logger', namespace='robot1')
        self.declare_parameters('', [('odom_topic', '/odom'), ('log_period', 1.0)])
        self.position = None
        self.create_subscription(Odometry, self.get_parameter('odom_topic').value, self.update, 10)
        self.create_timer(self.get_parameter('log_period').value, self.report)
        self.get_logger().info('waiting for odometry')

    def update(self, msg):
        self.position = msg.pose.pose.position

    def report(self):
        if self.position is None:
            return
        self.get_logger().info(f'Position: x={self.position.x:.2f}, y={self.position.y:.2f}')


def main(args=None):
    rclpy.init(args=args)
    node = OdomLogger()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    node.destroy_node()


if __name__ == '__main__':
    main()
