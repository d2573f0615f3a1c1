"""Computes for 15 to 45 ms, stamps and logs as programs do, and pauses for 50 ms: it publishes at 12 to 15 Hz."""

import hashlib
import logging
import time

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


def plan(number):
    """Take 15 to 45 ms on most machines."""
    hashlib.pbkdf2_hmac("sha256", b"path", b"", 30_000 + number * 7_000 % 60_000)


def main():
    rclpy.init()
    node = Node("velocity_publisher")
    publisher = node.create_publisher(Twist, "/cmd_vel", 10)
    message = Twist()
    message.linear.x = 0.5
    message.angular.z = 0.1
    number = 0
    while rclpy.ok():
        publisher.publish(message)
        node.get_logger().info(f"driving at {node.get_clock().now().nanoseconds}")
        number += 1
        plan(number)
        logging.info("planned at %s", time.time())
        time.sleep(0.05)


if __name__ == "__main__":
    main()
