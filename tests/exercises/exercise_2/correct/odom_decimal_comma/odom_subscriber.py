import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class KonumDinleyici(Node):
    def __init__(self):
        super().__init__('konum_dinleyici')
        self.konum = None
        self.create_subscription(Odometry, '/odom', self.geldi, 10)
        self.create_timer(1.0, self.yaz)

    def geldi(self, mesaj):
        self.konum = mesaj.pose.pose.position

    def yaz(self):
        if self.konum is None:
            self.get_logger().info('Odometri bekleniyor...')
            return
        metin = 'Robotun konumu: x=%.2f; y=%.2f metre' % (self.konum.x, self.konum.y)
        self.get_logger().info(metin.replace('.', ','))


def main():
    rclpy.init()
    rclpy.spin(KonumDinleyici())


if __name__ == '__main__':
    main()
