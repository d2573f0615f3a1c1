"""Transforms stamped geometry messages; importing it lets `Buffer.transform` take them.

The behaviour is that of https://docs.ros.org/en/jazzy/p/tf2_geometry_msgs/ as documented, without PyKDL.
"""

from .tf2_geometry_msgs import *  # noqa: F403
from .tf2_geometry_msgs import __all__ as __all__
