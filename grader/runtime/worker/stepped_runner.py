"""Runs what commands from outside ask for, on either clock: the same loop as for a plan, up to a moment each time.

Between two commands virtual time stands still, and real time passes. A question of this side, such as what a service
answers, is asked in the middle of a command, and nothing else happens here until it is answered.
"""

from __future__ import annotations

import base64
from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from typing import Any

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.scenario import Event
from grader.runtime.model.step_event import ProgramStep
from grader.runtime.model.trace import Fault, FaultKind, Observation
from grader.runtime.plan import Plan
from grader.runtime.simulation.participant import Moment, Output, Simulation
from grader.runtime.steps import (
    Advance,
    CallService,
    Command,
    Interrupt,
    Kill,
    Publish,
    ReadSteps,
    SendGoal,
    Serve,
    ServeAction,
    Simulate,
    StartProcesses,
)
from grader.runtime.stimuli.action_server import Attend
from grader.runtime.stimuli.calls import AddClients, Ask, PlannedCall, PlannedCalls
from grader.runtime.stimuli.events import Disappear, TopicEvent
from grader.runtime.stimuli.goals import goal_call
from grader.runtime.stimuli.messages import Advertise, PlannedMessages
from grader.runtime.stimuli.recorded import PublishRecorded
from grader.runtime.stimuli.server import AddServer, PlannedServer
from grader.runtime.worker.launch_service import LaunchService
from grader.runtime.worker.observer import Observer
from grader.runtime.worker.runner import Runner, StartNode
from grader.runtime.worker.service_peers import check_fields
from grader.runtime.worker.student_process import NodeProcess

#: Starts the processes of a plan; returns each with the time to wait before it runs, in nanoseconds, and fills in what
#: a launch file has besides.
Starter = Callable[[Plan, "LaunchedBesides"], Iterable[tuple[NodeProcess, int]]]
#: Asks the other side, which answers with a value that fits the question.
Question = Callable[[Mapping[str, Any]], Any]


@dataclass
class LaunchedBesides:
    """What a launch file has besides the processes that it starts.

    Attributes:
        left_out: Sentences about what it asks for and nobody starts.
        service: What it does while its nodes run; None for one that does nothing more, and without a launch file.
        start: Starts another process of it.
    """

    left_out: list[str] = field(default_factory=list)
    service: LaunchService | None = None
    start: StartNode | None = None


@dataclass(frozen=True, slots=True)
class PublishNext(TopicEvent):
    """Publish the next message of a stream, unless another one has replaced it."""

    stream: Stream
    number: int


class Stream:
    """Messages that a command publishes on a topic, in turn.

    Args:
        command: What to publish.
        begin_ns: When the first message is sent.
    """

    def __init__(self, command: Publish, begin_ns: int) -> None:
        self.command = command
        self._begin_ns = begin_ns

    def event(self, number: int) -> PublishNext | None:
        """Return the event that sends a message; None if there is none of this number."""
        period_ns, times_ns = self.command.period_ns, self.command.times_ns
        if times_ns:
            after_ns = times_ns[number] if number < len(times_ns) else None
        else:
            after_ns = number * period_ns if self.command.messages and (period_ns or not number) else None
        return None if after_ns is None else PublishNext(self._begin_ns + after_ns, self.command.topic, self, number)

    def message(self, number: int) -> bytes:
        """Return the message of a number; the last one is repeated."""
        return self.command.messages[min(number, len(self.command.messages) - 1)]


