import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile, QoSReliabilityPolicy
from nav_msgs.msg import Odometry


class PositionLogger(Node):

    def __init__(self):
        super().__init__('position_logger')
        self.last_log = None
        profile = QoSProfile(depth=1)
        profile.reliability = QoSReliabilityPolicy.BEST_EFFORT
        self.sub = self.create_subscription(Odometry, 'odom', self.listener, profile)

    def listener(self, odom):
        now = self.get_clock().now()
        if self.last_log is not None and now - self.last_log < Duration(seconds=1):
            return
        self.last_log = now
        self.get_logger().info(str(odom.pose.pose.position))


if __name__ == '__main__':
    rclpy.init()
    rclpy.spin(PositionLogger())
