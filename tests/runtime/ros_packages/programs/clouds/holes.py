"""Returns that hit nothing are not numbers: they are counted, and left out."""

import math

import rclpy
from sensor_msgs_py import point_cloud2
from std_msgs.msg import Header

rclpy.init()
node = rclpy.create_node("holes")
nan = float("nan")
cloud = point_cloud2.create_cloud_xyz32(Header(), [(1.0, 2.0, 3.0), (nan, nan, nan), (4.0, 5.0, nan), (7.0, 8.0, 9.0)])
every = list(point_cloud2.read_points(cloud, field_names=("x", "y", "z"), skip_nans=False))
whole = list(point_cloud2.read_points(cloud, field_names=("x", "y", "z"), skip_nans=True))
flat = list(point_cloud2.read_points(cloud, field_names=("x", "y"), skip_nans=True))
node.get_logger().info(f"{len(every)} {len(whole)} {len(flat)}")
node.get_logger().info(" ".join(f"{math.dist((0, 0, 0), tuple(map(float, p))):.2f}" for p in whole))
node.get_logger().info(f"dense: {cloud.is_dense}")
rclpy.shutdown()

# logs: 4 2 3
# logs: 3.74 13.93
# logs: dense: False
