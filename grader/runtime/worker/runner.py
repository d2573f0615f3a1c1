"""Base class of the runners: the parts of running a plan that are the same on both clocks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any, ClassVar

from grader.runtime.host.protocol import Claim, ThreadFault
from grader.runtime.message_classes import plain_fields
from grader.runtime.model.scenario import Event
from grader.runtime.model.trace import AssessedTrace, ClockKind, Delivery, Mark, Observation, Offer
from grader.runtime.model.wording import unused_name
from grader.runtime.plan import Plan
from grader.runtime.served_actions import PARTS_OF_ACTIONS, TOPICS_OF_ACTIONS, ServedAction, planned_action
from grader.runtime.simulation.participant import Moment
from grader.runtime.stimuli.action_server import AddAction, Attend
from grader.runtime.stimuli.calls import AddClients, Ask, PlannedCalls
from grader.runtime.stimuli.events import Disappear, TopicEvent, events_in_order
from grader.runtime.stimuli.messages import Advertise, PlannedMessages, PublishFields
from grader.runtime.stimuli.server import AddServer, PlannedServer, RemoveServer, Respond
from grader.runtime.stimuli.simulation import Record, Step
from grader.runtime.worker.core import Agenda, Taken
from grader.runtime.worker.ending import never_stopped, reported_fault
from grader.runtime.worker.launch_service import (
    BeginNode,
    DoLater,
    KillNode,
    LaunchDue,
    LaunchService,
    Order,
    StopNode,
    TellReader,
)
from grader.runtime.worker.observer import Observer
from grader.runtime.worker.service_peers import LATER, ServicePeers
from grader.runtime.worker.simulations import Simulations
from grader.runtime.worker.student_process import NodeProcess
from grader.runtime.worker.topic_peers import TopicPeers
from grader.runtime.worker.trace_recorder import OFFERS, TraceRecorder
from grader.runtime.worker.transit import Transit

#: Starts a process of a node that a launch file describes, by the number of the node, under a name.
StartNode = Callable[[LaunchService, int, str], NodeProcess]


class Runner(ABC):
    """Runs one plan.

    Args:
        plan: What to run.
        students: The started processes, each waiting for its first answer.
        observer: The grader's node.

    Attributes:
        fills_machine: Returns whether the nodes use most of the machine themselves; set by whoever watches them.
    """

    clock: ClassVar[ClockKind]
    #: The default reason for using this clock.
    clock_reason: ClassVar[str] = ""
    _topics: TopicPeers

    def __init__(self, plan: Plan, students: list[NodeProcess], observer: Observer) -> None:
        self._plan = plan
        self._students = students
        self._observer = observer
        self._stop_ns = 0
        self.fills_machine: Callable[[], bool] = lambda: False
        self._simulations = Simulations(plan)
        self._actions: dict[str, ServedAction] = {}
        self._parts: dict[str, tuple[str, str]] = {}  # service of an action -> the action, and which part of it that is
        self._streams: dict[str, PlannedMessages] = {}  # topic of an action -> what it is published as
        self._transits = {connection.topic: Transit(connection) for connection in plan.connections}
        # Simulations last: of two events at one instant, that of the plan comes first.
        planned = events_in_order([*plan.events(), *self._simulations.events()])
        due = events_in_order(arrived for event in planned if (arrived := self._arrival(event)) is not None)
        end_ns = plan.wait_at_most_ns if plan.first_message_on else plan.duration_ns
        self._services_of: dict[str, LaunchService] = {}  # by the processes that a launch file has started
        self._launches: dict[LaunchService, StartNode] = {}
        self._agenda = Agenda(due, dict(plan.starts_ns), end_ns)
        participants = max(plan.limits.participants, len(plan.processes))  # each process needs one
        self._recorder = TraceRecorder(replace(plan.limits, participants=participants))
        self._recorder.add(
            *(Mark(0, "simulation_hears", f"{topic} {type_}") for topic, type_ in self._simulations.heard())
        )
        self._services = ServicePeers(
            plan,
            observer.services,
            self._recorder,
            nodes=lambda: self._recorder.graph.nodes,
            later=self._agenda.later,
            simulated=self._simulated,
        )

    def add_launch(self, service: LaunchService, start: StartNode, begins_ns: int = 0) -> None:
        """Take part in what a launch file does while its nodes run.

        Args:
            service: The launch file, whose first nodes are among the processes.
            start: Starts another process of it.
            begins_ns: When it begins, from now on.
        """
        self._launches[service] = start
        self._obey(service, service.begin(), self._time_ns() + begins_ns)
        self._services_of |= dict.fromkeys(service.names, service)

    def run(self) -> AssessedTrace:
        """Run the plan to its end and return the trace."""
        self._begin()
        self._run_on()
        # The graph before the stop signal, which takes nodes out of it.
        self._recorder.look_back(self._last_look())
        self._stop_ns = self._agenda.end_ns
        unfit = self._unfit()
        # A recording that is not judged, or has ended early, shows nothing about the end of its programs.
        if self._plan.shutdown_ns and not (unfit or self._recorder.full):
            self._shut_down()
        return AssessedTrace(
            scenario=self._plan.scenario,
            clock=self.clock,
            clock_reason=unfit or self.clock_reason,
            stop_ns=self._stop_ns,
            observations=self._observations(),
            notes=self._recorder.notes([*self._observer.notes(), *(note for s in self._students for note in s.notes)]),
            starts=tuple(s.start_told for s in self._students if s.start_told is not None),
            # The grader's own fault first: it says more than that the machine was busy.
            harness_problem=self._graders_fault() or self._harness_problem(),
            incomplete=self._is_incomplete(),
            may_drift=self._may_drift(),
            drawn=self._simulations.drawn(),
        )

    @abstractmethod
    def _time_ns(self) -> int:
        """Return the time of the run, in nanoseconds from its start."""

    @abstractmethod
    def _clock_ns(self, now_ns: int) -> int:
        """Return what the clock of a student's node shows at a time of the run, in nanoseconds since 1970."""

    @abstractmethod
    def _begin(self) -> None:
        """Start the processes that do not start late."""

    @abstractmethod
    def _run_on(self) -> None:
        """Continue until the end, or until nothing more can happen."""

    @abstractmethod
    def _last_look(self) -> int:
        """Record the graph at the end, and return the time."""

    @abstractmethod
    def _interrupt(self, student: NodeProcess) -> None:
        """Send a process the stop signal, as Ctrl-C does."""

    @abstractmethod
    def _signal_stop(self, student: NodeProcess) -> None:
        """Let a process notice the stop signal, in the middle of a run."""

    @abstractmethod
    def _begin_process(self, student: NodeProcess, delay_ns: int) -> None:
        """Let a process run after a time."""

    @abstractmethod
    def _lose(self, student: NodeProcess) -> None:
        """Forget the endpoints of a process that was killed."""

    @abstractmethod
    def _is_served(self, calls: PlannedCalls) -> bool:
        """Return whether the server for some calls exists and is matched."""

    def _unfit(self) -> str:
        """Return why this clock is not suitable for the nodes; empty if it is."""
        return ""

    def _may_drift(self) -> bool:
        """Return whether the work of a node may slow it down on the real clock, which this one may hide."""
        return False

    def _graders_fault(self) -> str:
        """Return what failed in the grader's own code in the processes; empty if nothing did."""
        return next((student.grader_failed for student in self._students if student.grader_failed), "")

    def _harness_problem(self) -> str:
        """Return why the recording cannot be judged; empty if it can."""
        return ""

    def _is_incomplete(self) -> bool:
        """Return whether something that the middleware should have delivered did not come in time."""
        return False

    def _observations(self) -> tuple[Observation, ...]:
        """Return the observations, in order."""
        return tuple(self._recorder.observations)

    @abstractmethod
    def _announce_exchange(self, kind: str, service: str, count: int) -> None:
        """Note that requests or responses are on their way to the students' nodes."""

    def _shut_down(self) -> None:
        """Send the stop signal to every process, and continue until all have ended."""
        self._agenda.shut_down(self._time_ns(), self._plan.shutdown_ns)
        for service in self._launches:
            service.interrupted()
        for student in self._students:
            if not student.ended:
                self._note_stop(student, self._time_ns())
                self._interrupt(student)
        self._run_on()
        for student in self._students:
            if not student.ended:
                self._recorder.add(never_stopped(student.name, self._agenda.end_ns, self._plan.shutdown_ns))

    def _record(self, now_ns: int, taken: Taken, *, early: bool = False, arrived_ns: int | None = None) -> None:
        """Record a message, and let simulations react to it; they learn of it now, even if it arrived before."""
        arrived_ns = now_ns if arrived_ns is None else arrived_ns
        # Before the message is recorded, after which its topic has been seen.
        first = taken.topic == self._plan.first_message_on and not self._recorder.seen(taken.topic)
        if first and not self._stop_ns:
            self._agenda.end_ns = arrived_ns + self._plan.duration_ns
        self._recorder.message(arrived_ns, taken, early=early)
        # Not after the end: a simulation would go on reacting to nodes that are about to leave.
        if self._simulations.exist and not (self._recorder.full or self._stop_ns):
            for event in self._simulations.hear(taken, self._moment(now_ns)):
                if (arrived := self._arrival(event)) is not None:
                    self._agenda.later(arrived)

    def _simulated(
        self, now_ns: int, service: str, request: Mapping[str, Any], number: int
    ) -> Mapping[str, Any] | None:
        """Return the response to a request at a time; None if nothing but the plan says what it is."""
        if service in self._parts:  # what is done with a goal may take time, and publish
            self._agenda.later(Attend(now_ns, *self._parts[service], number, request))
            return LATER
        return self._simulations.answer(service, request, self._moment(now_ns))

    def _moment(self, now_ns: int) -> Moment:
        return Moment(now_ns, self._clock_ns(now_ns))

    def _end_if_full(self, now_ns: int) -> None:
        if self._recorder.full:
            self._agenda.end_by(now_ns)

    def _note_offers(self, student: NodeProcess, claims: Iterable[Claim], now_ns: int) -> None:
        """Record the services, clients and parameters of a process that are new."""
        for claim in claims:
            offer = (claim.kind, claim.name[:300], claim.type[:300])
            told = offer in student.offers or len(student.offers) >= OFFERS
            if claim.kind in ("service", "client", "parameter") and not told:
                student.offers.add(offer)
                self._recorder.add(Offer(now_ns, student.name, *offer))

    def _report_fault(self, student: NodeProcess, report: ThreadFault, now_ns: int) -> None:
        """Record a fault that a process has reported."""
        self._recorder.add(reported_fault(student.name, now_ns, report.fault, self._plan.limits, student.places))

    def _arrival(self, event: Event) -> Event | None:
        """Return an event as it reaches the processes; None for a message that is lost on the way."""
        transit = self._transits.get(event.topic) if isinstance(event, TopicEvent) else None
        if transit is None:
            return event
        if event.creates or isinstance(event, Disappear):
            return replace(event, t_ns=max(event.t_ns, transit.over_ns))
        arrives_ns = transit.arrives_ns(event.t_ns)
        return None if arrives_ns is None else replace(event, t_ns=arrives_ns)

    def _send(self, event: Event, now_ns: int) -> None:
        """Execute an event when it reaches the processes, which may be now."""
        arrived = self._arrival(event)
        if arrived is not None and arrived.t_ns > now_ns:
            self._agenda.later(arrived)
        elif arrived is not None:
            self._do(arrived, now_ns)

    def _do(self, event: Event, now_ns: int) -> None:
        """Execute one event of a stimulus."""
        if isinstance(event, TopicEvent):
            self._topics.do(event, now_ns)
        elif isinstance(event, Step):
            *published, following = self._simulations.step(event, self._moment(event.t_ns))
            for message in published:
                self._send(message, now_ns)
            self._agenda.later(following)
        elif isinstance(event, Record):
            self._recorder.add(Delivery(now_ns, event.topic, event.type, plain_fields(event.message)))
        elif isinstance(event, AddAction):
            self._actions[event.server.action] = planned_action(event.server)
            self._offer_action(event.server.action, event.server.type, now_ns)
        elif isinstance(event, Attend):
            self._attend(event, now_ns)
        elif isinstance(event, LaunchDue):
            self._obey(event.service, event.service.perform(event.step), now_ns)
        else:
            self._do_service(event, now_ns)

    def _note_start(self, student: NodeProcess) -> None:
        """Tell the launch file of a process that it runs now; what follows from it is done next."""
        if service := self._services_of.get(student.name):
            self._obey(service, service.started(student.name), self._time_ns())

    def _note_end(self, student: NodeProcess) -> None:
        """Tell the launch file of a process that it has ended; what follows from it is done next."""
        if service := self._services_of.get(student.name):
            self._obey(service, service.ended(student.name), self._time_ns())

    def _obey(self, service: LaunchService, orders: Iterable[Order], now_ns: int) -> None:
        for order in orders:
            match order:
                case DoLater(step):
                    self._agenda.later(LaunchDue.at(now_ns, service, step))
                case BeginNode(node):
                    self._begin_launched(service, node, now_ns)
                case StopNode(name):
                    self._stop_launched(self._named(name), now_ns)
                case KillNode(name):
                    self._kill(self._named(name))
                case TellReader(text):
                    self._recorder.note(text)

    def _begin_launched(self, service: LaunchService, node: int, now_ns: int) -> None:
        first = service.processes[node]
        name = unused_name(first, {student.name for student in self._students})
        if first in self._plan.may_exit and name != first:
            self._plan = replace(self._plan, may_exit=(*self._plan.may_exit, name))
        student = self._launches[service](service, node, name)
        service.began(node, name)
        self._services_of[name] = service
        self._students.append(student)
        self._recorder.allow_participant()
        self._agenda.starts_ns[name] = max(1, now_ns)  # it is marked as one that starts late
        self._begin_process(student, 0)

    def _stop_launched(self, student: NodeProcess, now_ns: int) -> None:
        if not (student.ended or student.stop_signalled):
            self._note_stop(student, now_ns)
            self._signal_stop(student)

    def _note_stop(self, student: NodeProcess, now_ns: int) -> None:
        """Note that a process is sent the stop signal."""
        student.stop_signalled = True
        self._recorder.add(Mark(now_ns, "stop_signal", student.name))

    def _named(self, process: str) -> NodeProcess:
        return next(student for student in self._students if student.name == process)

    def _kill(self, student: NodeProcess) -> None:
        """End a process at once."""
        if student.ended:
            return
        student.end_now()
        student.death(self._time_ns())
        student.drain()
        self._recorder.add(*student.output(self._time_ns(), final=True))
        self._lose(student)
        self._recorder.add(Mark(self._time_ns(), "stopped", student.name))
        student.ended = True
        self._note_end(student)

    def _do_service(self, event: Event, now_ns: int) -> None:
        """Execute one event of a server or client."""
        if isinstance(event, AddServer):
            self._services.add_server(now_ns, event.server)
        elif isinstance(event, RemoveServer):
            self._services.remove_server(now_ns, event.server)
        elif isinstance(event, Respond):
            if self._services.answer(now_ns, event.server, event.number):
                self._announce_exchange("response", event.server.service, 1)
        elif isinstance(event, AddClients):
            self._services.add_clients(event.calls)
        elif isinstance(event, Ask):
            if self._is_served(event.call.calls):
                self._announce_exchange("request", self._services.call(now_ns, event.call), 1)
            else:
                self._services.wait(event)  # until its server exists

    def _offer_action(self, action: str, interface: str, now_ns: int) -> None:
        """Advertise the topics of an action, and offer its services."""
        self._recorder.add(Mark(now_ns, "action_starts", f"{action} {interface}"))
        for topic, (type_, latched) in TOPICS_OF_ACTIONS.items():
            name, fields = f"{action}/_action/{topic}", {"best_effort": False, "latched": latched}
            stream = PlannedMessages(name, type_.format(interface), 0, 0, 1, 0, values=(), **fields)
            self._streams[name] = stream
            self._do(Advertise(now_ns, name, stream), now_ns)
        for part, type_ in PARTS_OF_ACTIONS.items():
            service = f"{action}/_action/{part}"
            self._parts[service] = action, part
            server = PlannedServer(service, type_.format(interface), 0, 0, 0, cycle=False, answers=0, responses=())
            self._do_service(AddServer(now_ns, server), now_ns)
        self._tell_servers()

    @abstractmethod
    def _tell_servers(self) -> None:
        """Let the processes learn of servers that came or went; on the real clock, they do so by themselves."""

    def _attend(self, event: Attend, now_ns: int) -> None:
        """Do what an action does now: respond, publish, and come back when its time has come."""
        answer = self._attended(event, now_ns)
        for part, number, content in answer["does"]:
            name = f"{event.action}/_action/{part}"
            if part in TOPICS_OF_ACTIONS:
                self._send(self._published(name, content, now_ns), now_ns)
            elif self._services.respond(now_ns, name, number, content):
                self._announce_exchange("response", name, 1)
        for wake_ns in answer["wakes_ns"]:
            self._agenda.later(Attend(max(now_ns, wake_ns), event.action))

    def _attended(self, event: Attend, now_ns: int) -> Mapping[str, Any]:
        """Return what an action does now; see `ServedAction.attend`."""
        moment = self._moment(now_ns)
        return self._actions[event.action].attend(moment, event.part, event.number, event.request)

    def _published(self, topic: str, content: Any, now_ns: int) -> Event:
        """Return the event that publishes a message of an action."""
        return PublishFields(now_ns, topic, self._streams[topic], plain_fields(content))
