import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.msg = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.log)

    def cb(self, msg):
        self.msg = msg

    def log(self):
        if self.msg is None:
            return
        x = self.msg.twist.twist.linear.x
        y = self.msg.twist.twist.linear.y
        self.get_logger().info(f'Position: x={x:.2f}, y={y:.2f}')


def main(args=None):
    rclpy.init(args=args)
    node = OdomSubscriber()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
