import time
import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.pos = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        while self.pos is None:
            self.get_logger().info('waiting for odometry')
            time.sleep(1.0)
        self.create_timer(1.0, self.tick)

    def cb(self, msg):
        self.pos = msg.pose.pose.position

    def tick(self):
        self.get_logger().info(f'{self.pos.x:.3f} {self.pos.y:.3f}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
