import rclpy
from rclpy.node import Node
from rclpy.time import Time
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self, robot=1):
        super().__init__(f'odom_subscriber_{robot}')
        self.robot = robot
        self.count = 0
        self.last = None
        self.create_subscription(Odometry, 'odom', self.cb, 10)
        self.create_timer(1.0, self.tick)

    def cb(self, m):
        self.count += 1
        self.last = m

    def tick(self):
        if self.last is None:
            return
        stamp = Time.from_msg(self.last.header.stamp).nanoseconds / 1e9
        p, t = self.last.pose.pose.position, self.last.twist.twist
        self.get_logger().info(
            f'[robot{self.robot}] #{self.count} t={stamp:.3f} pos: {p.x:.2f} {p.y:.2f} '
            f'vel: {t.linear.x:.2f} {t.angular.z:.2f}')


def main():
    rclpy.init()
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
