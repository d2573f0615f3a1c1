import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomTable(Node):
    def __init__(self):
        super().__init__('odom_table')
        self.row = None
        self.rows = 0
        self.create_subscription(Odometry, 'odom', self.fill, 10)
        self.create_timer(1.0, self.draw)
        self.get_logger().info('+------+----------+----------+')
        self.get_logger().info('|    n |   x in m |   y in m |')
        self.get_logger().info('+------+----------+----------+')

    def fill(self, msg):
        self.row = (msg.pose.pose.position.x, msg.pose.pose.position.y)

    def draw(self):
        if self.row is not None:
            self.rows += 1
            self.get_logger().info('| {:4d} | {:8.3f} | {:8.3f} |'.format(self.rows, *self.row))


def main():
    rclpy.init()
    rclpy.spin(OdomTable())


if __name__ == '__main__':
    main()
