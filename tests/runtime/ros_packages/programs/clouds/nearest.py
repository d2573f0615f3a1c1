"""The nearest obstacle, by named tuples and by a loop as beginners write it."""

import math

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2
from sensor_msgs_py import point_cloud2 as pc2
from std_msgs.msg import Float32, Header


class Nearest(Node):
    def __init__(self):
        super().__init__("nearest")
        self.cloud = self.create_publisher(PointCloud2, "/camera/points", 1)
        self.distance = self.create_publisher(Float32, "distance", 1)
        self.create_subscription(PointCloud2, "/camera/points", self.callback, 1)
        self.timer = self.create_timer(0.2, self.send)

    def send(self):
        self.cloud.publish(pc2.create_cloud_xyz32(Header(), [(3.0, 4.0, 0.0), (1.0, 2.0, 2.0), (9.0, 9.0, 9.0)]))

    def callback(self, data):
        best = math.inf
        for p in pc2.read_points(data, field_names=("x", "y", "z"), skip_nans=True):
            best = min(best, math.sqrt(p[0] ** 2 + p[1] ** 2 + p[2] ** 2))
        nearest = min(pc2.read_points_list(data, ("x", "y", "z")), key=lambda p: math.hypot(p.x, p.y, p.z))
        self.distance.publish(Float32(data=best))
        self.get_logger().info(f"{best:.2f} m: {nearest._fields} {nearest.x} {nearest.y} {nearest.z}")
        raise SystemExit


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(Nearest())


if __name__ == "__main__":
    main()

# logs: 3.00 m: ('x', 'y', 'z') 1.0 2.0 2.0
