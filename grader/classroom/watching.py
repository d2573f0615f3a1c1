"""What a person watches while a class is graded: a live line on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

from grader.classroom.store import Standing, State
from grader.reporting.escape import shown

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

_NAMES = 4
_NAME = 30


class Watcher(Protocol):
    """Hears, from any thread, how a class gets on."""

    def begin(self, total: int, kept: int) -> None:
        """Take note that so many are to be graded, and so many are done already."""
        ...

    def step(self, name: str, step: str) -> None:
        """Take note of the step of a submission that begins."""
        ...

    def done(self, name: str, standing: Standing) -> None:
        """Take note of what came of a submission."""
        ...


class Pace:
    """Counts what is done and what is running, and foretells the end.

    Args:
        clock: Seconds, ever growing.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._started = clock()
        self.total = self.count = 0
        self.running: dict[str, str] = {}

    def begin(self, total: int) -> None:
        """Start to count."""
        self.total, self.count, self._started = total, 0, self._clock()

    def finish(self, name: str) -> None:
        """Count one more."""
        self.count += 1
        self.running.pop(name, None)

    @property
    def per_minute(self) -> float:
        """Submissions a minute so far."""
        elapsed = self._clock() - self._started
        return 60 * self.count / elapsed if elapsed > 0 else 0.0

    @property
    def left_s(self) -> float | None:
        """Seconds that are left at this rate; None before the first is done."""
        return 60 * (self.total - self.count) / self.per_minute if self.count and self.per_minute else None

    def words(self) -> str:
        """Say the rate, the time left and what is running."""
        names = [shown(name, limit=_NAME) for name in sorted(self.running)]
        more = f" and {len(names) - _NAMES} more" if len(names) > _NAMES else ""
        left = "?" if self.left_s is None else clock_time(self.left_s)
        running = f"; running: {', '.join(names[:_NAMES])}{more}" if names else ""
        return f"{self.per_minute:.1f}/min, {left} left{running}"


def clock_time(seconds: float) -> str:
    """Return a duration as `4:05` or `1:02:03`."""
    whole = round(seconds)
    hours, minutes = divmod(whole // 60, 60)
    return f"{hours}:{minutes:02}:{whole % 60:02}" if hours else f"{minutes}:{whole % 60:02}"


def outcome_words(standing: Standing) -> str:
    """Say what came of a submission."""
    if standing.state in (State.GRADED, State.UNDECIDED):
        points = f"{standing.score:g}/{standing.max_score:g}"
        return points if standing.state is State.GRADED else f"{points}, undecided"
    return f"{standing.state.value}: {shown(standing.problem, limit=160)}"


class PlainWatcher:
    """Writes one line for each submission that is done.

    Args:
        write: Takes a line.
        clock: See `Pace`.
    """

    def __init__(self, write: Callable[[str], None], clock: Callable[[], float] = time.monotonic) -> None:
        self._write = write
        self._pace = Pace(clock)
        self._lock = threading.Lock()

    def begin(self, total: int, kept: int) -> None:
        """See Watcher."""
        self._pace.begin(total)
        self._write(f"to grade: {total}" + (f", done before: {kept}" if kept else ""))

    def step(self, name: str, step: str) -> None:
        """See Watcher."""
        with self._lock:
            self._pace.running[name] = step

    def done(self, name: str, standing: Standing) -> None:
        """See Watcher."""
        with self._lock:
            pace = self._pace
            pace.finish(name)
            width = len(str(pace.total))
            count = f"[{pace.count:{width}}/{pace.total}]"
            took = f"{standing.duration_s:.1f} s"
            self._write(f"{count} {shown(name, limit=60)}: {outcome_words(standing)} in {took} ({pace.words()})")


class LiveWatcher:
    """Draws a bar with what is running under it."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._pace = Pace()
        self._bar: TaskID | None = None
        self._lock = threading.Lock()

    def begin(self, total: int, kept: int) -> None:
        """See Watcher."""
        self._pace.begin(total)
        self._bar = self._progress.add_task("", total=total, words="")
        if kept:
            self._progress.console.print(f"done before: {kept}", markup=False, highlight=False)

    def step(self, name: str, step: str) -> None:
        """See Watcher."""
        with self._lock:
            self._pace.running[name] = step
            self._draw()

    def done(self, name: str, standing: Standing) -> None:
        """See Watcher."""
        with self._lock:
            self._pace.finish(name)
            line = f"{shown(name, limit=60)}: {outcome_words(standing)} in {standing.duration_s:.1f} s"
            self._progress.console.print(line, markup=False, highlight=False)
            self._draw()

    def _draw(self) -> None:
        if self._bar is not None:
            self._progress.update(self._bar, completed=self._pace.count, words=self._pace.words())


class SilentWatcher:
    """Says nothing."""

    def begin(self, total: int, kept: int) -> None:
        """See Watcher."""

    def step(self, name: str, step: str) -> None:
        """See Watcher."""

    def done(self, name: str, standing: Standing) -> None:
        """See Watcher."""


@contextmanager
def shown_watcher(*, wanted: bool) -> Iterator[Watcher]:
    """Show on standard error how a class gets on."""
    if not wanted or sys.stderr is None:
        yield SilentWatcher()
        return
    if not sys.stderr.isatty():
        yield PlainWatcher(_line)
        return
    from rich.console import Console  # noqa: PLC0415  only for a terminal
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn  # noqa: PLC0415

    words = TextColumn("{task.fields[words]}", markup=False)
    with Progress(BarColumn(30), MofNCompleteColumn(), words, console=Console(stderr=True), transient=True) as bar:
        yield LiveWatcher(bar)


def _line(text: str) -> None:
    sys.stderr.write(
        text.encode(sys.stderr.encoding or "utf-8", "replace").decode(sys.stderr.encoding or "utf-8") + "\n"
    )
    sys.stderr.flush()
