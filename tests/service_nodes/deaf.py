"""Goes on after Ctrl-C, for ever."""

import contextlib
import time

import rclpy

rclpy.init()
node = rclpy.create_node("deaf")
while True:
    with contextlib.suppress(KeyboardInterrupt):
        time.sleep(0.7)
