import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class CsvLogger(Node):
    def __init__(self):
        super().__init__('csv_logger')
        self.msg = None
        self.get_logger().info('t,x,y')
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.row)

    def cb(self, msg):
        self.msg = msg

    def row(self):
        if self.msg is None:
            return
        stamp = self.msg.header.stamp
        p = self.msg.pose.pose.position
        self.get_logger().info(f'{stamp.sec}.{stamp.nanosec:09d},{p.x:.5f},{p.y:.5f}')


def main():
    rclpy.init()
    rclpy.spin(CsvLogger())


if __name__ == '__main__':
    main()
