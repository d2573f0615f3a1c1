from random import gauss
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Thermometer(Node):
    def __init__(self):
        super().__init__('thermometer')
        self.publisher = self.create_publisher(Float64, '/temperature', 10)
        self.subscriber = self.create_subscription(Float64, '/fan_speed', self.show, 10)
        self.create_timer(0.2, self.read)

    def read(self):
        value = max(20.0, min(30.0, gauss(25.0, 2.0)))
        self.publisher.publish(Float64(data=value))

    def show(self, speed):
        self.get_logger().info(f'fan={speed.data:.1f}')


def main():
    rclpy.init()
    rclpy.spin(Thermometer())


if __name__ == '__main__':
    main()
