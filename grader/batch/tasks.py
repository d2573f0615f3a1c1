"""What a scheduler does: grades submissions somewhere, each on its own, and hands back what came of it."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from grader.batch.keys import Conditions
from grader.batch.standing import Standing


@dataclass(frozen=True, slots=True)
class Task:
    """One submission to grade.

    Attributes:
        name: Name of the entry.
        label: What the source calls it.
        submission: Path of what was handed in.
        into: Folder that is not there yet: receives what `worker.PARTS` names.
        exercises: Exercise ids to grade; empty for all of the rubrics.
        rubrics: Rubric files; empty for the built-in ones.
        odom_bag: An /odom recording to play instead of the project's own.
        conditions: What the result depends on besides the submission.
        workers: Most scenarios recorded side by side.
        standalone: Whether the HTML report holds its scripts, instead of sharing them with the class.
        deadline_s: Real time after which the attempt is given up.
        collected: File of what was read of the submission on another machine; None to read it now.
        variant_key: File with the course key, for the line that repeats the run; nothing is read from it.
    """

    name: str
    label: str
    submission: Path
    into: Path
    exercises: tuple[str, ...]
    rubrics: tuple[Path, ...]
    odom_bag: Path | None
    conditions: Conditions
    workers: int
    standalone: bool
    deadline_s: float
    collected: Path | None = None
    variant_key: Path | None = None


@dataclass(frozen=True, slots=True)
class Attempt:
    """What came of a task; its files are in the folder that the task named."""

    task: Task
    standing: Standing


class Hear(Protocol):
    """Hears, from any thread, which step of which submission begins."""

    def __call__(self, name: str, step: str) -> None:
        """Take note of it."""
        ...


class Scheduler(Protocol):
    """Grades submissions, several at the same time, on this machine or on others."""

    def prepare(self, isolation: str) -> Sequence[str]:
        """Make sure that grading is possible at all, and return what an instructor must know before it begins.

        Args:
            isolation: The sandbox that was asked for.

        Raises:
            EnvironmentFault: It is not.
        """
        ...

    def run(self, tasks: Sequence[Task], hear: Hear) -> Generator[Attempt, None, None]:
        """Yield what comes of each task, once, as soon as it is there and in any order.

        Closing the iterator gives up what is under way and leaves no process behind. A failure of one task is its
        attempt's state, never an exception.
        """
        ...


#: Makes the scheduler for so many submissions at a time.
MakeScheduler = Callable[[int], Scheduler]
