"""Works for 9 ms before each pause, and waits for an event with a time-out after a look at a clock: 17 Hz."""

import hashlib
import threading
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


stop = threading.Event()
while rclpy.ok():
    publish()
    work(9)
    node.get_logger().debug(f"{time.monotonic()}")
    stop.wait(0.05)
