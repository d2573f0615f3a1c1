import rclpy
from rclpy.logging import LoggingSeverity
from rclpy.node import Node
from nav_msgs.msg import Odometry


class Узел(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.get_logger().set_level(LoggingSeverity.DEBUG)
        self.поза = None
        self.create_subscription(Odometry, 'odom', self.приём, 10)
        self.create_timer(1.0, self.вывод)

    def приём(self, сообщение):
        self.поза = сообщение.pose.pose

    def вывод(self):
        if self.поза:
            p = self.поза.position
            self.get_logger().debug('Координаты робота: x = {0:.3f} м, y = {1:.3f} м'.format(p.x, p.y))


def main():
    rclpy.init()
    rclpy.spin(Узел())


if __name__ == '__main__':
    main()
