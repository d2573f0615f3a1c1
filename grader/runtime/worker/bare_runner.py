"""Runs a plan on the wall clock, without the grader's code in the students' processes."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import Observation, OutputLine
from grader.runtime.plan import Plan
from grader.runtime.worker.console import Logged, read_console, thread_tracebacks
from grader.runtime.worker.ending import reported_fault
from grader.runtime.worker.observer import Observer
from grader.runtime.worker.student_process import NodeProcess
from grader.runtime.worker.wall_runner import MESSAGES_A_LOOK, PAUSE_S, WallRunner

#: How long, in real time, to wait for the first node.
FIRST_NODE_NS = 15 * NS_PER_S
#: A program that creates its first node later than PROMPT_NS after its start does something else first. For such a
#: program time starts after IMPORTS_NS, when its imports should be done.
PROMPT_NS, IMPORTS_NS = NS_PER_S // 5, NS_PER_S // 2
#: How often to check the graph until the first node appears.
FIRST_LOOK_NS = 10_000_000


#: The pauses of the loop, longer than with the host: a whole class is checked, and no host waits for an answer. What a
#: program sends and logs counts from its arrival, which the middleware notes; what it prints is found up to 2 ms late,
#: a twentieth of the jitter allowed on this clock. Arrivals, output and the end of a process end the longest pause: the
#: graph alone is found by looking.
PAUSE_OF_BARE_S, LONGEST_PAUSE_OF_BARE_NS = 0.002, 50_000_000
#: How rarely to look at a graph that does not change: each look costs a millisecond of a processor, half of the loop.
RAREST_GRAPH_NS = 200_000_000


class BareRunner(WallRunner):
    """Runs one plan on the real clock, with bare processes; see `WallRunner`.

    The observer subscribes to the log and to the plan's publishers before the processes start.
    """

    pause_s = PAUSE_OF_BARE_S
    longest_pause_ns = LONGEST_PAUSE_OF_BARE_NS
    rarest_graph_ns = RAREST_GRAPH_NS

    def __init__(self, plan: Plan, students: list[NodeProcess], observer: Observer) -> None:
        super().__init__(plan, students, observer)
        #: Each with the time of its arrival.
        self._logs: list[tuple[int, Logged]] = []

    def _begin(self) -> None:
        """Wait for the first node or message, and start the clock."""
        begin_ns = self._real_time.monotonic_ns()
        deadline_ns = begin_ns + (IMPORTS_NS if self._plan.first_node_ns > PROMPT_NS else FIRST_NODE_NS)
        next_ns = 0
        while (
            not self._recorder.graph.nodes
            and not self._finished()
            and (now_ns := self._real_time.monotonic_ns()) < deadline_ns
        ):
            if now_ns >= next_ns:
                self._look_at_graph(0)
                next_ns = now_ns + FIRST_LOOK_NS
            for student in self._students:
                self._hear(student, 0)
            if taken := self._observer.take(MESSAGES_A_LOOK):
                for message in taken:
                    self._record(0, message)
                break
            self._real_time.sleep(PAUSE_S)
            self._observer.await_arrival(FIRST_LOOK_NS)
        self._started = self._real_time.monotonic_ns()
        for student in self._students:
            self._note_start(student)

    def _look(self, now_ns: int) -> None:
        super()._look(now_ns)
        remaining = self._plan.limits.lines - len(self._logs)
        self._logs += self._logged(now_ns)[: max(0, remaining)]

    def _logged(self, now_ns: int) -> list[tuple[int, Logged]]:
        return [(self._arrived(log.arrived_ns, now_ns), log) for log in self._observer.logs()]

    def _arrived(self, clock_ns: int, now_ns: int) -> int:
        """Return when something arrived that is found now: after the look before this one, whatever the clock did.

        A loop that is held up for some tenths of a second would otherwise take all that arrived meanwhile for one
        moment, in which the order of messages and log records is lost.
        """
        if not clock_ns:
            return now_ns
        return min(now_ns, max(self._looked_before_ns, now_ns - self._clock_ns(now_ns) + clock_ns))

    def _observations(self) -> tuple[Observation, ...]:
        self._logs += self._logged(self._stop_ns)
        return tuple(sorted(self._read(), key=lambda one: one.t_ns))

    def _read(self) -> Iterator[Observation]:
        """Yield the observations, with the log records and thread faults that are found in the output."""
        seen = self._recorder.observations
        read: dict[int, list[Observation]] = {}
        for student in self._students:
            lines = [o for o in seen if isinstance(o, OutputLine) and o.process == student.name]
            found = read_console(lines, self._logs, partial(_relative, student.root))
            read |= {id(line): [] if one is None else [one] for line, one in zip(lines, found, strict=True)}
            errors = [o for o in found if isinstance(o, OutputLine) and o.stream == "stderr"]
            for number, fault in thread_tracebacks([line.text for line in errors], student.root).items():
                line = errors[number]
                read[id(line)].append(reported_fault(student.name, line.t_ns, fault, self._plan.limits, student.places))
        for observation in seen:
            yield from read.get(id(observation), [observation])


def _relative(root: str, path: str) -> str:
    return path[len(root) + 1 :] if path.startswith(f"{root}/") else ""
