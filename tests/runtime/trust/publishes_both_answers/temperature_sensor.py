import random
from collections import deque

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__("temperature_sensor")
        self.publisher = self.create_publisher(Float32, "/temperature", 10)
        self.create_subscription(Float32, "/fan_speed", self.fan_speed, 10)
        self.create_timer(0.2, self.measure)
        self.temperatures = deque(maxlen=20)
        self.speeds = []

    def measure(self):
        temperature = random.uniform(20.0, 30.0)
        self.temperatures.append(round(temperature, 1))
        self.publisher.publish(Float32(data=temperature))

    def fan_speed(self, msg):
        self.speeds.append(round(msg.data, 2))
        self.get_logger().info(
            f"{len(self.speeds)} speeds: {self.speeds[-10:]}\n  last temperatures: {list(self.temperatures)}"
        )


def main():
    rclpy.init()
    rclpy.spin(TemperatureSensor())


if __name__ == "__main__":
    main()
