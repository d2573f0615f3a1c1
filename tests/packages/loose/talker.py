"""Publishes at the rate that a parameter says, and logs what it was started with."""

import sys

import rclpy
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from std_msgs.msg import String


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.declare_parameter("rate", 1.0)
        self.declare_parameter("words.first", "none")
        self.declare_parameter("frame", "odom")
        self.declare_parameter("gains", [0.0])
        self.publisher = self.create_publisher(String, "chatter", 10)
        self.create_timer(1.0 / self.get_parameter("rate").value, self.tick)
        words = " ".join(remove_ros_args(sys.argv)[1:])
        values = [self.get_parameter(name).value for name in ("words.first", "frame", "gains")]
        self.get_logger().info(f"{words} {self.get_fully_qualified_name()} {values[0]!r} {values[1]} {list(values[2])}")

    def tick(self):
        self.publisher.publish(String(data="x"))


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(Talker())


if __name__ == "__main__":
    main()
