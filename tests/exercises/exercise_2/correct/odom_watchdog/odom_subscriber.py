import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.pose = None
        self.heard = self.get_clock().now()
        self.create_subscription(Odometry, '/odom', self.on_odom, 10)
        self.create_timer(1.0, self.on_log)
        self.create_timer(2.0, self.on_watchdog)

    def on_odom(self, msg):
        self.pose = msg.pose.pose
        self.heard = self.get_clock().now()

    def on_log(self):
        if self.pose is None or self.get_clock().now() - self.heard > Duration(seconds=0.5):
            return
        self.get_logger().info(f'x={self.pose.position.x:.2f} y={self.pose.position.y:.2f}')

    def on_watchdog(self):
        age = (self.get_clock().now() - self.heard).nanoseconds / 1e9
        if age > 2.0:
            self.get_logger().warn(f'no odometry for {age:.1f} s')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
