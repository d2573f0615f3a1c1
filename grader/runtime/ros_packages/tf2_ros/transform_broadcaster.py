"""Publishes transforms that change."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from tf2_msgs.msg import TFMessage

__all__ = ["TransformBroadcaster"]


class TransformBroadcaster:
    """Publishes on `/tf`.

    Args:
        node: The node that publishes.
        qos: Of the publisher; a queue of 100 messages if None.
    """

    def __init__(self, node: Node, qos: Any = None) -> None:
        self.pub_tf = node.create_publisher(TFMessage, "/tf", qos or QoSProfile(depth=100))

    def sendTransform(self, transform: TransformStamped | Sequence[TransformStamped]) -> None:
        """Publish one transform or several in one message."""
        several = [transform] if hasattr(transform, "header") else list(transform)
        self.pub_tf.publish(TFMessage(transforms=several))
