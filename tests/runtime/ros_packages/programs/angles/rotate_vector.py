"""Turns a vector by a quaternion in three ways, which must agree."""

import math

import numpy as np
import rclpy
from tf_transformations import (
    quaternion_about_axis,
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_matrix,
    quaternion_multiply,
)

rclpy.init()
node = rclpy.create_node("vector")
q = quaternion_from_euler(0.0, math.pi / 2, 0.0)
v = np.array([1.0, 2.0, 3.0])
by_matrix = (quaternion_matrix(q) @ np.append(v, 1.0))[:3]
by_product = quaternion_multiply(quaternion_multiply(q, np.append(v, 0.0)), quaternion_conjugate(q))[:3]
by_axis = (quaternion_matrix(quaternion_about_axis(math.pi / 2, [0, 1, 0])) @ np.append(v, 1.0))[:3]
for found in (by_matrix, by_product, by_axis):
    node.get_logger().info(" ".join(f"{value:.3f}" for value in found))
rclpy.shutdown()

# logs: 3.000 2.000 -1.000
# logs: 3.000 2.000 -1.000
# logs: 3.000 2.000 -1.000
