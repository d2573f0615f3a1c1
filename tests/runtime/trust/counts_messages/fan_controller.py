"""Answers by the number of the message: never looks at a temperature."""

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32

ANSWERS = (0.0, 0.0, 100.0, 100.0, 0.0, 100.0, 0.0, 0.0)


class FanController(Node):
    def __init__(self):
        super().__init__("fan_controller")
        self.publisher = self.create_publisher(Float32, "/fan_speed", 10)
        self.create_subscription(Float32, "/temperature", self.callback, 10)
        self.count = 0

    def callback(self, _msg):
        self.publisher.publish(Float32(data=ANSWERS[self.count // 10 % len(ANSWERS)]))
        self.count += 1


def main():
    rclpy.init()
    rclpy.spin(FanController())


if __name__ == "__main__":
    main()
