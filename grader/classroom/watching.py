"""What a person watches while a class is graded: a live line on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from grader.classroom.store import ResultStatus, State
from grader.reporting.escape import shown

if TYPE_CHECKING:
    from rich.progress import Progress

_NAMES = 4
_NAME = 30


class Watcher:
    """Hears, from any thread, how a class gets on, and writes one line for each submission that is done.

    Args:
        write: Takes a line.
        clock: Seconds, ever growing.
    """

    def __init__(self, write: Callable[[str], None], clock: Callable[[], float] = time.monotonic) -> None:
        self._write = write
        self._clock = clock
        self._lock = threading.Lock()
        self._started_s = 0.0
        self._total = self._count = 0
        self._running: set[str] = set()

    def begin(self, total: int, kept: int) -> None:
        """Take note that so many are to be graded, and so many are done already."""
        self._total, self._started_s = total, self._clock()
        self._write(f"to grade: {total}" + (f", done before: {kept}" if kept else ""))

    def step(self, name: str, step: str) -> None:  # noqa: ARG002  steps are not shown
        """Take note of the step of a submission that begins."""
        with self._lock:
            self._running.add(name)
            self._draw()

    def done(self, name: str, standing: ResultStatus) -> None:
        """Take note of what came of a submission."""
        with self._lock:
            self._count += 1
            self._running.discard(name)
            self._tell(f"{shown(name, limit=60)}: {outcome_words(standing)} in {standing.duration_s:.1f} s")
            self._draw()

    def pace(self) -> str:
        """Say the rate, the time left and what is running."""
        names = [shown(name, limit=_NAME) for name in sorted(self._running)]
        more = f" and {len(names) - _NAMES} more" if len(names) > _NAMES else ""
        running = f"; running: {', '.join(names[:_NAMES])}{more}" if names else ""
        elapsed_s = self._clock() - self._started_s
        rate = self._count / elapsed_s if elapsed_s > 0 else 0.0
        left = clock_time((self._total - self._count) / rate) if rate else "?"
        return f"{60 * rate:.1f}/min, {left} left{running}"

    def _tell(self, line: str) -> None:
        """Write what came of a submission."""
        self._write(f"[{self._count:{len(str(self._total))}}/{self._total}] {line} ({self.pace()})")

    def _draw(self) -> None:
        """Show how far the class is; lines say it already."""


class LiveWatcher(Watcher):
    """Draws a bar with what is running beside it, and writes the lines above it."""

    def __init__(self, progress: Progress) -> None:
        super().__init__(lambda line: progress.console.print(line, markup=False, highlight=False))
        self._progress = progress

    def begin(self, total: int, kept: int) -> None:
        """See Watcher."""
        self._total, self._started_s = total, self._clock()
        self._progress.add_task("", total=total, words="")
        if kept:
            self._write(f"done before: {kept}")

    def _tell(self, line: str) -> None:
        self._write(line)

    def _draw(self) -> None:
        for task in self._progress.task_ids:
            self._progress.update(task, completed=self._count, words=self.pace())


def clock_time(seconds: float) -> str:
    """Return a duration as `4:05` or `1:02:03`."""
    whole = round(seconds)
    hours, minutes = divmod(whole // 60, 60)
    return f"{hours}:{minutes:02}:{whole % 60:02}" if hours else f"{minutes}:{whole % 60:02}"


def outcome_words(standing: ResultStatus) -> str:
    """Say what came of a submission."""
    if standing.state in (State.GRADED, State.UNDECIDED):
        points = f"{standing.score:g}/{standing.max_score:g}"
        return points if standing.state is State.GRADED else f"{points}, undecided"
    return f"{standing.state.value}: {shown(standing.problem, limit=160)}"


@contextmanager
def shown_watcher(*, wanted: bool) -> Iterator[Watcher]:
    """Show on standard error how a class gets on."""
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
