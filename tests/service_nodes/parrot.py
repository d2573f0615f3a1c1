"""Says what it hears, and a word that can be changed."""

import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class Parrot(Node):
    def __init__(self):
        super().__init__("parrot")
        self.declare_parameter("word", "hello")
        self.said = self.create_publisher(String, "/said", 10)
        self.create_subscription(String, "/heard", self.say, 10)

    def say(self, heard):
        self.said.publish(String(data=f"{heard.data} {self.get_parameter('word').value}"))


def main():
    rclpy.init()
    rclpy.spin(Parrot())


if __name__ == "__main__":
    main()
