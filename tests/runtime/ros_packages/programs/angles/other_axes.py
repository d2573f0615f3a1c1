"""Angles in another order: rotating axes, z first, as aeroplanes have them, and angles that are not unique."""

import math

import rclpy
from tf_transformations import euler_from_matrix, euler_from_quaternion, euler_matrix, quaternion_from_euler

rclpy.init()
log = rclpy.create_node("axes").get_logger().info
fixed = quaternion_from_euler(0.1, 0.2, 0.3)
turning = quaternion_from_euler(0.3, 0.2, 0.1, axes="rzyx")
log(f"the same rotation: {abs(sum(a * b for a, b in zip(fixed, turning))) > 0.999999}")
log(" ".join(f"{angle:.2f}" for angle in euler_from_quaternion(fixed, "rzyx")))
log(" ".join(f"{angle:.2f}" for angle in euler_from_matrix(euler_matrix(0.4, 0.5, 0.6, "syxz"), "syxz")))
roll, pitch, yaw = euler_from_quaternion(quaternion_from_euler(0.0, math.pi / 2, 0.0))
log(f"straight up: {math.degrees(pitch):.1f}")
rclpy.shutdown()

# logs: the same rotation: True
# logs: 0.30 0.20 0.10
# logs: 0.40 0.50 0.60
# logs: straight up: 90.0
