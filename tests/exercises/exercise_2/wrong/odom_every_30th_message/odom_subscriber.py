import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.subscription = self.create_subscription(Odometry, '/odom', self.listener_callback, 10)
        self.i = 0

    def listener_callback(self, msg):
        self.i += 1
        if self.i % 30 == 0:
            pos = msg.pose.pose.position
            self.get_logger().info('Position: "%.2f, %.2f"' % (pos.x, pos.y))


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
