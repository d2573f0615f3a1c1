"""Publishes transforms that hold for all times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile
from tf2_msgs.msg import TFMessage

__all__ = ["StaticTransformBroadcaster"]


class StaticTransformBroadcaster:
    """Publishes on `/tf_static`, also for nodes that subscribe later.

    Args:
        node: The node that publishes.
        qos: Of the publisher; latched if None.
    """

    def __init__(self, node: Node, qos: Any = None) -> None:
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, history=HistoryPolicy.KEEP_LAST)
        self.pub_tf = node.create_publisher(TFMessage, "/tf_static", qos or latched)
        self.net_message = TFMessage()

    def sendTransform(self, transform: TransformStamped | Sequence[TransformStamped]) -> None:
        """Publish one transform or several, together with all earlier ones of other child frames."""
        several = [transform] if hasattr(transform, "header") else list(transform)
        sent = {one.child_frame_id: one for one in (*self.net_message.transforms, *several)}
        self.net_message = TFMessage(transforms=list(sent.values()))
        self.pub_tf.publish(self.net_message)
