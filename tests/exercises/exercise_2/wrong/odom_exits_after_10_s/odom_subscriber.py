import time
import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.pos = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.tick)

    def cb(self, msg):
        self.pos = msg.pose.pose.position

    def tick(self):
        if self.pos:
            self.get_logger().info(f'{self.pos.x:.3f} {self.pos.y:.3f}')


def main(args=None):
    rclpy.init(args=args)
    node = OdomSubscriber()
    end = time.time() + 10
    while time.time() < end:
        rclpy.spin_once(node, timeout_sec=0.1)
    node.get_logger().info('done')
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
