"""Student processes and an observer that act as a test says, for conductors without ROS and without processes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Generator, Iterable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from grader.runtime.host.clock import EPOCH_NS
from grader.runtime.host.protocol import (
    NO_COUNTERPARTS,
    ORDINARY,
    Answer,
    AwaitMatches,
    Claim,
    Go,
    Note,
    Progress,
    Report,
    checked_report,
)
from grader.runtime.model.trace import Endpoint, Fault, GraphSnapshot, OutputLine
from grader.runtime.plan import Plan
from grader.runtime.stimuli.numbers import PlannedNumbers
from grader.runtime.worker.core import Taken
from grader.runtime.worker.delay import Delay
from grader.runtime.worker.ending import ended_by
from grader.runtime.worker.notes import Places

#: Stands for the submission: this file is in it.
HERE = Path(__file__).resolve().parent
MS = 1_000_000
#: How often a scripted wait looks at its condition.
LOOKS = 20
FLOAT, INT = "std_msgs/msg/Float32", "std_msgs/msg/Int32"

#: Yields reports, as the values of JSON that a process may send, and is sent answers.
Program = Generator[dict[str, Any] | None, Any, Any]
Behaviour = Callable[["ScriptedStudent", "World"], Program]


def plan(**fields: Any) -> Plan:
    """Return a plan of one second without stimuli, but for what is given."""
    usual: dict[str, Any] = {
        "scenario": "alone",
        "processes": (),
        "root": "/nowhere",
        "host_seed": "ab" * 32,
        "duration_ns": 1000 * MS,
        "first_message_on": "",
        "wait_at_most_ns": 5000 * MS,
        "clock": "virtual",
    }
    return Plan(**{**usual, **fields})


def numbers(
    *values: tuple[float, int], topic: str = "/temperature", start_ms: int = 100, period_ms: int = 100, **other: Any
) -> PlannedNumbers:
    """Return a stimulus that publishes some numbers."""
    usual: dict[str, Any] = {"type": FLOAT, "repeats": 1}
    return PlannedNumbers(
        topic=topic, start_ns=start_ms * MS, period_ns=period_ms * MS, numbers=values, **{**usual, **other}
    )


def idle(wake_ms: float | None = None, **fields: Any) -> dict[str, Any]:
    """Return the report of a process that has nothing to do until a time."""
    wake_ns = None if wake_ms is None else EPOCH_NS + round(wake_ms * MS)
    return {"kind": "idle", "wake_ns": wake_ns, **fields}


def wait(wake_ms: float | None = None, **fields: Any) -> Program:
    """Wait until a time or until something arrives, as hosts do when they are woken for nothing; return the answer."""
    answer = yield idle(wake_ms, **fields)
    while not answer.arrivals and (wake_ms is None or answer.now_ns < EPOCH_NS + wake_ms * MS):
        answer = yield idle(wake_ms)
    return answer


def claim(kind: str, name: str, interface: str = FLOAT, number: int = 0, **qos: Any) -> dict[str, Any]:
    """Return what a host says of an endpoint, as the values of JSON."""
    said = {"kind": kind, "name": name, "type": interface, "number": number}
    return {**said, "qos": {**ORDINARY._asdict(), **qos}} if kind in ("publisher", "subscription") else said


def looks(condition: Callable[[], bool], seconds: float, *, pause_s: float) -> bool:
    """Wait as `wait_until` does, but for so many looks: nothing is on its way in real time."""
    del seconds, pause_s
    return any(condition() for _ in range(LOOKS))


class World:
    """What the processes of a test publish and which endpoints they have; the observer looks at it."""

    def __init__(self) -> None:
        self.flying: list[Taken] = []
        self.claims: dict[str, list[dict[str, Any]]] = {}

    def publish(self, topic: str, value: float = 0.0, interface: str = FLOAT) -> None:
        """Let a message fly; the report has to say that it was sent."""
        self.flying.append(Taken(topic, interface, b"", {"data": value}))

    def have(self, process: str, *claims: dict[str, Any]) -> list[dict[str, Any]]:
        """Give a process its endpoints, and return them for its report."""
        self.claims[process] = list(claims)
        return list(claims)


class ScriptedWorkload:
    """Stands in for a measured process: each report says what the step before it cost."""

    def __init__(self, student: ScriptedStudent, start_ns: int) -> None:
        self._student = student
        self.delay = Delay(start_ns)
        self.used_ns, self.waited_ns = 1, 0

    def begin(self, t_ns: int, *, arrivals: bool = False) -> None:
        """Wake up."""
        self.delay.wake(t_ns)

    def arrived(self) -> None:
        """Wait no longer for messages."""

    def beside(self) -> AbstractContextManager[None]:
        """Measure nothing."""
        return nullcontext()

    def end(self, progress: Progress, passed_ns: int) -> None:
        """Take what the step cost."""
        self.delay.work(self._student.cost_ns)


class ScriptedStudent:
    """Stands in for a student's process: a generator that yields reports and is sent answers.

    It answers by itself when it is told to wait for matches. None as a report is an end without a word.
    """

    def __init__(self, name: str, program: Callable[[ScriptedStudent, World], Program], world: World) -> None:
        self.name = name
        self.wake_ns: int | None = None
        self.claims: list[Claim] = []
        self.arrivals: dict[str, int] = {}
        self.told = NO_COUNTERPARTS
        self.offers: set[tuple[str, str, str]] = set()
        self.nudged = False
        self.resumes_ns = 0
        self.released: dict[str, int] = {}
        self.ended = False
        self.renewed = False
        self.unmatched: frozenset[str] = frozenset()
        self.sees_graph = self.leaving = False
        self.workload: ScriptedWorkload | None = None
        self.unsettled = self.grader_failed = ""
        self.notes: list[str] = []
        self.places = Places(HERE)
        self.start_told = None
        self.stop_signalled = self.stopping = False
        self.heard: list[Answer] = []
        self.missing: Any = []
        self._written: list[str] = []
        self._answer: Answer | None = None
        self._discovery = False
        self._program = program(self, world)
        self._begun = False
        self.cost_ns = 0

    def write(self, text: str) -> None:
        """Write a line; it is read with the next report."""
        self._written.append(text)

    def times_ms(self) -> list[float]:
        """Return the times it was told, in virtual milliseconds."""
        return [(a.now_ns - EPOCH_NS) / MS for a in self.heard if isinstance(a, Go)]

    def measured(self, t_ns: int) -> ScriptedWorkload:
        """Return what measures its steps."""
        self.workload = self.workload or ScriptedWorkload(self, t_ns)
        return self.workload

    def tell(self, answer: Answer) -> None:
        """Take an answer of the runner."""
        self._discovery = isinstance(answer, AwaitMatches)
        if not self._discovery:
            self._answer = answer
        self.heard.append(answer)

    def report(self) -> Report | None:
        """Return the next report, checked as what comes from any process."""
        if self._discovery:
            self._discovery = False
            return checked_report({"kind": "matched", "missing": self.missing})
        answer, self._answer = self._answer, None
        try:
            if not self._begun:
                self._begun = True
                report = next(self._program)
            else:
                report = self._program.send(answer)
        except StopIteration:
            report = {"kind": "exited", "code": 0}
        self.cost_ns = (report or {}).get("cost_ns", 0)
        return None if report is None else checked_report(report)

    def reports(self) -> list[Report | None]:
        """Return what has come without waiting, for the wall clock: a report, or nothing for an empty one."""
        self._begun = True
        found = next(self._program, {"kind": "silent"})
        if found is None:
            return [None]
        return [] if found.get("kind") == "silent" else [checked_report(found)]

    def output(self, t_ns: int, *, final: bool = False) -> list[OutputLine]:
        """Return what was written since the last time."""
        written, self._written = self._written, []
        return [OutputLine(t_ns, self.name, "stdout", text) for text in written]

    def note(self, report: Note) -> None:
        """Take a note."""
        self.notes.append(report.code)

    def drain(self, reads: int = 1) -> None:
        """Read what has been written: it has been."""

    def death(self, t_ns: int) -> Fault:
        """Return the fault of an end without a word."""
        return ended_by(self.name, t_ns, "SIGKILL")


class ScriptedObserver:
    """Stands in for the grader's node: sees the world at once, and notes what is published."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._watched: set[tuple[str, str]] = set()
        self.published: list[tuple[str, Any]] = []
        self.unnamed: Counter[tuple[str, str, str]] = Counter()
        self.crowded = ""
        self.advertised: list[tuple[str, str, bool]] = []
        self.services: Any = None

    def graph(self, t_ns: int, *, services: bool = False, existing: Collection[str] | None = None) -> GraphSnapshot:
        """Return the graph of all claims."""
        ends = [
            Endpoint(c["kind"], c["name"], c["type"], f"/{name[:-3]}", number, "reliable", "volatile")
            for number, (name, claims) in enumerate(self._world.claims.items())
            for c in claims
            if c["kind"] in ("publisher", "subscription")
        ]
        return GraphSnapshot(t_ns, tuple(f"/{name[:-3]}" for name in self._world.claims), tuple(ends))

    def with_qos(self, graph: GraphSnapshot) -> GraphSnapshot:
        """Return the graph: its services have the usual QoS."""
        return graph

    def participants(self) -> int:
        """Return how many processes have endpoints."""
        return len(self._world.claims)

    def participants_of_nodes(self) -> dict[bytes, set[str]]:
        """Return a participant of each process, with its nodes."""
        return {
            process.encode(): {c["name"] for c in claims if c["kind"] == "node"}
            for process, claims in self._world.claims.items()
        }

    def has_namesakes(self) -> bool:
        """Return whether nodes of one name are claimed."""
        names = self.students_nodes()
        return len({*names}) < len(names)

    def say_farewell(self, participants: Iterable[bytes]) -> None:
        """Let processes leave."""
        for participant in participants:
            self._world.claims.pop(participant.decode(), None)

    def notes(self) -> list[str]:
        """Return what is to be said of messages: nothing."""
        return []

    def watch(self, endpoints: Iterable[Endpoint]) -> list[str]:
        """Watch every publisher."""
        self._watched |= {(e.topic, e.type) for e in endpoints if e.kind == "publisher"}
        return []

    def students_nodes(self, existing: Collection[str] | None = None) -> list[str]:
        """Return the nodes that are claimed."""
        return [c["name"] for claims in self._world.claims.values() for c in claims if c["kind"] == "node"]

    def ends_of(self, kind: str, service: str) -> int:
        """Return how many servers or clients of a service are claimed."""
        claims = [c for claims in self._world.claims.values() for c in claims]
        return sum((c["kind"], c["name"]) == (kind, service) for c in claims)

    def publishes(self, topic: str) -> bool:
        """Return whether a stimulus is published on a topic."""
        return any(name == topic for name, _, _ in self.advertised)

    def take_rest(self) -> list[Taken]:
        """Return what still flies."""
        return self.take()

    def reads(self, topic: str) -> bool:
        """Return whether a topic is watched."""
        return any(name == topic for name, _ in self._watched)

    def watching(self, topic: str, interface: str) -> list[bool]:
        """Return the subscriptions on a topic."""
        return [True] if (topic, interface) in self._watched else []

    def publishers_matched(self, topic: str, interface: str) -> int:
        """Return how many publishers are matched: all."""
        claims = [c for claims in self._world.claims.values() for c in claims]
        return sum((c["kind"], c["name"], c["type"]) == ("publisher", topic, interface) for c in claims)

    def await_arrival(self, wait_ns: int) -> None:
        """Return at once: there is always something to look at."""

    def take(self, at_once: int = 1000) -> list[Taken]:
        """Return what flies."""
        taken, self._world.flying = self._world.flying, []
        return taken

    def advertise(self, topic: str, interface: str, *, latched: bool, best_effort: bool = False) -> None:
        """Note a stimulus's publisher."""
        self.advertised.append((topic, interface, latched))

    def subscribers_matched(self, topic: str) -> int:
        """Return how many subscriptions a stimulus has: enough."""
        return 99

    def publish(self, topic: str, message: Any) -> None:
        """Note a stimulus's message."""
        self.published.append((topic, message))

    def withdraw(self, topic: str) -> None:
        """Note that a stimulus's publisher goes."""
        self.advertised.append((topic, "", False))
