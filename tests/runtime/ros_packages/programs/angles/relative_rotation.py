"""How much a robot has turned between two readings of its compass."""

import math

import rclpy
from tf_transformations import euler_from_quaternion, quaternion_from_euler, quaternion_inverse, quaternion_multiply

rclpy.init()
node = rclpy.create_node("compass")
before, after = quaternion_from_euler(0, 0, math.radians(170)), quaternion_from_euler(0, 0, math.radians(-170))
turned = quaternion_multiply(after, quaternion_inverse(before))
node.get_logger().info(f"{math.degrees(euler_from_quaternion(turned)[2]):.1f} degrees")
twice = quaternion_multiply(turned, turned)
node.get_logger().info(f"{math.degrees(euler_from_quaternion(twice)[2]):.1f} degrees in two steps")
long_one = [2.0 * part for part in before]
node.get_logger().info(f"{math.degrees(euler_from_quaternion(long_one)[2]):.1f} whatever its length")
rclpy.shutdown()

# logs: 20.0 degrees
# logs: 40.0 degrees in two steps
# logs: 170.0 whatever its length
