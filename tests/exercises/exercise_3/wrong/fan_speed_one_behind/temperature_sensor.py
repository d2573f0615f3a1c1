import random

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class Sensor(Node):
    """Logs the fan speed that came before, and only then remembers the new one."""

    def __init__(self):
        super().__init__('temperature_sensor')
        self.pub = self.create_publisher(Float32, '/temperature', 10)
        self.create_subscription(Float32, '/fan_speed', self.on_speed, 10)
        self.speed = 0.0
        self.create_timer(0.2, self.measure)

    def measure(self):
        self.pub.publish(Float32(data=random.uniform(20.0, 30.0)))

    def on_speed(self, msg):
        self.get_logger().info(f'fan speed {self.speed:.0f}')
        self.speed = msg.data


def main():
    rclpy.init()
    rclpy.spin(Sensor())


if __name__ == '__main__':
    main()
