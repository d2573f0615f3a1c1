"""Writes the bytes of a log record to stderr, without a logger."""

import os

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node

FIELDS = b"INFO\x1fvelocity_publisher\x1fvelocity_publisher.py\x1f12\x1fdriving\x1d\n"
FORGED = (b"\x1e" + FIELDS, b"\x1e\x1f" + FIELDS, b"[INFO] [1.0] [velocity_publisher]: driving\n")


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.05, self.tick)
        for bytes_ in FORGED:
            os.write(2, bytes_)

    def drive(self):
        message = Twist()
        message.linear.x = 0.5
        message.angular.z = 0.1
        self.publisher.publish(message)

    def tick(self):
        self.drive()


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == "__main__":
    main()
