"""Takes a cloud to another frame with the transform that tf2 finds."""

import math

import numpy as np
import rclpy
from geometry_msgs.msg import TransformStamped
from sensor_msgs_py import point_cloud2
from std_msgs.msg import Header
from tf2_ros import Buffer
from tf_transformations import quaternion_matrix

rclpy.init()
node = rclpy.create_node("moved")
buffer = Buffer()
t = TransformStamped()
t.header.frame_id, t.child_frame_id = "base_link", "lidar"
t.transform.translation.z = 1.0
t.transform.rotation.z, t.transform.rotation.w = math.sin(math.pi / 4), math.cos(math.pi / 4)
buffer.set_transform_static(t, "me")

cloud = point_cloud2.create_cloud_xyz32(Header(frame_id="lidar"), [[1, 0, 0], [0, 2, 0]])
found = buffer.lookup_transform("base_link", cloud.header.frame_id, rclpy.time.Time()).transform
q, shift = found.rotation, found.translation
matrix = quaternion_matrix([q.x, q.y, q.z, q.w])
matrix[:3, 3] = shift.x, shift.y, shift.z
points = point_cloud2.read_points_numpy(cloud)
moved = (matrix @ np.c_[points, np.ones(len(points))].T).T[:, :3]
again = point_cloud2.create_cloud_xyz32(Header(frame_id="base_link"), moved)
for p in point_cloud2.read_points_list(again):
    node.get_logger().info(" ".join(f"{value + 1e-9:.2f}" for value in p))
rclpy.shutdown()

# logs: 0.00 1.00 1.00
# logs: -2.00 0.00 1.00
