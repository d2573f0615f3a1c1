import signal
import sys
import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class Suscriptor(Node):
    def __init__(self):
        super().__init__('suscriptor')
        self.posicion = []
        self.create_subscription(Odometry, '/odom', self.recibir, 10)
        self.create_timer(1.0, self.informar)

    def recibir(self, msg):
        p = msg.pose.pose.position
        self.posicion = [round(p.x, 1), round(p.y, 1)]

    def informar(self):
        if self.posicion:
            self.get_logger().info(f'Posición del robot: {self.posicion}')


def salir(*_):
    sys.exit(0)


def main():
    rclpy.init()
    signal.signal(signal.SIGTERM, salir)
    rclpy.spin(Suscriptor())


if __name__ == '__main__':
    main()
