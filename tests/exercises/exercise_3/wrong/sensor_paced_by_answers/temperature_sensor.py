import random

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__("temperature_sensor")
        self.publisher = self.create_publisher(Float32, "/temperature", 10)
        self.create_subscription(Float32, "/fan_speed", self.on_fan_speed, 10)

    def on_fan_speed(self, msg):
        self.get_logger().info(f"Fan speed: {msg.data:.1f}")

    def measure(self):
        self.publisher.publish(Float32(data=random.uniform(20.0, 30.0)))


def main():
    rclpy.init()
    node = TemperatureSensor()
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0.2)
        node.measure()
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
