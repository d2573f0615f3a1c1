import random

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        self.publisher = self.create_publisher(Float32, '/temperature', 10)
        self.create_subscription(Float32, '/fan_speed', self.fan_speed, 10)
        self.create_timer(0.2, self.measure)
        self.count = 0
        self.speed = None

    def measure(self):
        temperature = random.uniform(20.0, 30.0)
        self.publisher.publish(Float32(data=temperature))
        self.get_logger().info(f'[{"=" * int(3 * (temperature - 20)):30}] {temperature:.1f} C')

    def fan_speed(self, msg):
        self.count += 1
        if msg.data == self.speed:
            return
        self.speed = msg.data
        if msg.data == 0:
            self.get_logger().info(f'message{self.count}: the fan stands still (0 of 100 %)')
        elif msg.data == 100:
            self.get_logger().warn(f'message{self.count}: FULL SPEED, 100 %!')
        elif msg.data > 50:
            self.get_logger().info(f'message{self.count}: fast |{"#" * int(msg.data / 5)}| {msg.data:.0f} %')
        else:
            self.get_logger().info(f'message{self.count}: slow |{"#" * int(msg.data / 5)}| {msg.data:.0f} %')


def main():
    rclpy.init()
    rclpy.spin(TemperatureSensor())


if __name__ == '__main__':
    main()
