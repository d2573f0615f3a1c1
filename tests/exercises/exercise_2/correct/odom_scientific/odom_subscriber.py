import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class Sci(Node):
    def __init__(self):
        super().__init__('sci')
        self.p = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.tick)

    def cb(self, m):
        self.p = (m.pose.pose.position.x, m.pose.pose.position.y)

    def tick(self):
        if self.p:
            self.get_logger().info('x: {:.3e}, y: {:.3E}'.format(*self.p))


def main():
    rclpy.init()
    rclpy.spin(Sci())


if __name__ == '__main__':
    main()
