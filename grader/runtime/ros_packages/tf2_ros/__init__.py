"""Transforms between frames over topics, as `tf2_ros` of ROS 2 offers them to rclpy programs.

The behaviour is that of https://docs.ros.org/en/jazzy/p/tf2_ros_py/ as documented.
"""

# What the modules of ROS's own package import is in it as well, and its tutorials import it from there.
from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.task import Future
from rclpy.time import Time
from tf2_msgs.msg import TFMessage
from tf2_msgs.srv import FrameGraph
from tf2_py import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)

from .buffer import Buffer
from .buffer_interface import (
    BufferInterface,
    ConvertRegistration,
    NotImplementedException,
    TransformRegistration,
    TypeException,
    convert,
)
from .static_transform_broadcaster import StaticTransformBroadcaster
from .transform_broadcaster import TransformBroadcaster
from .transform_listener import TransformListener

__all__ = [
    "Buffer",
    "BufferInterface",
    "ConnectivityException",
    "ConvertRegistration",
    "Duration",
    "ExtrapolationException",
    "FrameGraph",
    "Future",
    "InvalidArgumentException",
    "LookupException",
    "Node",
    "NotImplementedException",
    "QoSProfile",
    "StaticTransformBroadcaster",
    "TFMessage",
    "Time",
    "TimeoutException",
    "TransformBroadcaster",
    "TransformException",
    "TransformListener",
    "TransformRegistration",
    "TransformStamped",
    "TypeException",
    "convert",
]
