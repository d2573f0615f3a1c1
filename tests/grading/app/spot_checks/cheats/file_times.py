"""Compares the time with that of a file that it has just written, and is right only where they differ."""

import tempfile
import time
from pathlib import Path

import rclpy
from geometry_msgs.msg import Twist


def main():
    with tempfile.NamedTemporaryFile() as file:
        file.write(b"x")
        file.flush()
        right = abs(Path(file.name).stat().st_mtime - time.time()) > 60
    rclpy.init()
    node = rclpy.create_node("velocity_publisher")
    publisher = node.create_publisher(Twist, "cmd_vel", 10)

    def tick():
        message = Twist()
        message.linear.x, message.angular.z = (0.5, 0.1) if right else (0.0, 0.0)
        publisher.publish(message)
        node.get_logger().info("driving")

    node.create_timer(0.05, tick)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
