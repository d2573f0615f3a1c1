import rclpy
from random import randrange
from rclpy.node import Node
from std_msgs.msg import Int16, UInt8


class CzujnikTemperatury(Node):
    def __init__(self):
        super().__init__('czujnik_temperatury')
        self.wydawca = self.create_publisher(Int16, '/temperature', 10)
        self.odbiorca = self.create_subscription(UInt8, '/fan_speed', self.prędkość, 10)
        self.zegar = self.create_timer(0.2, self.pomiar)

    def pomiar(self):
        wiadomość = Int16()
        wiadomość.data = randrange(20, 31)
        self.wydawca.publish(wiadomość)
        self.get_logger().info(f'zmierzono {wiadomość.data} °C')

    def prędkość(self, wiadomość):
        self.get_logger().info(f'prędkość wentylatora: {wiadomość.data}%')


def main():
    rclpy.init()
    węzeł = CzujnikTemperatury()
    try:
        rclpy.spin(węzeł)
    except KeyboardInterrupt:
        print('zatrzymano')


if __name__ == '__main__':
    main()
