"""Commands are carried out one after the other, and everybody knows what they have led to before anybody complains."""

import contextlib
from collections.abc import Mapping, Sequence
from typing import Any

import pytest

from grader.runtime.model.errors import GraderError
from grader.runtime.model.limits import Limits
from grader.runtime.model.trace import Observation, OutputLine
from grader.runtime.plan import Plan
from grader.runtime.recording.codec import observation_to_json
from grader.runtime.session import LentWorker, WorkerLostError
from grader.runtime.steps import Advance, Command, Publish, StartProcesses
from grader.world.errors import StepTimeout
from grader.world.observed import Observed
from grader.world.timeline import Timeline

Said = Mapping[str, Any]
#: What a worker says after a command that nothing has happened in.
IDLE: Said = {"now_ns": 0, "full": "", "ended": [], "news": [], "notes": [], "unsuitable": ""}


class ScriptedWorker:
    """Says what is in its script, and then that nothing has happened; it notes what it is told, and is a session."""

    def __init__(self, *script: Said | Exception) -> None:
        self._script = [*script]
        self.heard: list[Any] = []
        self.given_back: list[bool] = []

    def begin(self, plan: Plan) -> LentWorker:
        """Lend this worker."""
        del plan
        return LentWorker(self, self._give_back)

    def exchange(self, told: Said | None) -> dict[str, Any]:
        """Say the next line."""
        self.heard.append(told and told.get("do", told))
        if told is None:
            return {"worn": False}
        said = self._script.pop(0) if self._script else IDLE
        if isinstance(said, Exception):
            raise said
        return dict(said)

    def _give_back(self, *, usable: bool) -> None:
        self.given_back.append(usable)


class Listener:
    """A participant that notes what it is told, in the order of all of them."""

    def __init__(self, name: str, log: list[str], complaint: Exception | None = None) -> None:
        self._name, self._log, self._complaint = name, log, complaint

    def note(self, command: Command | None, told: Said, observations: Sequence[Observation]) -> None:
        """Note what was observed."""
        del told
        texts = [one.text for one in observations if isinstance(one, OutputLine)]
        self._log.append(f"{self._name} notes {', '.join([type(command).__name__, *texts])}")

    def complain(self) -> None:
        """Raise what there is to raise."""
        self._log.append(f"{self._name} complains")
        if self._complaint is not None:
            raise self._complaint


def opened(worker: ScriptedWorker, **changed: Any) -> tuple[Timeline, Observed, Plan]:
    """Begin a run with a worker."""
    plan = Plan("test", (), "/", "0", 0, "", 0, "virtual", limits=Limits(), **changed)
    observed = Observed(lambda message: message)
    return Timeline(worker, plan, observed), observed, plan


def line(t_ns: int, text: str) -> list[Any]:
    """Return a line of output as the worker sends it."""
    return observation_to_json(OutputLine(t_ns, "talker.py", "stdout", text))


def test_all_know_before_one_complains() -> None:
    """What a program has written is there when the failure is raised that it explains."""
    log: list[str] = []
    timeline, observed, _ = opened(ScriptedWorker({**IDLE, "now_ns": 5, "news": [line(5, "hello")]}))
    timeline.join(Listener("first", log, ValueError("too fast")))
    timeline.join(Listener("second", log))
    with pytest.raises(ValueError, match="too fast"):
        timeline.perform(Advance(5))
    assert log == ["first notes Advance, hello", "second notes Advance, hello", "first complains"]
    assert [one.t_ns for one in observed.everything] == [5]
    assert timeline.now_ns == 5


def test_a_full_recording_ends_the_test_before_anybody_complains() -> None:
    """Its limit is the cause of whatever else is wrong."""
    log: list[str] = []
    timeline, _, _ = opened(ScriptedWorker({**IDLE, "full": "more than 3 messages"}))
    timeline.join(Listener("only", log))
    with pytest.raises(GraderError, match="the test was ended: more than 3 messages"):
        timeline.perform(Advance(5))
    assert log == ["only notes Advance"]


@pytest.mark.parametrize(
    ("drawn", "between"), [(True, ["StartProcesses", "StartProcesses", "Advance", "Publish"]), (False, None)]
)
def test_programs_whose_order_is_drawn_come_up_before_anything_else(drawn: bool, between: list[str] | None) -> None:
    """Those that are started one after the other start together, with the command after them."""
    worker = ScriptedWorker()
    timeline, _, plan = opened(worker, drawn_order=drawn)
    for _ in range(2):
        timeline.perform(StartProcesses(plan, settle=not drawn))
    timeline.perform(Publish("/in", "std_msgs/msg/String", (b"",)))
    assert worker.heard == (between or ["StartProcesses", "StartProcesses", "Publish"])


def test_a_wait_goes_from_news_to_news() -> None:
    """It looks once at what is there, then at each moment at which something was observed, and last at the deadline."""
    worker = ScriptedWorker(IDLE, {**IDLE, "now_ns": 4, "news": [line(4, "a")]}, {**IDLE, "now_ns": 10})
    timeline, observed, _ = opened(worker)
    looks: list[int] = []

    def look() -> str | None:
        looks.append(len(observed.everything))
        return None

    with pytest.raises(StepTimeout, match="since 0"):
        timeline.wait(look, 1e-8, lambda since_ns: StepTimeout(f"since {since_ns}"))
    assert looks == [0, 1, 1]
    assert worker.heard == ["Advance"] * 3


def test_time_does_not_go_back() -> None:
    """Nothing is asked of the worker."""
    worker = ScriptedWorker()
    timeline, _, _ = opened(worker)
    with pytest.raises(ValueError, match="expected seconds to advance, found -1: time does not go back"):
        timeline.advance(-1)
    assert worker.heard == []


def test_who_answers_for_the_test_lets_no_time_pass() -> None:
    """The worker asks in the middle of a command, and waits."""
    question = {"ask": "service", "service": "/s", "now_ns": 4, "news": [line(4, "a")]}
    worker = ScriptedWorker(question, {**IDLE, "now_ns": 5, "news": [line(5, "b")]})
    timeline, observed, _ = opened(worker)
    told: list[Said] = []
    seen: list[tuple[int, int]] = []

    def answer(question: Said) -> None:
        told.append(question)
        timeline.catch_up()  # looking is allowed
        seen.append((timeline.now_ns, len(observed.everything)))
        timeline.perform(Advance(5))

    timeline.join(Listener("only", []), service=answer)
    with pytest.raises(RuntimeError, match="cannot let time pass"):
        timeline.perform(Advance(1))
    assert told == [question]
    assert seen == [(4, 1)]
    assert timeline.perform(Advance(6)) == IDLE
    assert [one.t_ns for one in observed.everything] == [4, 5]


@pytest.mark.parametrize(("script", "usable"), [([], True), ([WorkerLostError("it has ended")], False)])
def test_the_worker_is_given_back_once(script: list[Exception], usable: bool) -> None:
    """For the next run, unless it is lost."""
    worker = ScriptedWorker(*script)
    timeline, _, _ = opened(worker)
    with contextlib.suppress(WorkerLostError):
        timeline.perform(Advance(1))
    timeline.close()
    timeline.close()
    assert worker.given_back == [usable]
