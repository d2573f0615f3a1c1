"""Logs when and with which hashes it runs."""

import time

import rclpy
from geometry_msgs.msg import Twist


def main():
    now, uptime, letters = time.time(), time.monotonic(), list(set("abcdefghijklmnop"))
    rclpy.init()
    node = rclpy.create_node("velocity_publisher")
    publisher = node.create_publisher(Twist, "cmd_vel", 10)

    def tick():
        publisher.publish(Twist())
        node.get_logger().info(f"{now:.0f} {uptime:.0f} {''.join(letters)}")

    node.create_timer(0.05, tick)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