class SteppedRunner(Runner):
    """Carries out commands; what depends on the clock is left to the runner of that clock that a subclass also is.

    Args:
        plan: The limits, the clock and the seed; it has no processes and no stimuli.
        students: Receives the processes that are started.
        observer: The grader's node.
        start: Starts processes.
        ask: Asks the other side.
    """

    def __init__(
        self, plan: Plan, students: list[NodeProcess], observer: Observer, start: Starter, ask: Question
    ) -> None:
        super().__init__(plan, students, observer)
        self._start = start
        self._ask = ask
        self._on_topics: dict[str, Stream] = {}
        self._offered: dict[str, PlannedMessages] = {}
        self._served: set[str] = set()
        self._faults: list[Fault] = []
        self._is_news = False  # whether the command that is carried out has led to something observed

    @property
    def now_ns(self) -> int:
        """The time of the run."""
        return self._time_ns()

    def perform(self, command: Command) -> dict[str, Any]:
        """Carry out a command, and return what its sender has to know besides the observations.

        Raises:
            HarnessError: A type or a field is not known on this machine.
        """
        self._is_news = False
        match command:
            case Advance():
                self._advance(command.to_ns, until_news=command.until_news)
            case StartProcesses():
                return self._begin_processes(command)
            case Publish():
                self._publish(command)
            case Serve():
                self._serve(command.service, command.type)
            case ServeAction():
                self._offer_action(command.action, command.type, self._time_ns())
            case CallService():
                return self._call(command)
            case SendGoal():
                return self._send_goal(command)
            case Simulate():
                self._simulate(command)
            case Interrupt():
                self._interrupt_now(self._named(command.process))
            case Kill():
                self._kill(self._named(command.process))
            case ReadSteps():
                return {"steps": self.steps()}
        return {}

    def news(self) -> list[Observation]:
        """Return what was observed since the last call, and forget it, but for faults: they say what nodes need."""
        found = self._recorder.observations
        self._faults += [o for o in found if isinstance(o, Fault)]
        self._recorder.observations = []
        self._is_news = self._is_news or bool(found)
        return found

    def _has_news(self) -> bool:
        """Return whether something was observed in this command, even if it was told with a question already."""
        return self._is_news or bool(self._recorder.observations)

    def programs(self) -> dict[str, int | None]:
        """Return the exit code of each process that has ended."""
        return {s.name: s.exit_code for s in self._students if s.ended}

    def begun(self) -> dict[str, str]:
        """Return the folder of each process that a launch file has started which does more than that."""
        return {name: service.root for name, service in self._services_of.items()}

    def full(self) -> str:
        """Return the limit that ended the recording, as a sentence; empty if none did."""
        return self._recorder.full

    def unsuitable(self) -> str:
        """Return why this clock does not suit the nodes; empty if it does."""
        return self._graders_fault()

    def notes(self) -> list[str]:
        """Return the notes of the run."""
        others = [*self._observer.notes(), *(note for s in self._students for note in s.notes)]
        return list(self._recorder.notes(others))

    def steps(self) -> list[ProgramStep]:
        """Return what each program has done in each of its steps; nothing where nobody says when a step begins."""
        return []

    @property
    def is_odd(self) -> bool:
        """Whether something unusual has happened, after which a worker should be replaced; see `is_worn`."""
        ended = (FaultKind.KILLED, FaultKind.HUNG)
        return bool(self.notes()) or any(o.kind in ended for o in self._faults)

    def look(self) -> None:
        """Record the graph as it is."""
        self._last_look()

    def idle(self) -> None:
        """Do what has to be done between two commands: nothing where time stands still."""

    # ------------------------------------------------------------- the clock

    @abstractmethod
    def _advance(self, to_ns: int, *, until_news: bool = False) -> None:
        """Let time pass until a moment, or at least until now; with `until_news`, until something was observed."""

    @abstractmethod
    def _await_start(self, started: Sequence[NodeProcess]) -> None:
        """Let each of some new processes run until it waits for something."""

    @abstractmethod
    def _await_end(self, student: NodeProcess) -> None:
        """Let a process react to the stop signal."""

    def _await_readers(self, offer: PlannedMessages) -> None:
        """Wait until the subscriptions that are there would hear a publisher."""

    # ------------------------------------------------------------- processes

    def _begin_processes(self, command: StartProcesses) -> dict[str, Any]:
        started: list[NodeProcess] = []
        besides = LaunchedBesides()
        for student, delay_ns in self._start(command.plan, besides):
            self._students.append(student)
            if delay_ns:
                self._agenda.starts_ns[student.name] = self._time_ns() + delay_ns
            self._begin_process(student, delay_ns)
            started.append(student)
        if besides.service is not None and besides.start is not None:
            self.add_launch(besides.service, besides.start)
        if command.settle:
            self._await_start([student for student in started if student.name not in self._agenda.starts_ns])
        # what starts later has declared nothing yet
        given = [(one.name, *one.given) for one in started if one.name not in self._agenda.starts_ns]
        return {"started": [student.name for student in started], "left_out": besides.left_out, "given": given}

    def _interrupt_now(self, student: NodeProcess) -> None:
        if student.ended or student.stop_signalled:
            return
        self._note_stop(student, self._time_ns())
        self._interrupt(student)
        self._await_end(student)

    # -------------------------------------------------------------- stimuli

    def _publish(self, command: Publish) -> None:
        """Begin to publish on a topic; what was published there until now ends."""
        topic = command.topic
        if not command.messages:
            self._on_topics.pop(topic, None)
            return
        qos = {"best_effort": command.best_effort, "latched": command.latched}
        offer = PlannedMessages(topic, command.type, 0, 0, 1, 0, values=(), **qos)
        if self._offered.get(topic) != offer:
            if topic in self._offered:
                self._do(Disappear(self._time_ns(), topic), self._time_ns())
            self._do(Advertise(self._time_ns(), topic, offer), self._time_ns())
            self._offered[topic] = offer
        self._await_readers(offer)
        stream = self._on_topics[topic] = Stream(command, self._time_ns())
        first = stream.event(0)
        assert first is not None
        self._agenda.later(first)

    def _do(self, event: Event, now_ns: int) -> None:
        if not isinstance(event, PublishNext):
            super()._do(event, now_ns)
            return
        stream = event.stream
        if self._on_topics.get(event.topic) is not stream:
            return
        if (following := stream.event(event.number + 1)) is not None:
            self._agenda.later(following)
        self._send(PublishRecorded(event.t_ns, event.topic, stream.message(event.number), {}), now_ns)

    def _serve(self, service: str, interface: str) -> None:
        server = PlannedServer(service, interface, 0, 0, 0, cycle=False, answers=0, responses=())
        if service not in self._served:
            self._served.add(service)
            self._do(AddServer(self._time_ns(), server), self._time_ns())

    def _attended(self, event: Attend, now_ns: int) -> Mapping[str, Any]:
        asked = {"action": event.action, "part": event.part, "number": event.number, "request": event.request}
        answer = self._ask({"ask": "action", **asked, "now_ns": now_ns, "clock_ns": self._clock_ns(now_ns)})
        return answer if isinstance(answer, dict) else {"does": (), "wakes_ns": ()}

    def _published(self, topic: str, content: Any, now_ns: int) -> Event:
        return PublishRecorded(now_ns, topic, base64.b64decode(content), {})

    def _simulated(
        self, now_ns: int, service: str, request: Mapping[str, Any], number: int
    ) -> Mapping[str, Any] | None:
        if service in self._parts or service not in self._served:
            return super()._simulated(now_ns, service, request, number)
        answer = self._ask({"ask": "service", "service": service, "request": request, "now_ns": now_ns})
        return answer if isinstance(answer, dict) else None

    def _call(self, command: CallService) -> dict[str, Any]:
        now_ns = self._time_ns()
        calls = PlannedCalls(command.service, command.type, now_ns, NS_PER_S, 1, (command.request,))
        check_fields(calls, command.service)
        self._do(AddClients(now_ns, calls), now_ns)
        self._agenda.later(Ask(now_ns, PlannedCall(calls, 0)))
        return {"client": self._services.clients_of(command.service)}

    def _send_goal(self, command: SendGoal) -> dict[str, Any]:
        check_fields(command.goal, command.goal.action)
        call, now_ns = goal_call(command.goal), self._time_ns()
        clients = []
        for part in (call, *(following for _, following in call.then)):
            self._do(AddClients(now_ns, part.calls), now_ns)
            clients.append(self._services.clients_of(part.calls.service))
        self._agenda.later(Ask(now_ns, call))
        return {"clients": clients}

    def _simulate(self, command: Simulate) -> None:
        simulation = _Elsewhere(command, self._ask)
        most, now_ns = self._plan.limits.messages, self._time_ns()
        for event in self._simulations.add(f"number {command.number}", simulation, most, now_ns):
            if isinstance(event, (Advertise, AddServer)):
                self._do(event, now_ns)
            else:
                self._agenda.later(event)


