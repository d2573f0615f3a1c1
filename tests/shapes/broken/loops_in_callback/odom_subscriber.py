import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.create_subscription(Odometry, '/odom', self.callback, 10)

    def callback(self, msg):
        n = 0
        while n >= 0:
            n += 1
        self.get_logger().info(f'{msg.pose.pose.position.x} {msg.pose.pose.position.y}')


def main(args=None):
    rclpy.init(args=args)
    node = OdomSubscriber()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
