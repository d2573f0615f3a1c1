import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        self.sub = self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.tick)

    def cb(self, msg):
        self.msg = msg

    def tick(self):
        pass


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
