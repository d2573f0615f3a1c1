"""The example that waits for a transform without blocking the only thread."""

import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.time import Time
from tf2_ros.buffer import Buffer
from tf2_ros.transform_broadcaster import TransformBroadcaster
from tf2_ros.transform_listener import TransformListener


class WaitsForTransform(Node):
    def __init__(self):
        super().__init__("example_waits_for_transform")
        self._tf_buffer = Buffer()
        self._tf_listener = TransformListener(self._tf_buffer, self)
        self._broadcaster = TransformBroadcaster(self)
        self._once = self.create_timer(0.1, self.ask)
        self._sender = self.create_timer(0.4, self.send)
        self.future = None

    def send(self):
        t = TransformStamped()
        t.header.stamp = self.get_clock().now().to_msg()
        t.header.frame_id, t.child_frame_id = "sonar_1", "sonar_2"
        t.transform.translation.x = 4.0
        t.transform.rotation.w = 1.0
        self._broadcaster.sendTransform(t)

    def ask(self):
        self._once.cancel()
        self.future = self._tf_buffer.wait_for_transform_async("sonar_1", "sonar_2", Time())
        self.get_logger().info(f"done at once: {self.future.done()}")
        self.future.add_done_callback(self.on_tf_ready)

    def on_tf_ready(self, future):
        self.get_logger().info(f"got {future.result().transform.translation.x}")
        found = self._tf_buffer.lookup_transform("sonar_2", "sonar_1", Time())
        self.get_logger().info(f"back {found.transform.translation.x}")
        raise SystemExit


rclpy.init()
rclpy.spin(WaitsForTransform())

# logs: done at once: False
# logs: got 4.0
# logs: back -4.0
