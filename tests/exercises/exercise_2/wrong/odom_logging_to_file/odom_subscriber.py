import logging

import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry

logger = logging.getLogger('odom')
logger.setLevel(logging.INFO)
handler = logging.FileHandler('/tmp/odom.log')
handler.setFormatter(logging.Formatter('%(asctime)s %(message)s'))
logger.addHandler(handler)


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.pos = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.tick)
        self.get_logger().info('logging into /tmp/odom.log')

    def cb(self, msg):
        self.pos = msg.pose.pose.position

    def tick(self):
        if self.pos is not None:
            logger.info('x=%.2f y=%.2f', self.pos.x, self.pos.y)


def main():
    rclpy.init()
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
