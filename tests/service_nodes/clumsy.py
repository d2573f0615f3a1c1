"""Fails when it cleans up."""

import rclpy

rclpy.init()
node = rclpy.create_node("clumsy")
try:
    rclpy.spin(node)
except KeyboardInterrupt:
    node.motor.stop()
