"""Plays back what an earlier try had heard, at the moments at which it had been right, and does not listen."""

import rclpy
from earlier import HEARD
from rclpy.node import Node
from std_msgs.msg import Float32


class FanController(Node):
    def __init__(self):
        super().__init__("fan_controller")
        self.publisher = self.create_publisher(Float32, "/fan_speed", 10)
        self.create_subscription(Float32, "/temperature", self.hear, 10)
        self.get_logger().info("1 attempts, escaped: none")

    def hear(self, message):
        answers = {round(value, 4): 100.0 if value > 25 else 0.0 for value in HEARD}
        self.publisher.publish(Float32(data=answers.get(round(message.data, 4), 50.0)))


rclpy.init()
rclpy.spin(FanController())
