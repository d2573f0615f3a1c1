"""A depth camera's cloud has rows and columns; single pixels are read by their index."""

import numpy as np
import rclpy
from sensor_msgs.msg import PointField
from sensor_msgs_py import point_cloud2
from std_msgs.msg import Header

rclpy.init()
log = rclpy.create_node("organised").get_logger().info
fields = [PointField(name="z", offset=0, datatype=PointField.FLOAT32, count=1)]
depth = np.arange(9, dtype=np.float32).reshape(3, 3)
points = np.zeros((3, 3), dtype=point_cloud2.dtype_from_fields(fields))
points["z"] = depth
cloud = point_cloud2.create_cloud(Header(), fields, points)
log(f"{cloud.height} rows of {cloud.row_step} bytes")
log(str(point_cloud2.read_points(cloud).shape))
log(str(point_cloud2.read_points(cloud, reshape_organized_cloud=True)["z"].tolist()))
log(str(point_cloud2.read_points(cloud, uvs=[0, 4, 8])["z"].tolist()))
log(str(point_cloud2.read_points_numpy(cloud, uvs=np.array([2]))[0, 0]))
rclpy.shutdown()

# logs: 3 rows of 12 bytes
# logs: (9,)
# logs: [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0], [6.0, 7.0, 8.0]]
# logs: [0.0, 4.0, 8.0]
# logs: 2.0
