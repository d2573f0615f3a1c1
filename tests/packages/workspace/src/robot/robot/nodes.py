"""Two nodes in one module, each with an entry point of its own."""

import rclpy
from rclpy.node import Node
from std_msgs.msg import String

from robot.words import word


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.declare_parameter("rate", 1.0)
        self.declare_parameter("prefix", "none")
        self.publisher = self.create_publisher(String, "chatter", 10)
        self.create_timer(1.0 / self.get_parameter("rate").value, self.tick)
        self.count = 0

    def tick(self):
        self.count += 1
        self.publisher.publish(String(data=f"{self.get_parameter('prefix').value} {word(self.count)}"))


class Listener(Node):
    def __init__(self):
        super().__init__("listener")
        self.create_subscription(String, "chatter", self.heard, 10)
        self.publisher = self.create_publisher(String, "heard", 10)

    def heard(self, message):
        self.get_logger().info(f"{self.get_fully_qualified_name()} heard {message.data}")
        self.publisher.publish(String(data=message.data.upper()))


def run(kind):
    rclpy.init()
    try:
        rclpy.spin(kind())
    except KeyboardInterrupt:
        pass


def talk():
    run(Talker)


def listen():
    run(Listener)
