"""The words in which the contained process says what it has not read of a recording."""

from __future__ import annotations

from typing import Final

#: There are more messages on a topic than a scenario keeps, or more bytes in all, or the recording is longer than what
#: is read: nothing that follows is read.
TOO_MANY: Final = "many"
TOO_MUCH: Final = "much"
TOO_LONG: Final = "long"
#: There is no definition of the type of a topic, or messages on it are too large: only their times are read.
UNDEFINED: Final = "undefined"
LARGE: Final = "large"
#: ROS does not allow the name of a topic or type.
ODD_NAME: Final = "odd name"
#: What to do about a recording that is too much to read.
SMALLER = "record only the topics that are asked for, and stop the recorder when the robot is done"
