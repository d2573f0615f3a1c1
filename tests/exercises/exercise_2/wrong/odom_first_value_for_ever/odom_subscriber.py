import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.position = None
        self.create_subscription(Odometry, '/odom', self.callback, 10)
        self.create_timer(1.0, self.log)

    def callback(self, msg):
        if self.position is None:
            self.position = (msg.pose.pose.position.x, msg.pose.pose.position.y)

    def log(self):
        if self.position is not None:
            self.get_logger().info('position: %.3f %.3f' % self.position)


def main(args=None):
    rclpy.init(args=args)
    node = OdomSubscriber()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
