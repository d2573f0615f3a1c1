"""A timer waits for a transform that comes late, while other threads of the executor take it."""

import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.duration import Duration
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.time import Time
from tf2_ros import Buffer, TransformBroadcaster, TransformListener


class Waits(Node):
    def __init__(self):
        super().__init__("waits")
        self.buffer = Buffer()
        self.listener = TransformListener(self.buffer, self)
        self.broadcaster = TransformBroadcaster(self)
        self.once = self.create_timer(0.1, self.wait, callback_group=MutuallyExclusiveCallbackGroup())
        self.later = self.create_timer(1.0, self.send, callback_group=MutuallyExclusiveCallbackGroup())

    def send(self):
        t = TransformStamped()
        t.header.stamp = self.get_clock().now().to_msg()
        t.header.frame_id, t.child_frame_id = "map", "robot"
        t.transform.translation.x = 7.0
        t.transform.rotation.w = 1.0
        self.broadcaster.sendTransform(t)

    def wait(self):
        self.once.cancel()
        start = self.get_clock().now()
        in_time = self.buffer.can_transform("map", "robot", Time(), timeout=Duration(seconds=0.2))
        self.get_logger().info(f"after 0.2 s: {in_time}")
        found = self.buffer.lookup_transform("map", "robot", Time(), timeout=Duration(seconds=20.0))
        waited = (self.get_clock().now() - start).nanoseconds / 1e9
        self.get_logger().info(f"found {found.transform.translation.x}, waited {waited > 0.8}")
        rclpy.shutdown()


rclpy.init()
node = Waits()
executor = MultiThreadedExecutor()
executor.add_node(node)
executor.spin()

# logs: after 0.2 s: False
# logs: found 7.0, waited True
