"""What a test itself did in a run that it stepped: its calls, what it offered to programs, and where it failed."""

from __future__ import annotations

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import Endpoint, ServiceEnd
from grader.runtime.model.worlds import Sketch


@dataclass(frozen=True, slots=True)
class NotedCall:
    """A call of a test on its world."""

    name: str  # of the method
    file: str  # where the test called it: a path
    line: int  # from 1
    begin_ns: int  # since the test began
    end_ns: int
    failed: bool  # whether it raised an exception
    text: str = ""  # that line of the file; empty if nobody has looked


@dataclass(frozen=True, slots=True)
class SideOfTest:
    """What a test did in its run, besides the programs."""

    calls: tuple[NotedCall, ...] = ()  # the last ones, in order
    omitted: int = 0  # how many there were before these
    # What the test and its simulations publish, hear, serve and call, each with the time from which on
    ends: tuple[tuple[int, Endpoint | ServiceEnd], ...] = ()
    looked_at: tuple[str, ...] = ()  # topics
    failed_at: tuple[str, int] | None = None  # path and line at which the test failed
    faults_at: tuple[tuple[str, int], ...] = ()  # path and line at which programs failed
    sketches: tuple[Sketch, ...] = ()  # what simulations have drawn

    @property
    def end_ns(self) -> int:
        """When the last call ended."""
        return self.calls[-1].end_ns if self.calls else 0
