"""Puts poses together as matrices: the sensor in the robot in the map, and back."""

import math

import rclpy
import tf_transformations as tft

rclpy.init()
node = rclpy.create_node("poses")


def matrix(x, y, yaw):
    return tft.concatenate_matrices(
        tft.translation_matrix((x, y, 0.0)), tft.quaternion_matrix(tft.quaternion_from_euler(0, 0, yaw))
    )


robot, sensor = matrix(4.0, 1.0, math.pi / 2), matrix(0.5, 0.0, math.pi / 4)
in_map = robot @ sensor
x, y, z = tft.translation_from_matrix(in_map)
roll, pitch, yaw = tft.euler_from_matrix(in_map)
node.get_logger().info(f"sensor at {x:.2f} {y:.2f}, looking to {math.degrees(yaw):.0f}")
back = tft.concatenate_matrices(tft.inverse_matrix(robot), in_map)
node.get_logger().info(f"the same as before: {tft.is_same_transform(back, sensor)}")
q = tft.quaternion_from_matrix(in_map)
node.get_logger().info(f"quaternion {q[2]:.3f} {q[3]:.3f}")
rclpy.shutdown()

# logs: sensor at 4.00 1.50, looking to 135
# logs: the same as before: True
# logs: quaternion 0.924 0.383
