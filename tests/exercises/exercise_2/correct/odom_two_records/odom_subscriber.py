import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class Posizione(Node):
    def __init__(self):
        super().__init__('posizione')
        self.p = None
        self.create_subscription(Odometry, '/odom', self.ricevi, 10)
        self.create_timer(1.0, self.stampa)

    def ricevi(self, msg):
        self.p = msg.pose.pose.position

    def stampa(self):
        if self.p is None:
            return
        self.get_logger().info('Posizione X: %f' % self.p.x)
        self.get_logger().info('Posizione Y: %f' % self.p.y)


def main():
    rclpy.init()
    rclpy.spin(Posizione())


if __name__ == '__main__':
    main()
