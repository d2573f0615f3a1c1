"""Leaves ROS by the end of a with block, right after a last command."""

import contextlib
import time

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


def command():
    message = Twist()
    message.linear.x = 0.5
    message.angular.z = 0.1
    return message


@contextlib.contextmanager
def ros():
    rclpy.init()
    node = Node("velocity_publisher")
    try:
        yield node
    finally:
        node.destroy_node()
        rclpy.shutdown()


def main():
    with ros() as node:
        publisher = node.create_publisher(Twist, "/cmd_vel", 10)
        node.get_logger().info("driving for 5 s")
        for _ in range(100):
            publisher.publish(command())
            time.sleep(0.05)
        publisher.publish(Twist())


if __name__ == "__main__":
    main()
