"""Partial reports while a run goes on, for platforms that may end it at any time and then take what is there."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

from grader.judging.whole import judge_run
from grader.model.exercise import Exercise
from grader.model.report import Report
from grader.model.run import Run
from grader.model.trace import Trace

#: Exercise id and scenario id.
Key = tuple[str, str]


class EarlyReports:
    """Makes a partial report each time an exercise has been recorded and others have not.

    Args:
        exercises: What is graded, in the order of the report.
        scenarios: What is recorded; an exercise of which nothing is recorded is judged as soon as any other is.
        run: All that is known before recording.
        hear: Hears each partial report.
    """

    def __init__(
        self,
        exercises: Sequence[Exercise],
        scenarios: Collection[Key],
        run: Run,
        hear: Callable[[Report], None],
    ) -> None:
        self._exercises = exercises
        self._awaited = set(scenarios)
        self._run = run
        self._hear = hear
        self._traces: dict[Key, Trace] = {}
        self._started = time.perf_counter()

    def take(self, key: Key, trace: Trace) -> None:
        """Take a recording; if it was the last of its exercise, but not of all, make a partial report."""
        self._traces[key] = trace
        self._awaited.discard(key)
        pending = {exercise for exercise, _ in self._awaited}
        if pending and key[0] not in pending:
            duration_s = self._run.duration_s + time.perf_counter() - self._started
            run = replace(self._run, traces=dict(self._traces), duration_s=duration_s)
            self._hear(judge_run(self._exercises, run, pictures=False, pending=pending))
