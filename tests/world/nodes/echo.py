"""Answers each text on /in with the same text on /out, and logs it."""

import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class Echo(Node):
    """Publishes what it hears."""

    def __init__(self):
        super().__init__("echo")
        self.out = self.create_publisher(String, "/out", 10)
        self.create_subscription(String, "/in", self.on_text, 10)

    def on_text(self, message):
        """Answer, or fail if that is what the text asks for."""
        self.get_logger().info(f"heard {message.data}")
        if message.data == "fail":
            raise ValueError("asked to fail")
        self.out.publish(message)


rclpy.init()
rclpy.spin(Echo())
