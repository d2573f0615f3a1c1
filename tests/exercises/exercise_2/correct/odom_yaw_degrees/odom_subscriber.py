import math
import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.subscription = self.create_subscription(Odometry, 'odom', self.odom_callback, 10)
        self.subscription  # prevent unused variable warning
        self.timer = self.create_timer(1.0, self.timer_callback)
        self.x = 0.0
        self.y = 0.0
        self.yaw = 0.0
        self.received = False

    def odom_callback(self, msg):
        self.x = msg.pose.pose.position.x
        self.y = msg.pose.pose.position.y
        q = msg.pose.pose.orientation
        self.yaw = math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
        self.received = True

    def timer_callback(self):
        if self.received:
            self.get_logger().info('Robot at x: %.3f m, y: %.3f m, heading %.1f°' % (
                self.x, self.y, math.degrees(self.yaw)))
        else:
            self.get_logger().warning('No odometry yet')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
