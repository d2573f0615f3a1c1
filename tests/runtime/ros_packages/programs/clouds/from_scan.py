"""Makes a cloud of a laser scan, without the beams that hit nothing."""

import math

import numpy as np
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import LaserScan, PointCloud2
from sensor_msgs_py.point_cloud2 import create_cloud_xyz32, read_points_list


class ScanToCloud(Node):
    def __init__(self):
        super().__init__("scan_to_cloud")
        self.scan = self.create_publisher(LaserScan, "scan", 10)
        self.cloud = self.create_publisher(PointCloud2, "cloud", 10)
        self.create_subscription(LaserScan, "scan", self.convert, 10)
        self.create_subscription(PointCloud2, "cloud", self.show, 10)
        self.create_timer(0.1, self.send)

    def send(self):
        msg = LaserScan(angle_min=0.0, angle_increment=math.pi / 2, range_min=0.1, range_max=10.0)
        msg.header.frame_id = "laser"
        msg.ranges = [1.0, 2.0, math.inf, 0.05]
        self.scan.publish(msg)

    def convert(self, msg):
        ranges = np.array(msg.ranges)
        angles = msg.angle_min + np.arange(len(ranges)) * msg.angle_increment
        good = np.isfinite(ranges) & (ranges >= msg.range_min) & (ranges <= msg.range_max)
        points = np.c_[ranges * np.cos(angles), ranges * np.sin(angles), np.zeros(len(ranges))][good]
        self.cloud.publish(create_cloud_xyz32(msg.header, points.tolist()))

    def show(self, msg):
        for p in read_points_list(msg):
            self.get_logger().info(f"{p.x + 1e-6:.2f} {p.y + 1e-6:.2f} {p.z:.2f}")
        raise SystemExit


rclpy.init()
rclpy.spin(ScanToCloud())

# logs: 1.00 0.00 0.00
# logs: 0.00 2.00 0.00
