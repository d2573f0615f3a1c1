"""A run that is stepped from outside: sends commands to its worker, and answers its questions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple, Protocol

from grader.runtime.model.errors import HarnessError
from grader.runtime.model.trace import Observation
from grader.runtime.plan import Plan
from grader.runtime.recording.codec import to_json
from grader.runtime.steps import Command, Finish, LaunchFailedError
from grader.runtime.supervisor.supervisor import TRIES, Recorder, WorkerLostError

#: Answers a question of the worker, while virtual time stands still.
Answer = Callable[[Mapping[str, Any], Sequence[Observation]], Any]


class SteppedWorker(Protocol):
    """What a run is stepped in: a worker that has begun it, or a line to one."""

    def exchange(self, told: Mapping[str, Any] | None) -> dict[str, Any]:
        """Tell the worker something, and return what it says next; None only listens."""


class GiveBack(Protocol):
    """Gives back a worker that was lent."""

    def __call__(self, *, usable: bool) -> None:
        """Give it back; if it is not usable, it is ended."""


class LentWorker(NamedTuple):
    """A worker that has begun a run, and what gives it back when the run has ended."""

    worker: SteppedWorker
    give_back: GiveBack


def lend_stepped(recorder: Recorder, plan: Plan) -> LentWorker:
    """Return a worker of a recorder that has begun a run; one that has died while it was idle is replaced.

    Raises:
        HarnessError: No worker can be started.
    """
    for left in reversed(range(TRIES)):
        worker = recorder.lend()
        try:
            worker.step(plan)
            break
        except BaseException as error:
            recorder.take_back(worker, usable=False)
            if not (isinstance(error, WorkerLostError) and left):
                raise
    return LentWorker(worker, partial(recorder.take_back, worker))


class SteppedRun:
    """One run in a worker; nobody else uses that worker before the run has ended.

    Args:
        lent: The worker, which has begun the run.
        answer: Answers questions of the worker; gets what was observed since the last command, too. What it raises is
            raised by the command that led to the question.

    Attributes:
        now_ns: Virtual time since the run began.
        ended: The exit code of each process that has ended; None if it is not known.
        full: The limit that ended the recording, as a sentence; empty if none did.
        notes: Sentences for whoever reads the recording; known once the run has ended.
        unsuitable: Why virtual time does not suit the nodes; known once the run has ended, empty if it does.
    """

    def __init__(self, lent: LentWorker, answer: Answer) -> None:
        self._worker, self._give_back = lent
        self._answer = answer
        self._observations: list[Observation] = []
        self._raised: BaseException | None = None
        self._busy = self._closed = False
        self.now_ns = 0
        self.ended: dict[str, int | None] = {}
        self.full = self.unsuitable = ""
        self.notes: list[str] = []

    @property
    def is_busy(self) -> bool:
        """Whether a command is under way, so that no other one can be carried out."""
        return self._busy

    @property
    def is_closed(self) -> bool:
        """Whether the run has ended."""
        return self._closed

    def perform(self, command: Command) -> tuple[dict[str, Any], list[Observation]]:
        """Carry out a command; return what the worker answers, and what was observed since the last command.

        Raises:
            HarnessError: The command names something that this machine does not have, or the worker failed.
            RuntimeError: Another command is under way, or the run has ended.
        """
        if self._closed:
            raise RuntimeError("the run has ended")
        if self._busy:
            raise RuntimeError("another step is under way")
        self._busy = True
        try:
            told = self._worker.exchange({"do": type(command).__name__, "with": to_json(command)})
            while "ask" in told:
                told = self._worker.exchange({"answer": self._answered(told)})
        except BaseException:
            self._give_up()  # the worker may be anywhere
            raise
        finally:
            self._busy = False
        self._observations += self._adopt(told)
        if self._raised is not None:
            raised, self._raised = self._raised, None
            raise raised
        if told.get("problem"):
            raise (LaunchFailedError if told.get("launch_failed") else HarnessError)(told["problem"])
        observations, self._observations = self._observations, []
        return told, observations

    def close(self) -> list[Observation]:
        """End the run with all its processes, and return what was observed last."""
        if self._closed:
            return []
        told, observations = self.perform(Finish())
        self.notes, self.unsuitable = told["notes"], told["unsuitable"]
        self._closed = True
        usable = False
        try:
            usable = self._worker.exchange(None).get("worn") is False
        finally:
            self._give_back(usable=usable)
        return observations

    def _answered(self, question: Mapping[str, Any]) -> Any:
        self._observations += self._adopt(question)
        if self._raised is not None:
            return None  # the first error is raised at the end of the command
        try:
            return self._answer(question, self._observations)
        except Exception as error:
            self._raised = error
            return None

    def _adopt(self, told: Mapping[str, Any]) -> list[Observation]:
        from grader.runtime.recording.packed import observations_from_json  # noqa: PLC0415 - as in the supervisor

        self.now_ns, self.full = told["now_ns"], told.get("full", self.full)
        self.ended = dict(told.get("ended", self.ended))
        return observations_from_json(told["news"])

    def _give_up(self) -> None:
        self._closed = True
        self._give_back(usable=False)
