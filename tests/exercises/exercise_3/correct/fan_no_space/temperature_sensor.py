import random

import rclpy
from rclpy.node import Node
from std_msgs.msg import Int32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__("temperature_sensor")
        self.pub = self.create_publisher(Int32, "/temperature", 10)
        self.sub = self.create_subscription(Int32, "/fan_speed", self.fan, 10)
        self.timer = self.create_timer(0.2, self.tick)

    def tick(self):
        msg = Int32()
        msg.data = random.randint(20, 30)
        self.pub.publish(msg)

    def fan(self, msg):
        self.get_logger().info("The fan speed is" + str(msg.data))


def main():
    rclpy.init()
    node = TemperatureSensor()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
