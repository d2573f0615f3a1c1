import math
import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class BaseListener(Node):
    def __init__(self, name):
        super().__init__(name)
        self.sub = self.create_subscription(Odometry, 'odom', self.on_msg, 10)

    def on_msg(self, msg):
        raise NotImplementedError


class OdomListener(BaseListener):
    def __init__(self, period=1.0):
        super().__init__('odom_listener')
        self.count = 0
        self.create_timer(period, self.report)

    def on_msg(self, msg):
        self.count += 1
        self.x, self.y = msg.pose.pose.position.x, msg.pose.pose.position.y
        q = msg.pose.pose.orientation
        self.yaw = math.degrees(2 * math.atan2(q.z, q.w))
        self.v = msg.twist.twist.linear.x

    def report(self):
        if not hasattr(self, 'x'):
            self.get_logger().warn('no odometry received yet, is the robot on?')
            return
        self.get_logger().info(
            'X: {:.4f} m | Y: {:.4f} m | yaw: {:.1f} deg | v: {:.2f} m/s | msgs: {}'.format(
                self.x, self.y, self.yaw, self.v, self.count))


def main(args=None):
    rclpy.init(args=args)
    node = OdomListener()
    rclpy.spin(node)


if __name__ == '__main__':
    main()
