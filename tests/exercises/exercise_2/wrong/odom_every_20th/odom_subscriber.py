import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.n = 0
        self.create_subscription(Odometry, '/odom', self.cb, 10)

    def cb(self, msg):
        self.n += 1
        if self.n == 20:
            self.n = 0
            self.get_logger().info('%.2f, %.2f' % (msg.pose.pose.position.x, msg.pose.pose.position.y))


def main():
    rclpy.init()
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
