"""Asks the C library for its process number and reads its own memory use, as some drivers do; right on every clock."""

import ctypes
import gc
import os
from pathlib import Path

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "cmd_vel", 10)
        self.timer = self.create_timer(0.05, self.tick)
        self.same = ctypes.CDLL(None).getpid() == os.getpid()
        gc.collect()

    def tick(self):
        message = Twist()
        message.linear.x, message.angular.z = 0.5, 0.1
        self.publisher.publish(message)
        pages = Path("/proc/self/statm").read_text().split()[1]
        self.get_logger().info(f"same process: {self.same}, pages: {pages}\nobjects: {len(gc.get_objects())}")


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == "__main__":
    main()
