"""Publishes a cloud of three points, and finds its centre on the other side."""

import numpy as np
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2
from sensor_msgs_py import point_cloud2
from std_msgs.msg import Header


class Centre(Node):
    def __init__(self):
        super().__init__("centre")
        self.publisher = self.create_publisher(PointCloud2, "points", 10)
        self.create_subscription(PointCloud2, "points", self.listen, 10)
        self.create_timer(0.1, self.send)

    def send(self):
        header = Header(frame_id="lidar", stamp=self.get_clock().now().to_msg())
        self.publisher.publish(point_cloud2.create_cloud_xyz32(header, [[0, 0, 0], [3, 0, 0], [0, 3, 6]]))

    def listen(self, msg):
        points = point_cloud2.read_points_numpy(msg, field_names=("x", "y", "z"))
        x, y, z = points.mean(axis=0)
        self.get_logger().info(f"{len(points)} points of {msg.header.frame_id}, centre {x:.1f} {y:.1f} {z:.1f}")
        self.get_logger().info(f"{points.dtype}, {points.shape}, {np.asarray(points).max():.1f}")
        raise SystemExit


rclpy.init()
rclpy.spin(Centre())

# logs: 3 points of lidar, centre 1.0 1.0 2.0
# logs: float32, (3, 3), 6.0
