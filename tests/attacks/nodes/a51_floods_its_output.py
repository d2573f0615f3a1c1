"""Writes without end: without line breaks, with zeros, with starts of log records that never end."""

import os

from attempts import attempt, run


@attempt
def writes(node):
    node.get_logger().info("1 attempts, escaped: none")
    for part in (b"y" * 65536, b"\0" * 65536, b"\x1eINFO\x1f" * 8192):
        for stream in (1, 2):
            for _ in range(200):
                os.write(stream, part)
    return False


run()