class _Elsewhere(Simulation):
    """A simulation whose methods run on the other side."""

    def __init__(self, command: Simulate, ask: Question) -> None:
        self._command = command
        self._ask = ask
        self.period = command.period_ns

    def publishes(self) -> Mapping[str, str]:
        return self._command.publishes

    def records(self) -> Mapping[str, str]:
        return self._command.records

    def hears(self) -> Mapping[str, tuple[str, ...]]:
        return self._command.hears

    def serves(self) -> Mapping[str, str]:
        return self._command.serves

    def step(self, now: Moment) -> Iterable[Output]:
        return self._outputs(now, "step")

    def on_message(self, now: Moment, topic: str, message: Mapping[str, Any]) -> Iterable[Output]:
        return self._outputs(now, "on_message", topic, message)

    def on_request(self, now: Moment, service: str, request: Mapping[str, Any]) -> Mapping[str, Any]:
        answer = self._asked(now, "on_request", service, request)
        return answer if isinstance(answer, dict) else {}

    def _outputs(self, now: Moment, method: str, *arguments: Any) -> Iterable[Output]:
        answer = self._asked(now, method, *arguments)
        return [(topic, fields) for topic, fields in answer] if isinstance(answer, list) else []

    def _asked(self, now: Moment, method: str, *arguments: Any) -> Any:
        question = {"ask": "simulation", "number": self._command.number, "method": method, "arguments": arguments}
        return self._ask({**question, "now_ns": now.t_ns, "clock_ns": now.clock_ns})
