"""Fills a buffer from the topics of transforms."""

from __future__ import annotations

import contextlib
from threading import Thread
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile
from tf2_msgs.msg import TFMessage

from .buffer import Buffer

__all__ = ["TransformListener"]

DEFAULT_TF_TOPIC, DEFAULT_STATIC_TF_TOPIC = "/tf", "/tf_static"
#: Transforms that wait to be taken.
DEPTH = 100


class TransformListener:
    """Subscribes to `/tf` and `/tf_static`.

    Args:
        buffer: What to fill.
        node: The node that subscribes.
        spin_thread: Whether a thread of its own spins the node, so that calls of the buffer can wait.
        qos: Of `/tf`.
        static_qos: Of `/tf_static`.
        tf_topic: Another name for `/tf`.
        static_tf_topic: Another name for `/tf_static`; `tf_static_topic` in newer releases.
        static_only: Whether to subscribe to `/tf_static` alone.
    """

    def __init__(
        self,
        buffer: Buffer,
        node: Node,
        *,
        spin_thread: bool = False,
        qos: Any = None,
        static_qos: Any = None,
        tf_topic: str = DEFAULT_TF_TOPIC,
        static_tf_topic: str = DEFAULT_STATIC_TF_TOPIC,
        tf_static_topic: str = "",
        static_only: bool = False,
    ) -> None:
        last = HistoryPolicy.KEEP_LAST
        qos = qos or QoSProfile(depth=DEPTH, history=last, durability=DurabilityPolicy.VOLATILE)
        static_qos = static_qos or QoSProfile(depth=DEPTH, history=last, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.buffer, self.node = buffer, node
        self.group = ReentrantCallbackGroup()
        if not static_only:
            self.tf_sub = node.create_subscription(TFMessage, tf_topic, self.callback, qos, callback_group=self.group)
        self.tf_static_sub = node.create_subscription(
            TFMessage, tf_static_topic or static_tf_topic, self.static_callback, static_qos, callback_group=self.group
        )
        if spin_thread:
            # Not a daemon, as in ROS: a program ends once rclpy is shut down, or the listener is deleted.
            self.executor = SingleThreadedExecutor()
            self.dedicated_listener_thread = Thread(target=self._spin)
            self.dedicated_listener_thread.start()

    def _spin(self) -> None:
        self.executor.add_node(self.node)
        with contextlib.suppress(ExternalShutdownException):
            self.executor.spin()
        self.executor.remove_node(self.node)

    def __del__(self) -> None:
        if hasattr(self, "dedicated_listener_thread"):
            self.executor.shutdown()
            self.dedicated_listener_thread.join()
        self.unregister()

    def unregister(self) -> None:
        """Stop listening."""
        for name in ("tf_sub", "tf_static_sub"):
            if hasattr(self, name):
                self.node.destroy_subscription(getattr(self, name))

    def callback(self, data: TFMessage) -> None:
        """Take transforms that may change."""
        for transform in data.transforms:
            self.buffer.set_transform(transform, "default_authority")

    def static_callback(self, data: TFMessage) -> None:
        """Take transforms that hold for all times."""
        for transform in data.transforms:
            self.buffer.set_transform_static(transform, "default_authority")
