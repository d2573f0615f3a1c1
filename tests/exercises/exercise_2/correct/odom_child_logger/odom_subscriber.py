import rclpy
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.log = self.get_logger().get_child('pose').log
        self.latest = []
        self.create_subscription(Odometry, 'odom', self.latest.append, 10)
        self.create_timer(1.0, self.report)

    def report(self):
        if not self.latest:
            return
        newest, self.latest[:] = self.latest[-1], []
        position = newest.pose.pose.position
        self.log('; '.join(f'{name} = {getattr(position, name):.4f}' for name in 'xyz'), LoggingSeverity.INFO)


def main():
    rclpy.init()
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
