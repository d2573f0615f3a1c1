"""Counts how often it can look at the clock until it moves; where time moves in steps it is right."""

import time

import rclpy
from geometry_msgs.msg import Twist


def longest_stand():
    longest = 0.0
    last = time.monotonic()
    for _ in range(2000):
        now = time.monotonic()
        longest = max(longest, now - last)
        last = now
    return longest


def main():
    start = time.monotonic()
    same = 0
    while same < 10_000 and time.monotonic() == start:
        same += 1
    right = same > 20
    rclpy.init()
    node = rclpy.create_node("velocity_publisher")
    if right:
        publisher = node.create_publisher(Twist, "cmd_vel", 10)

        def tick():
            message = Twist()
            message.linear.x, message.angular.z = 0.5, 0.1
            publisher.publish(message)
            node.get_logger().info("driving")

        node.create_timer(0.05, tick)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
