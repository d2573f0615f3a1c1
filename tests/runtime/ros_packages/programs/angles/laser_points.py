"""Takes the ends of laser beams to the frame of the robot, on which the laser is mounted upside down."""

import math

import numpy as np
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import LaserScan
from tf_transformations import compose_matrix


class Points(Node):
    def __init__(self):
        super().__init__("points")
        self.mount = compose_matrix(translate=(0.2, 0.0, 0.1), angles=(math.pi, 0.0, 0.0))
        self.publisher = self.create_publisher(LaserScan, "scan", 10)
        self.create_subscription(LaserScan, "scan", self.listen, 10)
        self.create_timer(0.1, self.send)

    def send(self):
        scan = LaserScan(angle_min=-math.pi / 2, angle_max=math.pi / 2, angle_increment=math.pi / 2)
        scan.ranges = [1.0, 2.0, 3.0]
        self.publisher.publish(scan)

    def listen(self, scan):
        angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        ranges = np.array(scan.ranges)
        beams = np.vstack([ranges * np.cos(angles), ranges * np.sin(angles), 0 * ranges, np.ones_like(ranges)])
        for x, y, z, _ in (self.mount @ beams).T.round(3) + 0.0:
            self.get_logger().info(f"{x:.2f} {y:.2f} {z:.2f}")
        raise SystemExit


rclpy.init()
rclpy.spin(Points())

# logs: 0.20 1.00 0.10
# logs: 2.20 0.00 0.10
# logs: 0.20 -3.00 0.10
