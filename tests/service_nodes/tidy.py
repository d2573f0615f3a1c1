"""Cleans up after Ctrl-C as the textbook does: what rclpy has shut down already is shut down once more."""

import contextlib
import threading
import time

import rclpy
from rclpy.executors import MultiThreadedExecutor

rclpy.init()
node = rclpy.create_node("tidy")
executor = MultiThreadedExecutor()
executor.add_node(node)
threading.Thread(target=executor.spin, daemon=True).start()
with contextlib.suppress(KeyboardInterrupt):
    while True:
        time.sleep(1.0)
node.destroy_node()
rclpy.shutdown()
