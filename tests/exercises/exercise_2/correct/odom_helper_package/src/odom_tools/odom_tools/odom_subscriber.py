import rclpy
from nav_msgs.msg import Odometry

from odom_tools.base import PeriodicNode


class OdomSubscriber(PeriodicNode):
    position = None

    def __init__(self):
        super().__init__('odom_subscriber')
        self.create_subscription(Odometry, 'odom', self.save, 10)

    def save(self, msg):
        self.position = msg.pose.pose.position

    def every_period(self):
        if self.position is not None:
            self.get_logger().info('x=%(x).3f y=%(y).3f' % {'x': self.position.x, 'y': self.position.y})


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())
