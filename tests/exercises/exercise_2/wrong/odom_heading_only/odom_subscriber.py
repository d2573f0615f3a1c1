import math

import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.yaw = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.tick)

    def cb(self, msg):
        q = msg.pose.pose.orientation
        self.yaw = 2 * math.atan2(q.z, q.w)

    def tick(self):
        if self.yaw is not None:
            self.get_logger().info(f'heading {self.yaw:.3f} rad')


def main():
    rclpy.init()
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
