"""Coloured points: the colour is packed into the bits of one number, as RViz wants it."""

import struct

import rclpy
from sensor_msgs.msg import PointField
from sensor_msgs_py import point_cloud2 as pc2
from std_msgs.msg import Header

rclpy.init()
node = rclpy.create_node("colours")


def packed(r, g, b, a=255):
    return struct.unpack("I", struct.pack("BBBB", b, g, r, a))[0]


fields = [
    PointField(name="x", offset=0, datatype=PointField.FLOAT32, count=1),
    PointField(name="y", offset=4, datatype=PointField.FLOAT32, count=1),
    PointField(name="z", offset=8, datatype=PointField.FLOAT32, count=1),
    PointField(name="rgba", offset=12, datatype=PointField.UINT32, count=1),
]
points = [[0.1, 0.2, 0.3, packed(255, 0, 0)], [1.0, 1.0, 1.0, packed(0, 0, 255)]]
header = Header()
header.frame_id = "map"
cloud = pc2.create_cloud(header, fields, points)
node.get_logger().info(f"{cloud.width} points of {cloud.point_step} bytes, {len(cloud.data)} in all")
for x, y, z, rgba in pc2.read_points(cloud):
    b, g, r, a = struct.unpack("BBBB", struct.pack("I", int(rgba)))
    node.get_logger().info(f"{x:.1f} {y:.1f} {z:.1f}: {r} {g} {b}")
rclpy.shutdown()

# logs: 2 points of 16 bytes, 32 in all
# logs: 0.1 0.2 0.3: 255 0 0
# logs: 1.0 1.0 1.0: 0 0 255
