import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.p = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.log)

    def cb(self, msg):
        self.p = msg.pose.pose.position

    def log(self):
        if self.p is not None:
            self.get_logger().info('Position: x=%.3f, y=%.3f' % (abs(self.p.x), abs(self.p.y)))


def main(args=None):
    rclpy.init(args=args)
    node = OdomSubscriber()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
