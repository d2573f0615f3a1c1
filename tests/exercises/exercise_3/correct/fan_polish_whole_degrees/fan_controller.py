import rclpy
from rclpy.node import Node
from std_msgs.msg import Int16, UInt8

PRÓG = 25


class SterownikWentylatora(Node):
    def __init__(self):
        super().__init__('sterownik_wentylatora')
        self.wydawca = self.create_publisher(UInt8, '/fan_speed', 10)
        self.odbiorca = self.create_subscription(Int16, '/temperature', self.steruj, 10)

    def steruj(self, pomiar):
        gorąco = not pomiar.data <= PRÓG
        self.wydawca.publish(UInt8(data=(0, 100)[gorąco]))


def main():
    rclpy.init()
    rclpy.spin(SterownikWentylatora())


if __name__ == '__main__':
    main()
