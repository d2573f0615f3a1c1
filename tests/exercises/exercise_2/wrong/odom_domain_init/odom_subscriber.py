import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node

DOMAENE = 17


class Odometrie(Node):
    def __init__(self):
        super().__init__('odometrie')
        self.letzte = None
        self.create_subscription(Odometry, '/odom', self.neu, 10)
        self.create_timer(1.0, self.zeigen)

    def neu(self, msg):
        self.letzte = msg.pose.pose.position

    def zeigen(self):
        if self.letzte is not None:
            self.get_logger().info(f'x = {self.letzte.x:.2f} m, y = {self.letzte.y:.2f} m')


def main(args=None):
    rclpy.init(args=args, domain_id=DOMAENE)
    rclpy.spin(Odometrie())


if __name__ == '__main__':
    main()
