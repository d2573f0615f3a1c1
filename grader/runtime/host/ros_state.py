"""What the host knows of the ROS side of this process, in four objects with one job each."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

# Nothing of rclpy is imported here: a process may never import it.
if TYPE_CHECKING:
    from .endpoints import Endpoints
    from .events import Events
    from .inbox import Inbox
    from .outbox import Outbox
    from .seen_graph import SeenGraph


class RosState(NamedTuple):
    """The ROS side of a process."""

    endpoints: Endpoints  # which nodes, endpoints and actions exist here: the grader is told of them
    outbox: Outbox  # what was sent since the last report, and may not have arrived yet
    inbox: Inbox  # what is on its way to this process, or was taken ahead of time
    graph: SeenGraph  # whether this process sees the counterparts that the grader expects
    events: Events  # what the program is told of its counterparts
    note: Callable[[Callable[[], str]], None]  # notes what the program does, as `order.ReadyOrder.note`

    @property
    def sending_and_removed(self) -> bool:
        """Whether an endpoint or node was removed while a sent message may not have arrived yet."""
        return self.endpoints.removed and self.outbox.sending


def new_ros_state(note: Callable[[Callable[[], str]], None]) -> RosState:
    """Return the state of a process that has no node yet.

    Args:
        note: Notes what the program does.
    """
    from .endpoints import Endpoints
    from .events import Events
    from .inbox import Inbox
    from .outbox import Outbox
    from .seen_graph import SeenGraph

    events = Events()
    endpoints = Endpoints(events)
    return RosState(endpoints, Outbox(), Inbox(endpoints), SeenGraph(endpoints, events), events, note)


def see_whole_graph(ros: RosState, settle: Callable[[], None]) -> None:
    """Wait until this process sees the graph as the grader does, now and after each change from now on."""
    if not ros.graph.sees_graph:
        ros.graph.sees_graph = ros.endpoints.changed = True
    if ros.endpoints.changed:
        settle()
    ros.outbox.note_waited()
