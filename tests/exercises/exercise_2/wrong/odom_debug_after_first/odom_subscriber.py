import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node


class OdomSub(Node):
    def __init__(self):
        super().__init__('odom_sub')
        self.pos = None
        self.create_subscription(Odometry, '/odom', self.on_odom, 10)
        self.create_timer(1.0, self.on_timer)
        self.get_logger().info('odom subscriber is up')

    def on_odom(self, odom):
        self.pos = odom.pose.pose.position

    def on_timer(self):
        if self.pos is None:
            self.get_logger().info('no odometry yet')
            return
        self.get_logger().debug(f'x: {self.pos.x:.3f}, y: {self.pos.y:.3f}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSub())


if __name__ == '__main__':
    main()
