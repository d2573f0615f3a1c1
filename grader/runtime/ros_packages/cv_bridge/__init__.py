"""Converts between `sensor_msgs/msg/Image` and the arrays of OpenCV."""

from .core import CvBridge, CvBridgeError

__all__ = ["CvBridge", "CvBridgeError"]
