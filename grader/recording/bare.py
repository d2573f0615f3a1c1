"""Runs a plan on the real clock with nothing of the grader in the students' processes.

Time begins when the first node is seen in the graph: until then a program imports, which takes as long as it takes.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial

from grader.model.quantities import NS_PER_S
from grader.model.trace import Observation, OutputLine
from grader.recording.console import Logged, read_console, thread_tracebacks
from grader.recording.ending import reported_fault
from grader.recording.observer import Observer
from grader.recording.plan import Plan
from grader.recording.student import Student
from grader.recording.wall import LOOK_S, WallConductor

#: How long, in real time, the first node is waited for.
FIRST_NODE_NS = 15 * NS_PER_S
#: A program whose first node comes later than this after its start does something else before: then time begins when
#: its imports should be done.
PROMPT_NS, IMPORTS_NS = NS_PER_S // 5, NS_PER_S // 2
#: How often the graph is looked at until the first node has been seen.
FIRST_LOOK_NS = 10_000_000


class BareConductor(WallConductor):
    """Runs one plan on the real clock, with programs that know nothing of it; see `WallConductor`."""

    def __init__(self, plan: Plan, students: list[Student], observer: Observer) -> None:
        super().__init__(plan, students, observer)
        self._logs: list[Logged] = []
        observer.hear_logs()

    def _begin(self) -> None:
        """Wait for the first node, and start the clock."""
        begin_ns = time.monotonic_ns()
        deadline_ns = begin_ns + (IMPORTS_NS if self._plan.first_node_ns > PROMPT_NS else FIRST_NODE_NS)
        next_ns = 0
        while not self._tape.graph.nodes and not self._finished() and (now_ns := time.monotonic_ns()) < deadline_ns:
            if now_ns >= next_ns:
                self._look_at_graph(0)
                next_ns = now_ns + FIRST_LOOK_NS
            for student in self._students:
                self._hear(student, 0)
            time.sleep(LOOK_S)
        self._started = time.monotonic_ns()

    def _look(self, now_ns: int) -> None:
        super()._look(now_ns)
        room = self._plan.limits.lines - len(self._logs)
        self._logs += self._observer.logs()[: max(0, room)]

    def _observations(self) -> tuple[Observation, ...]:
        self._logs += self._observer.logs()
        return tuple(self._read())

    def _read(self) -> Iterator[Observation]:
        """Yield what was observed, with log records and the faults of threads as lines tell of them."""
        seen = self._tape.observations
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
