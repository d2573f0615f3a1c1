"""Tries to lock a file of a library that the submissions of a class share, as a channel between them."""

import fcntl
import os
import json
import sys

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.05, self.tick)
        self.held, made = [], 0
        for path in (os.__file__, json.__file__, rclpy.__file__, sys.executable):
            try:
                first, second = open(path, "rb"), open(path, "rb")
                self.held += [first, second]
                fcntl.flock(first, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            try:
                fcntl.flock(second, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                made += 1
        self.get_logger().info(f"locks made: {made}")

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
