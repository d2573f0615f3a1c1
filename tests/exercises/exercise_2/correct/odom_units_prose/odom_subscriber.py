import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class Narrator(Node):
    def __init__(self):
        super().__init__('narrator')
        self.count = 0
        self.report_no = 0
        self.last = None
        self.create_subscription(Odometry, '/odom', self.heard, 10)
        self.create_timer(1.0, self.tell)

    def heard(self, msg):
        self.count += 1
        self.last = msg.pose.pose.position

    def tell(self):
        if self.last is None:
            return
        self.report_no += 1
        self.get_logger().info(
            f'[{self.report_no}] after {self.count} messages the robot is '
            f'{self.last.x:.2f} metres east and {self.last.y:.2f} metres north of its start')


def main():
    rclpy.init()
    rclpy.spin(Narrator())


if __name__ == '__main__':
    main()
