import math
import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class Tracker(Node):
    def __init__(self):
        super().__init__('tracker')
        self.n = 0
        self.distance = 0.0
        self.last = None
        self.speed = 0.0
        self.create_subscription(Odometry, '/odom', self.update, 10)
        self.create_timer(1.0, self.report)

    def update(self, msg):
        p = msg.pose.pose.position
        if self.last:
            self.distance += math.hypot(p.x - self.last.x, p.y - self.last.y)
        self.last = p
        self.speed = msg.twist.twist.linear.x
        self.n += 1

    def report(self):
        if not self.last:
            self.get_logger().info('Waiting for /odom (0 messages)')
            return
        self.get_logger().info('#%d | pos: (%.2f, %.2f) | v: %.2f m/s | travelled: %.1f m' % (
            self.n, self.last.x, self.last.y, self.speed, self.distance))


def main():
    rclpy.init()
    rclpy.spin(Tracker())


if __name__ == '__main__':
    main()
