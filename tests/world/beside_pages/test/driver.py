"""Repeats the scans that it hears, while it has a rate and a port."""

import rclpy
from sensor_msgs.msg import LaserScan

rclpy.init()
node = rclpy.create_node("driver")
node.declare_parameter("rate", 1.0)
node.declare_parameter("port", "")
out = node.create_publisher(LaserScan, "/out", 10)
node.create_subscription(LaserScan, "/scan", out.publish, 10)
rclpy.spin(node)
