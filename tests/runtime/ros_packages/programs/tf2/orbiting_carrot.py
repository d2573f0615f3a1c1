"""The tutorial's dynamic frame: a carrot goes round; the distance stays the same, and between two samples it is on the chord."""

import math

import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.time import Time
from tf2_ros import Buffer


class Carrot(Node):
    def __init__(self):
        super().__init__("dynamic_frame_tf2_broadcaster")
        self.buffer = Buffer()
        for step in range(11):
            t = TransformStamped()
            t.header.stamp.sec, t.header.stamp.nanosec = 100, step * 100_000_000 % 1_000_000_000
            t.header.stamp.sec += step // 10
            t.header.frame_id, t.child_frame_id = "turtle1", "carrot1"
            angle = math.pi * step / 10
            t.transform.translation.x, t.transform.translation.y = 2 * math.cos(angle), 2 * math.sin(angle)
            t.transform.rotation.z, t.transform.rotation.w = math.sin(angle / 2), math.cos(angle / 2)
            self.buffer.set_transform(t, "carrot")

    def at(self, seconds):
        t = self.buffer.lookup_transform("turtle1", "carrot1", Time(nanoseconds=round(seconds * 1e9))).transform
        distance = math.hypot(t.translation.x, t.translation.y)
        heading = 2 * math.atan2(t.rotation.z, t.rotation.w)
        self.get_logger().info(f"{distance:.3f} m away, heading {math.degrees(heading):.1f}")


rclpy.init()
node = Carrot()
node.at(100.2)
node.at(100.25)
node.at(101.0)
rclpy.shutdown()

# logs: 2.000 m away, heading 36.0
# logs: 1.975 m away, heading 45.0
# logs: 2.000 m away, heading 180.0
