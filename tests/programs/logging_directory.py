"""Asks where its log file is, and logs through Python's own logging as well."""
import logging
import os

import rclpy
from rclpy.logging import get_logging_directory

rclpy.init()
node = rclpy.create_node("files")
print(os.path.isabs(get_logging_directory()), get_logging_directory().name)
logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s %(message)s")
logging.getLogger("student").info("from Python's logging")
node.get_logger().info("from rclpy")
node.destroy_node()
