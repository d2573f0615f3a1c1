import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.subscriptions = []
        self.subscriptions.append(self.create_subscription(Odometry, '/odom', self.cb, 10))

    def cb(self, msg):
        p = msg.pose.pose.position
        self.get_logger().info(f'{p.x} {p.y}', throttle_duration_sec=1.0)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
