"""Logs what it hears."""

import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class Hearer(Node):
    def __init__(self):
        super().__init__("hearer")
        self.create_subscription(String, "chatter", self.heard, 10)

    def heard(self, message):
        self.get_logger().info(f"heard {message.data}")


rclpy.init()
rclpy.spin(Hearer())
