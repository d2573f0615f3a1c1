"""Whether virtual time does justice to a run: not where it hides how late a node would be, or where nodes hang."""

from __future__ import annotations

from collections.abc import Sequence

from grader.core.trace import Fault, FaultKind, Observation
from grader.execution.student_process import NodeProcess

#: Why a program needs the wall clock: what it waits for, or how much it works.
THREADS = "the node's threads wait for each other without blocking"
OUTSIDE = "the node waits for something that is neither ROS nor time"
BUSY = "the node needs so much processor time that virtual time would hide it"
#: What a host says when its program does not settle, in words.
UNSETTLED = {"threads": THREADS, "outside": OUTSIDE}


def hopeless(students: Sequence[NodeProcess]) -> bool:
    """Return whether it is clear already that virtual time hides how late a node would be."""
    return any(student.workload is not None and student.workload.delay.hopeless for student in students)


def unfit(students: Sequence[NodeProcess], seen: Sequence[Observation], *, full: bool) -> str:
    """Say why virtual time does not do these nodes justice, if it does not.

    Args:
        students: The processes.
        seen: What was observed.
        full: Whether a limit has ended the recording.
    """
    if any(isinstance(o, Fault) and o.kind is FaultKind.HUNG for o in seen):
        return next((UNSETTLED[s.unsettled] for s in students if s.unsettled in UNSETTLED), "")
    if full:
        return ""
    hiding = [s.workload for s in students if s.workload is not None and s.workload.delay.hides]
    if not hiding:
        return ""
    return OUTSIDE if any(workload.waited_ns > workload.used_ns for workload in hiding) else BUSY
