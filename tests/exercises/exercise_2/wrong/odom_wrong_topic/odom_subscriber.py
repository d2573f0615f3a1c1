import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.last = None
        self.create_subscription(Odometry, '/odometry/filtered', self.cb, 10)
        self.create_timer(1.0, self.log)

    def cb(self, msg):
        self.last = msg.pose.pose.position

    def log(self):
        if self.last:
            self.get_logger().info(f'x={self.last.x:.2f} y={self.last.y:.2f}')


def main(args=None):
    rclpy.init(args=args)
    node = OdomSubscriber()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
