"""Shows the progress of a class: a live bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from grader.course.classroom.store import ResultStatus, State
from grader.grading.reporting.escape import shown

if TYPE_CHECKING:
    from rich.progress import Progress

_NAMES = 4
_NAME = 30


class Watcher:
    """Tracks the progress of a class from any thread, and writes a line for each finished submission."""

    def __init__(self, write: Callable[[str], None], clock: Callable[[], float] = time.monotonic) -> None:
        self._write = write
        self._clock = clock
        self._lock = threading.Lock()
        self._started_s = 0.0
        self._total = self._count = 0
        self._running: set[str] = set()

    def begin(self, total: int, kept: int, recorded: int = 0) -> None:
        """Start, with the numbers of submissions to grade, of those with results, and of those that need no run."""
        self._total, self._started_s = total, self._clock()
        again = f" ({recorded} of them from kept recordings)" if recorded else ""
        self._write(f"to grade: {total}{again}" + (f", done before: {kept}" if kept else ""))

    def step(self, name: str, step: str) -> None:  # noqa: ARG002  steps are not shown
        """Record that a step of a submission begins."""
        with self._lock:
            self._running.add(name)
            self._draw()

    def done(self, name: str, status: ResultStatus) -> None:
        """Record the status of a finished submission."""
        with self._lock:
            self._count += 1
            self._running.discard(name)
            self._write_done(f"{shown(name, limit=60)}: {outcome_words(status)} in {status.duration_s:.1f} s")
            self._draw()

    def pace(self) -> str:
        """Format the rate, the time left and the running submissions."""
        names = [shown(name, limit=_NAME) for name in sorted(self._running)]
        more = f" and {len(names) - _NAMES} more" if len(names) > _NAMES else ""
        running = f"; running: {', '.join(names[:_NAMES])}{more}" if names else ""
        elapsed_s = self._clock() - self._started_s
        rate = self._count / elapsed_s if elapsed_s > 0 else 0.0
        left = clock_time((self._total - self._count) / rate) if rate else "?"
        return f"{60 * rate:.1f}/min, {left} left{running}"

    def _write_done(self, line: str) -> None:
        """Write a line about a finished submission."""
        self._write(f"[{self._count:{len(str(self._total))}}/{self._total}] {line} ({self.pace()})")

    def _draw(self) -> None:
        """Redraw the progress; nothing to do here, because the lines contain it."""


class LiveWatcher(Watcher):
    """Draws a progress bar with the running submissions, and writes lines above it."""

    def __init__(self, progress: Progress) -> None:
        super().__init__(lambda line: progress.console.print(line, markup=False, highlight=False))
        self._progress = progress

    def begin(self, total: int, kept: int, recorded: int = 0) -> None:
        """See Watcher."""
        self._total, self._started_s = total, self._clock()
        self._progress.add_task("", total=total, words="")
        if recorded:
            self._write(f"from kept recordings: {recorded}")
        if kept:
            self._write(f"done before: {kept}")

    def _write_done(self, line: str) -> None:
        self._write(line)

    def _draw(self) -> None:
        for task in self._progress.task_ids:
            self._progress.update(task, completed=self._count, words=self.pace())


def clock_time(seconds: float) -> str:
    """Format a duration as `4:05` or `1:02:03`."""
    whole = round(seconds)
    hours, minutes = divmod(whole // 60, 60)
    return f"{hours}:{minutes:02}:{whole % 60:02}" if hours else f"{minutes}:{whole % 60:02}"


def outcome_words(status: ResultStatus) -> str:
    """Describe the outcome of a submission."""
    if status.state in (State.GRADED, State.UNDECIDED):
        points = f"{status.score:g}/{status.max_score:g}"
        return points if status.state is State.GRADED else f"{points}, undecided"
    return f"{status.state.value}: {shown(status.problem, limit=160)}"


@contextmanager
def shown_watcher(*, wanted: bool) -> Iterator[Watcher]:
    """Show the progress of a class on standard error."""
    if not wanted or sys.stderr is None:
        yield Watcher(lambda _: None)
        return
    if not sys.stderr.isatty():
        yield Watcher(_line)
        return
    from rich.console import Console  # noqa: PLC0415  only for a terminal
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn  # noqa: PLC0415

    words = TextColumn("{task.fields[words]}", markup=False)
    with Progress(BarColumn(30), MofNCompleteColumn(), words, console=Console(stderr=True), transient=True) as bar:
        yield LiveWatcher(bar)


def _line(text: str) -> None:
    encoding = sys.stderr.encoding or "utf-8"
    sys.stderr.write(text.encode(encoding, "replace").decode(encoding) + "\n")
    sys.stderr.flush()
