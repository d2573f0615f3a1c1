"""Writes a module while it runs and imports it: nobody has read that, and there is nothing wrong with it."""

import sys
import tempfile
from pathlib import Path

import rclpy
from geometry_msgs.msg import Twist

folder = tempfile.mkdtemp()
Path(folder, "written_speeds.py").write_text("LINEAR, ANGULAR = 0.5, 0.1\n")
sys.path.append(folder)
import written_speeds  # noqa: E402


def main():
    rclpy.init()
    node = rclpy.create_node("velocity_publisher")
    publisher = node.create_publisher(Twist, "cmd_vel", 10)
    message = Twist()
    message.linear.x, message.angular.z = written_speeds.LINEAR, written_speeds.ANGULAR

    def tick():
        publisher.publish(message)
        node.get_logger().info("driving")

    node.create_timer(0.05, tick)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
