import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.done = False
        self.sub = self.create_subscription(Odometry, '/odom', self.callback, 10)

    def callback(self, msg):
        if not self.done:
            self.done = True
            p = msg.pose.pose.position
            self.get_logger().info(f'Position: x={p.x:.2f}, y={p.y:.2f}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
