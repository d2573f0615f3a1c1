"""A controller that publishes the grader's own stimulus as well, always with a cold temperature, and never switches on."""

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class FanController(Node):
    def __init__(self):
        super().__init__("fan_controller")
        self.speed = self.create_publisher(Float32, "/fan_speed", 10)
        self.temperature = self.create_publisher(Float32, "/temperature", 10)
        self.create_subscription(Float32, "/temperature", self.answer, 10)
        self.create_timer(0.05, lambda: self.temperature.publish(Float32(data=20.0)))
        self.get_logger().info("1 attempts, escaped: none")

    def answer(self, message):
        self.speed.publish(Float32(data=0.0))


rclpy.init()
rclpy.spin(FanController())
