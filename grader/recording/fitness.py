"""Whether virtual time does justice to a run: not where it hides how much work a node does, or where nodes hang."""

from __future__ import annotations

from collections.abc import Sequence

from grader.model.quantities import NS_PER_S
from grader.model.trace import Fault, FaultKind, Observation
from grader.recording.student import Student

#: A node that needs more processor seconds than this a virtual second is judged on the real clock.
BUSY_SHARE = 0.5
#: Beyond that share of the whole observation, and this much more, there is no need to go on in virtual time.
HOPELESS_NS = 2 * NS_PER_S
#: What a host says when its program does not settle, in words.
UNSETTLED = {
    "threads": "the node's threads wait for each other without blocking",
    "outside": "the node waits for something that is neither ROS nor time",
}
#: Processor time that a process may have used beyond what it says, as a share of virtual time and besides: looking at
#: the clock again and again is not charged, but costs something.
HIDDEN_SHARE, HIDDEN_NS = 1.0, 5 * NS_PER_S


def hopeless(students: Sequence[Student], end_ns: int) -> bool:
    """Return whether it is clear already that virtual time hides how much processor time a node needs."""
    busiest_ns = max(s.used_ns for s in students)
    return busiest_ns > BUSY_SHARE * end_ns + HOPELESS_NS or hides_work(students, end_ns)


def hides_work(students: Sequence[Student], virtual_ns: int) -> bool:
    """Return whether a process has used much more processor time than it says."""
    hidden_ns = max((s.measured_ns - s.ready_ns - s.used_ns for s in students), default=0)
    return hidden_ns > HIDDEN_SHARE * virtual_ns + HIDDEN_NS


def unfit(students: Sequence[Student], seen: Sequence[Observation], now_ns: int, *, full: bool) -> str:
    """Say why virtual time does not do these nodes justice, if it does not.

    Args:
        students: The processes.
        seen: What was observed.
        now_ns: How far time has come.
        full: Whether a limit has ended the recording.
    """
    if any(isinstance(o, Fault) and o.kind is FaultKind.HUNG for o in seen):
        return next((UNSETTLED[s.unsettled] for s in students if s.unsettled in UNSETTLED), "")
    if full:
        return ""
    virtual_ns = max(now_ns, NS_PER_S)
    busiest_ns = max((s.used_ns for s in students), default=0)
    if busiest_ns > BUSY_SHARE * virtual_ns or hides_work(students, virtual_ns):
        return "the node needs so much processor time that virtual time would hide it"
    return ""
