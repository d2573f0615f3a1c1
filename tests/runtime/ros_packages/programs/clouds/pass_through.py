"""A filter node: takes a cloud, keeps what is in front and near, and publishes the rest."""

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import PointCloud2
from sensor_msgs_py import point_cloud2
from std_msgs.msg import Header


class PassThrough(Node):
    def __init__(self):
        super().__init__("pass_through")
        self.declare_parameter("limit", 2.0)
        self.raw = self.create_publisher(PointCloud2, "raw", qos_profile_sensor_data)
        self.filtered = self.create_publisher(PointCloud2, "filtered", 10)
        self.create_subscription(PointCloud2, "raw", self.filter, qos_profile_sensor_data)
        self.create_subscription(PointCloud2, "filtered", self.show, 10)
        self.create_timer(0.1, self.send)

    def send(self):
        x, y = np.meshgrid(np.linspace(-3, 3, 7), np.linspace(-1, 1, 3))
        points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
        self.raw.publish(point_cloud2.create_cloud_xyz32(Header(frame_id="laser"), points))

    def filter(self, cloud):
        points = point_cloud2.read_points_numpy(cloud, skip_nans=True)
        limit = self.get_parameter("limit").value
        kept = points[(points[:, 0] > 0) & (points[:, 0] <= limit)]
        self.filtered.publish(point_cloud2.create_cloud(cloud.header, cloud.fields, kept))

    def show(self, cloud):
        points = point_cloud2.read_points(cloud)
        self.get_logger().info(f"{cloud.width} of 21 in {cloud.header.frame_id}, x {sorted(set(points['x'].tolist()))}")
        raise SystemExit


rclpy.init()
rclpy.spin(PassThrough())

# logs: 6 of 21 in laser, x [1.0, 2.0]
