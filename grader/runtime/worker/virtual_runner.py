"""Runs a plan in virtual time: carries out what the core decides, and tells it what the processes report."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from typing import ClassVar

from grader.runtime.host.originals import wait_until
from grader.runtime.host.protocol import (
    MOST_CLAIMS,
    Exited,
    Expect,
    Go,
    Idle,
    MessagesArrived,
    Note,
    Progress,
    ThreadFault,
)
from grader.runtime.model.scenario import Event
from grader.runtime.model.trace import ClockKind, Fault, FaultKind, Mark, Observation
from grader.runtime.patience import Wait
from grader.runtime.plan import Plan
from grader.runtime.stimuli.calls import PlannedCalls
from grader.runtime.stimuli.server import AddServer, RemoveServer
from grader.runtime.worker.claims import ORDINARY_END, passes
from grader.runtime.worker.core import (
    Arriving,
    Command,
    Core,
    LeaseEnds,
    Limit,
    Play,
    Receive,
    Retry,
    RunProcess,
    Taken,
    senders,
)
from grader.runtime.worker.discovery import Discovery
from grader.runtime.worker.ending import ending
from grader.runtime.worker.observer import Observer
from grader.runtime.worker.runner import Runner
from grader.runtime.worker.student_process import NodeProcess
from grader.runtime.worker.topic_peers import VirtualTopicPeers
from grader.runtime.worker.trace_recorder import NAME_CHARACTERS
from grader.runtime.worker.workload import Workload

#: The host never sends more reports before it waits or ends.
MOST_REPORTS = 10_000
#: Reasons for recording on the wall clock.
THREADS = "the node's threads wait for each other without blocking"
OUTSIDE = "the node waits for something that is neither ROS nor time"
BUSY = "the node needs so much processor time that virtual time would hide it"
#: The host's codes for a program that does not settle, with their reasons.
UNSETTLED = {"threads": THREADS, "outside": OUTSIDE}


class VirtualRunner(Runner):
    """Runs one plan on the virtual clock; see `Runner`.

    Args:
        plan: What to run.
        students: The started processes, each waiting for its first answer.
        observer: The grader's node.
        wait: How to wait, in real time, for discovery and for messages.
    """

    clock = ClockKind.VIRTUAL
    #: Whether somebody looks at the graph when all processes have ended.
    goes_on: ClassVar[bool] = False

    def __init__(self, plan: Plan, students: list[NodeProcess], observer: Observer, *, wait: Wait = wait_until) -> None:
        super().__init__(plan, students, observer)
        self._core = self._make_core()
        self._has_lost = False
        self._discovery = Discovery(self._core, observer, self._recorder, self._services, self._mark_dead, wait=wait)
        self._topics = VirtualTopicPeers(students, observer, self._recorder, self._discovery)

    def _make_core(self) -> Core[NodeProcess]:
        return Core(self._students, self._agenda)

    def _time_ns(self) -> int:
        return self._core.now_ns

    def _clock_ns(self, now_ns: int) -> int:
        return self._plan.epoch_ns + now_ns

    def _carry_out(self, commands: Iterable[Command[NodeProcess]]) -> None:
        for command in commands:
            match command:
                case RunProcess():
                    self._step(command)
                case Play():
                    self._do(command.event, self._core.now_ns)
                case Receive():
                    self._receive(command)
                case Retry():
                    self._discovery.retry()
                case Limit():
                    self._recorder.stop(self._core.now_ns, command.why)

    def _begin(self) -> None:
        self._carry_out(self._core.begin())

    def _run_on(self) -> None:
        self._carry_out(self._core.run_on())

    def _last_look(self) -> int:
        self._discovery.look(self._core.now_ns)
        return self._core.now_ns

    def _unfit(self) -> str:
        return self._graders_fault() or unfit(
            self._students, self._recorder.observations, full=bool(self._recorder.full)
        )

    def _may_drift(self) -> bool:
        drifting = any(s.workload is not None and s.workload.delay.may_drift for s in self._students)
        return drifting and not self._recorder.full

    def _is_incomplete(self) -> bool:
        return self._discovery.patience.has_lost or self._has_lost

    def _shut_down(self) -> None:
        self._core.now_ns = self._stop_ns
        super()._shut_down()

    def _interrupt(self, student: NodeProcess) -> None:
        self._carry_out(self._core.run(student))

    def _signal_stop(self, student: NodeProcess) -> None:
        student.nudged = True

    def _begin_process(self, student: NodeProcess, delay_ns: int) -> None:
        self._core.waits(student, self._core.now_ns + delay_ns)

    def _lose(self, student: NodeProcess) -> None:
        self._discovery.lose(student)
        self._core.ended(student)

    def _step(self, run: RunProcess[NodeProcess]) -> None:
        """Send a process the time and the messages on their way to it, and handle its reports."""
        student, now_ns, epoch_ns = run.process, self._core.now_ns, self._plan.epoch_ns
        if run.starts:
            self._recorder.add(Mark(now_ns, "process_starts", student.name))
        free_ns = epoch_ns + run.free_until_ns
        workload = student.measured(now_ns)
        workload.begin(now_ns, arrivals=bool(run.arrivals))
        interrupt = student.stop_signalled and not student.stopping
        released, student.released = student.released, {}
        order = self._core.step if self._draws() else None
        student.tell(Go(epoch_ns + now_ns, free_ns, run.arrivals, interrupt, released, order))
        student.stopping = student.stop_signalled
        self._note_start(student)
        self._hear(student, workload)
        self._remove_done()
        # A flood is wrong on every clock. It runs until its limit, which is the same on every machine.
        if self._plan.stop_when_unfit and hopeless([student]) and self._unfit() and not self._floods():
            self._agenda.end_ns = self._core.now_ns
        self._end_if_full(self._core.now_ns)

    def _draws(self) -> bool:
        """Return whether the order of callbacks is drawn in this step."""
        return False

    def _floods(self) -> bool:
        return self._core.is_restless or self._recorder.floods(self._core.now_ns)

    def _hear(self, student: NodeProcess, workload: Workload) -> None:
        """Handle reports until a process has nothing left to do at this instant, or has ended."""
        began_ns = self._core.now_ns
        for _ in range(MOST_REPORTS):
            report = student.report()
            if isinstance(report, MessagesArrived):
                workload.arrived()
            elif isinstance(report, Note):
                student.note(report)
            elif isinstance(report, ThreadFault):
                self._write_output(student, final=False)
                self._report_fault(student, report, self._core.now_ns)
            elif isinstance(report, (Idle, Exited)):
                self._rest(student, report, workload, began_ns)
                return
            else:
                # What the host never sends comes from the program, which then speaks for it.
                self._mark_dead(student)
                return
        self._mark_dead(student)

    def _rest(self, student: NodeProcess, report: Idle | Exited, workload: Workload, began_ns: int) -> None:
        """Handle the last report of a process at this instant."""
        now_ns, is_over = report.progress.now_ns, isinstance(report, Exited)
        # Before anything is recorded: the process may have let time pass on its own.
        if now_ns is not None:
            self._core.reached(now_ns - self._plan.epoch_ns)
        self._write_output(student, final=is_over)
        # Before the messages are collected: waiting for them is the grader's time, not the program's.
        workload.end(report.progress, self._core.now_ns - began_ns)
        student.leaving = isinstance(report, Idle) and report.leaving
        self._account(student, report.progress, is_over=is_over)
        if isinstance(report, Exited):
            student.unsettled, student.exit_code = report.unsettled, report.code
            stopped, places = student.stop_signalled, student.places
            if not report.left:
                self._discovery.lose(student)
            self._end(student, ending(student.name, self._core.now_ns, report, self._plan, places, stopped=stopped))
            if report.left and (self.goes_on or any(not one.ended for one in self._students)):
                self._discovery.await_departure(self._core.now_ns)
            return
        if student.leaving:
            self._carry_out(self._core.hand_over())
        self._core.waits(student, None if report.wake_ns is None else report.wake_ns - self._plan.epoch_ns)

    def _account(self, student: NodeProcess, progress: Progress, *, is_over: bool) -> None:
        """Take what a process has published, announce it to the receivers, and match new endpoints."""
        for channel, count in progress.lost.items():
            where = channel[:NAME_CHARACTERS]
            some = "a message" if count == 1 else f"{count:,} messages"
            self._recorder.note(f"{student.name}: {some} on {where} did not arrive in time")
            self._has_lost = True
        if sent := progress.sent:
            early = _of_topics(progress.early)
            # In this order: recorded, then announced. A process that answers an announcement must not be recorded
            # before what it answers.
            self._collect(_of_topics(sent), {t: n for t, n in early.items() if self._core.is_new(student, t)})
            self._collect_exchanges(student, sent)
            self._core.sent(student, sent)
        if progress.endpoints is not None and not is_over:
            if len(progress.endpoints) > MOST_CLAIMS:
                why = f"more than {MOST_CLAIMS:,} endpoints and parameters of {student.name}"
                self._recorder.stop(self._core.now_ns, why)
                # Nothing is recorded after this, and waiting until all of them are seen takes half a minute.
                return
            self._core.has(student, [claim for claim in progress.endpoints if claim is not None])
            student.sees_graph = progress.sees_graph
            self._note_offers(student, student.claims, self._core.now_ns)
            self._discovery.match(self._core.now_ns)
            self._discovery.note_participants(student)
            # A new endpoint may be the server that a call has waited for.
            for due in self._services.ready(self._is_served):
                self._agenda.later(replace(due, t_ns=self._core.now_ns))

    def _collect(self, sent: Mapping[str, int], early: Mapping[str, int]) -> None:
        """Wait until the observer has taken all published messages, and record them.

        Args:
            sent: How many messages a process has published on each topic.
            early: How many of them, the first ones, it has sent before any subscription could have discovered it.
        """
        expected = {topic: n for topic, n in sent.items() if self._observer.reads(topic)}
        if not expected:
            return
        arriving = Arriving(expected, early)

        def complete() -> bool:
            self._record_each(arriving.take(self._observer.take()))
            return bool(self._recorder.full) or not arriving.missing

        in_time = self._discovery.patience.wait(complete)
        self._record_each(arriving.held())
        if not in_time:
            for topic in arriving.missing:
                self._recorder.note(f"some messages on {topic[:NAME_CHARACTERS]} did not arrive")

    def _record_each(self, messages: Iterable[tuple[Taken, bool]]) -> None:
        for message, early in messages:
            self._record(self._core.now_ns, message, early=early)

    def _collect_exchanges(self, sender: NodeProcess, sent: Mapping[str, int]) -> None:
        """Wait until all requests and responses for the grader have been taken, and record them."""
        reaching = {c: n for c, n in sent.items() if any(passes(end, ORDINARY_END) for end in senders(sender, c))}
        expected = self._services.expected(reaching)
        if not expected:
            return

        def complete() -> bool:
            expected.subtract(self._services.take())
            return all(count <= 0 for count in expected.values())

        if not self._discovery.patience.wait(complete):
            for channel in sorted(c for c, n in expected.items() if n > 0):
                self._recorder.note(f"a {channel[:NAME_CHARACTERS]} did not arrive")
        self._services.record(self._core.now_ns)

    def _is_served(self, calls: PlannedCalls) -> bool:
        return self._discovery.is_served(calls)

    def _do(self, event: Event, now_ns: int) -> None:
        if isinstance(event, LeaseEnds):
            self._discovery.end_lease(event.remains)
            return
        super()._do(event, now_ns)
        if isinstance(event, (AddServer, RemoveServer)):
            self._tell_servers()

    def _tell_servers(self) -> None:
        # Of an action only once all of it is there: a client waits for each of its services and topics.
        self._discovery.tell_all()

    def _announce_exchange(self, kind: str, service: str, count: int) -> None:
        self._core.exchanged(kind, service, count)

    def _receive(self, receive: Receive[NodeProcess]) -> None:
        """Make a process wait for the messages on their way to it, because their sender is about to leave."""
        student = receive.process
        with nullcontext() if student.workload is None else student.workload.beside():
            student.tell(Expect(receive.arrivals))
            answer = student.report()
        if not isinstance(answer, MessagesArrived):
            self._mark_dead(student)

    def _write_output(self, student: NodeProcess, *, final: bool) -> None:
        self._recorder.add(*student.output(self._core.now_ns, final=final))

    def _mark_dead(self, student: NodeProcess) -> None:
        """Record the end of a process that died or stopped reporting, with its last output and messages."""
        death = student.death(self._core.now_ns)
        student.drain()
        self._write_output(student, final=True)
        for message in self._observer.take_rest():
            self._record(self._core.now_ns, message)
        if self._services.take():
            self._services.record(self._core.now_ns)
        self._discovery.lose(student)
        self._end(student, death)

    def _end(self, student: NodeProcess, *endings: Fault | Mark) -> None:
        self._recorder.add(*endings)
        self._core.ended(student)
        self._note_end(student)

    def _remove_done(self) -> None:
        """Remove the servers that have given their last answer, once it has arrived."""
        for server in self._services.done():
            if not self._core.is_on_its_way(f"response {server.service}"):
                self._do(RemoveServer(self._core.now_ns, server), self._core.now_ns)


def _of_topics(counted: Mapping[str, int]) -> dict[str, int]:
    """Return the counts of topics by their names, without those of services."""
    return {channel[6:]: count for channel, count in counted.items() if channel.startswith("topic ")}


def hopeless(students: Sequence[NodeProcess]) -> bool:
    """Return whether it is already certain that virtual time hides how late a node would be."""
    return any(student.workload is not None and student.workload.delay.hopeless for student in students)


def unfit(students: Sequence[NodeProcess], seen: Sequence[Observation], *, full: bool) -> str:
    """Return why virtual time is not suitable for these nodes; empty if it is.

    Args:
        students: The processes.
        seen: The observations.
        full: Whether a limit has ended the recording.
    """
    hung = {o.process: o for o in seen if isinstance(o, Fault) and o.kind is FaultKind.HUNG}
    if hung:
        unsettled = [s for s in students if s.unsettled in UNSETTLED]
        return next((_with_place(UNSETTLED[s.unsettled], hung.get(s.name)) for s in unsettled), "")
    if full:
        return ""
    hiding = [(s.name, s.workload) for s in students if s.workload is not None and s.workload.delay.hides]
    if not hiding:
        return ""
    waiting = [name for name, workload in hiding if workload.waited_ns > workload.used_ns]
    reason = OUTSIDE if waiting else BUSY
    # Of several programs, people have to know which one it is.
    return reason if len(students) == 1 else f"{(waiting or [name for name, _ in hiding])[0]}: {reason}"


def _with_place(reason: str, fault: Fault | None) -> str:
    """Return a reason with what a process did, and the line at which it did it."""
    if fault is None:
        return reason
    place = f"{fault.file}:{fault.line}" if fault.file and fault.line else fault.process
    return f"{reason}: {place} {fault.text}"
