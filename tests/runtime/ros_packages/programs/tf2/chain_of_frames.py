"""A robot's tree: odometry moves, the arm is fixed to it, and the camera to the arm."""

import math

import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
from tf2_ros import Buffer, StaticTransformBroadcaster, TransformBroadcaster, TransformListener


class Robot(Node):
    def __init__(self):
        super().__init__("robot")
        self.moving, self.fixed = TransformBroadcaster(self), StaticTransformBroadcaster(self)
        self.buffer = Buffer(cache_time=Duration(seconds=30))
        self.listener = TransformListener(self.buffer, self)
        self.fixed.sendTransform([self.frame("base_link", "arm", z=0.5), self.frame("arm", "camera", x=0.1)])
        self.fixed.sendTransform(self.frame("map", "odom", x=10.0))
        self.create_timer(0.05, self.drive)
        self.create_timer(0.1, self.look)

    def frame(self, parent, child, x=0.0, z=0.0, yaw=0.0):
        t = TransformStamped()
        t.header.stamp = self.get_clock().now().to_msg()
        t.header.frame_id, t.child_frame_id = parent, child
        t.transform.translation.x, t.transform.translation.z = x, z
        t.transform.rotation.z, t.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        return t

    def drive(self):
        self.moving.sendTransform(self.frame("odom", "base_link", x=2.0, yaw=math.pi / 2))

    def look(self):
        if not self.buffer.can_transform("map", "camera", Time()):
            return
        there = self.buffer.lookup_transform("map", "camera", Time()).transform.translation
        back = self.buffer.lookup_transform("camera", "map", Time()).transform.translation
        self.get_logger().info(f"camera in map: {there.x:.2f} {there.y:.2f} {there.z:.2f}")
        self.get_logger().info(f"map in camera: {back.x:.2f} {back.y:.2f} {back.z:.2f}")
        raise SystemExit


rclpy.init()
rclpy.spin(Robot())

# logs: camera in map: 12.00 0.10 0.50
# logs: map in camera: -0.10 12.00 -0.50
