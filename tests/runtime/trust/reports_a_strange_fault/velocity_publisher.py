"""Reports a fault at a place that is no file of the submission."""

import gc
import json

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


def links():
    """Return what in this process speaks to whoever started it."""
    gc.unfreeze()  # what was there before a fork
    return [o for o in gc.get_objects() if type(o).__name__ == "Link" and hasattr(o, "send")]


def say(link, report):
    """Send a report that the host would not."""
    link._socket.sendall(json.dumps(report).encode() + b"\n")


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.05, self.tick)
        self.get_logger().info("driving")
        place = {"file": "../../etc/passwd", "line": 10**30, "frames": ["../../etc/passwd:1 in root"]}
        for link in links():
            say(link, {"kind": "fault", "fault": "exception", "text": "KeyError: 30 of 30", **place})

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
