"""A lidar's fields with a gap between them: the brightest return, by two fields of five."""

import numpy as np
import rclpy
from sensor_msgs.msg import PointField
from sensor_msgs_py import point_cloud2
from std_msgs.msg import Header

rclpy.init()
node = rclpy.create_node("intensity")
fields = [PointField(name=n, offset=4 * i, datatype=PointField.FLOAT32, count=1) for i, n in enumerate("xyz")]
fields.append(PointField(name="intensity", offset=16, datatype=PointField.FLOAT32, count=1))
fields.append(PointField(name="ring", offset=20, datatype=PointField.UINT16, count=1))
layout = point_cloud2.dtype_from_fields(fields, point_step=32)
points = np.zeros(4, dtype=layout)
points["x"], points["intensity"], points["ring"] = [1, 2, 3, 4], [10, 90, 30, 5], [0, 1, 2, 3]
cloud = point_cloud2.create_cloud(Header(frame_id="velodyne"), fields, points, step=32)
found = point_cloud2.read_points(cloud, field_names=["x", "intensity", "ring"])
best = found[np.argmax(found["intensity"])]
node.get_logger().info(f"step {cloud.point_step}, {found.dtype.names}")
node.get_logger().info(f"brightest at {best['x']} in ring {best['ring']}")
try:
    point_cloud2.read_points(cloud, field_names=["colour"])
except AssertionError as error:
    node.get_logger().info(type(error).__name__)
rclpy.shutdown()

# logs: step 32, ('x', 'intensity', 'ring')
# logs: brightest at 2.0 in ring 1
# logs: AssertionError
