"""Kinds of values that rubrics write by rules of their own: names, types, formulas, times, told apart by annotation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True, slots=True)
class Kind:
    """Marks an annotated value as one that rubrics write by rules of its own."""

    name: str


#: An absolute topic, service or node name.
Topic = Annotated[str, Kind("topic")]
#: A message type such as `std_msgs/msg/Float32`.
MessageType = Annotated[str, Kind("message type")]
#: A service type such as `std_srvs/srv/Trigger`.
ServiceType = Annotated[str, Kind("service type")]
#: An action type such as `example_interfaces/action/Fibonacci`.
ActionType = Annotated[str, Kind("action type")]
#: A formula of `n` and `t` such as `sin(0.1 * n)`.
Formula = Annotated[str, Kind("formula")]
#: A regular expression.
Pattern = Annotated[str, Kind("pattern")]
