"""A publisher class of its own that counts what it sends."""
import rclpy
from rclpy.node import Node
from rclpy.publisher import Publisher
from std_msgs.msg import String


class Counting(Publisher):
    sent = 0

    def publish(self, message):
        type(self).sent += 1
        super().publish(String(data=f"{self.sent}: {message.data}"))


class Words(Node):
    def __init__(self):
        super().__init__("words")
        self.out = self.create_publisher(String, "words", 10, publisher_class=Counting)
        self.get_logger().info(f"{self.out.topic_name} {self.out.logger_name} {type(self.out).__name__}")
        self.create_timer(0.5, lambda: self.out.publish(String(data="hello")))


rclpy.init()
rclpy.spin(Words())
