"""Thins a cloud out: one point for each cube of half a metre."""

import numpy as np
import rclpy
from sensor_msgs.msg import PointField
from sensor_msgs_py import point_cloud2
from std_msgs.msg import Header

rclpy.init()
node = rclpy.create_node("voxels")
rng = np.random.default_rng(7)
points = np.concatenate([rng.uniform(0, 0.4, (50, 3)), rng.uniform(1.0, 1.4, (30, 3))]).astype(np.float32)
cloud = point_cloud2.create_cloud_xyz32(Header(frame_id="map"), points)
back = point_cloud2.read_points_numpy(cloud)
node.get_logger().info(f"unchanged: {np.array_equal(back, points)}")
voxels, counts = np.unique((back // 0.5).astype(int), axis=0, return_counts=True)
thin = point_cloud2.create_cloud_xyz32(cloud.header, voxels * 0.5 + 0.25)
node.get_logger().info(f"{cloud.width} points became {thin.width}: {counts.tolist()}")
double = [PointField(name=n, offset=8 * i, datatype=PointField.FLOAT64, count=1) for i, n in enumerate("xyz")]
large = point_cloud2.create_cloud(cloud.header, double, points.astype(np.float64))
node.get_logger().info(f"{large.point_step} bytes, {point_cloud2.read_points_numpy(large).dtype}")
empty = point_cloud2.create_cloud_xyz32(cloud.header, [])
node.get_logger().info(f"{empty.width} {len(point_cloud2.read_points(empty))}")
rclpy.shutdown()

# logs: unchanged: True
# logs: 80 points became 2: [50, 30]
# logs: 24 bytes, float64
# logs: 0 0
