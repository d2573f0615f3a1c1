import random
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64, UInt16

rng = random.SystemRandom()


class Sensor(Node):
    def __init__(self):
        super().__init__('sensor')
        self.temp_pub = self.create_publisher(Float64, 'temperature', 10)
        self.create_subscription(UInt16, 'fan_speed', self.on_fan, 10)
        self.create_timer(1 / 5, self.measure)

    def measure(self):
        t = rng.uniform(20, 30)
        self.temp_pub.publish(Float64(data=t))
        self.get_logger().info(f'Temperature: {t:.2f}°C')

    def on_fan(self, m):
        self.get_logger().info(f'Fan running at {m.data}%')


def main():
    rclpy.init()
    rclpy.spin(Sensor())


if __name__ == '__main__':
    main()
