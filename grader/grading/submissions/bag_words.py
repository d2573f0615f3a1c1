"""The words and the limit that the grader shares with the contained process that reads a recording."""

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
#: The longest name of a topic or a type.
LONGEST_NAME: Final = 255
#: What to do about a recording that is too much to read.
SMALLER = "record only the topics that are asked for, and stop the recorder when the robot is done"
