"""Chooses what grades a class: this machine, or a scheduler that a package registers as an entry point."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from pathlib import Path
from typing import Protocol

from grader.course.classroom import local
from grader.course.classroom.local import Attempt, ClassScheduler, MakeScheduler, OnStep, Task, failed_attempt
from grader.course.classroom.sending import doubt, has_report
from grader.course.classroom.store import REPORT, ResultStatus
from grader.grading.model import entry_points
from grader.grading.model.entry_points import SCHEDULERS
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError, EnvironmentFault, GraderError, HarnessError

#: The scheduler that a bare address or a scheduler file is for.
DASK = "dask"
_REPORT = "report this to the authors of the package"
_KEPT = f"what was graded is kept; {_REPORT}"


class Connect(Protocol):
    """What an entry point of `rclpy_grader.schedulers` names: opens a scheduler for one class."""

    def __call__(
        self, place: str, jobs: int | None, warn: Callable[[str], None]
    ) -> AbstractContextManager[ClassScheduler]:
        """Return a context in which the scheduler can be used; raises EnvironmentFault if it cannot.

        Args:
            place: What follows the name in `--scheduler NAME=PLACE`; empty if nothing does.
            jobs: Most submissions to grade in parallel; None for as many as the place has room for.
            warn: To be called with a line for the instructor.
        """


@dataclass(frozen=True, slots=True)
class ThisMachine:
    """What grades a class without `--scheduler`."""

    make: MakeScheduler = local.LocalScheduler


def opened_scheduler(
    scheduler: str | None, jobs: int | None, warn: Callable[[str], None], here: ThisMachine
) -> AbstractContextManager[MakeScheduler]:
    """Return the context of what grades a class, from the value of `--scheduler`; None is this machine.

    Raises ClassError for an unknown name, EnvironmentFault if the package that registers it cannot be used.
    """
    if scheduler is None:
        return nullcontext(here.make)
    name, place = scheduler_name(scheduler)
    found = entry_points.load_registered(SCHEDULERS, name, object, "a function")
    if found is None and name == DASK:
        lost = f"rclpy-grader: expected its entry point {DASK!r} of {SCHEDULERS}, found none"
        raise EnvironmentFault(lost, "install it again: its metadata are older than its code")
    if found is None:
        known = ", ".join(entry_points.registered_names(SCHEDULERS))
        raise ClassError(f"--scheduler {scheduler}: expected a scheduler, found {name!r}", f"there are {known}")
    connect, where = found
    if not callable(connect):
        raise EnvironmentFault(f"{where}: expected a function, found {type(connect).__name__}", _REPORT)
    return _connected(connect, where, place, jobs, warn)


def scheduler_name(text: str) -> tuple[str, str]:
    """Return name and place of `NAME=PLACE` or `NAME`; an address and a file are those of Dask."""
    name, equals, place = text.partition("=")
    is_name = entry_points.NAME.fullmatch(name) is not None and not Path(text).exists()
    if is_name and (equals or name in entry_points.registered_names(SCHEDULERS)):
        return name, place
    return DASK, text


@contextmanager
def _connected(
    connect: Connect, where: str, place: str, jobs: int | None, warn: Callable[[str], None]
) -> Iterator[MakeScheduler]:
    """Connect a scheduler that is watched; an error while it is disconnected is a warning, because all is graded."""
    with entry_points.faults(f"{where} cannot be used", _REPORT):
        context = connect(place, jobs, warn)
        scheduler = context.__enter__()
    try:
        yield lambda _: GuardedScheduler(scheduler, where)
    finally:
        try:
            with entry_points.faults(f"{where} cannot be left", _REPORT):
                context.__exit__(None, None, None)
        except GraderError as fault:
            warn(fault.message)


class GuardedScheduler:
    """A scheduler of some package: whatever it does wrong is a failure of the machine, and never a mark."""

    def __init__(self, scheduler: ClassScheduler, where: str) -> None:
        self._scheduler = scheduler
        self._where = where

    def prepare(self, isolation: str) -> Sequence[str]:
        """Return its warnings; see `ClassScheduler`."""
        with entry_points.faults(f"{self._where} cannot be used", _REPORT):
            return [str(line) for line in self._scheduler.prepare(isolation)]

    def run(self, tasks: Sequence[Task], on_step: OnStep) -> Generator[Attempt, None, None]:
        """Yield exactly one attempt for each task; raises HarnessError if the scheduler fails as a whole."""
        left = {task.name: task for task in tasks}
        with closing(self._attempts(tasks, on_step)) as attempts:
            for attempt in attempts:
                task = left.pop(attempt.task.name, None) if isinstance(attempt, Attempt) else None
                if task is None:
                    raise HarnessError(f"{self._where}: expected an attempt of an open task, found another", _KEPT)
                wrong = _wrong(task, attempt.status)
                yield failed_attempt(task, f"{self._where}: {wrong}") if wrong else Attempt(task, attempt.status)
        for task in left.values():
            yield failed_attempt(task, f"{self._where}: it gave no result")

    def _attempts(self, tasks: Sequence[Task], on_step: OnStep) -> Generator[Attempt, None, None]:
        """Run it; whatever it raises but a GraderError becomes a HarnessError."""
        try:
            with entry_points.faults(f"{self._where} failed", _KEPT):
                yield from self._scheduler.run(tasks, on_step)
        except EnvironmentFault as fault:
            raise HarnessError(fault.message, fault.hint) from fault


def _wrong(task: Task, status: ResultStatus) -> str:
    """Return why a result cannot be used; empty if it can."""
    wrong = doubt(task, status)
    if not wrong and has_report(status) and not (task.into / REPORT).is_file():
        return f"expected {REPORT} in the task's folder, found none"
    return wrong
