import time

import rclpy
from nav_msgs.msg import Odometry


class Tracker:
    def __init__(self, node):
        self.node = node
        self.position = None
        node.create_subscription(Odometry, '/odom', self.update, 10)

    def update(self, msg):
        self.position = msg.pose.pose.position

    def report(self):
        if self.position is not None:
            self.node.get_logger().info(f'x = {self.position.x:.2f}, y = {self.position.y:.2f}')


def main():
    rclpy.init()
    node = rclpy.create_node('odom_subscriber')
    tracker = Tracker(node)
    last = time.monotonic()
    while rclpy.ok():
        for _ in range(10):
            rclpy.spin_once(node, timeout_sec=0.0)
        if time.monotonic() - last > 1.0:
            last = time.monotonic()
            tracker.report()
        time.sleep(0.125)


if __name__ == '__main__':
    main()
