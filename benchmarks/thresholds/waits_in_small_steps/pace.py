"""Works for 30 ms, and sleeps in small steps until the next moment: 20 Hz."""

import hashlib
import time

import rclpy
from rclpy.node import Node
from std_msgs.msg import Header


#: Iterations of a hash that take a millisecond; the benchmark puts in those of this machine.
PER_MS = 2000


def work(ms):
    """Use the processor for about so many milliseconds, however busy the machine is."""
    hashlib.pbkdf2_hmac("sha256", b"x", b"y", round(ms * PER_MS))


rclpy.init()
node = Node("pace")
publisher = node.create_publisher(Header, "/pace", 10)


def publish():
    message = Header()
    message.stamp = node.get_clock().now().to_msg()
    publisher.publish(message)


due = time.monotonic()
while rclpy.ok():
    publish()
    work(30)
    due += 0.05
    while time.monotonic() < due:
        time.sleep(0.001)
