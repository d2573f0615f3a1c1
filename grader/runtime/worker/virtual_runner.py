"""Steps student processes and stimuli through virtual time, and records what happens.

At every instant, stimuli come first; then the processes that are due or have messages on their way run, one at a time,
until nothing is left to do. Then time jumps to the next moment at which a stimulus or process is due.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.scenario import Event
from grader.runtime.model.trace import ClockKind, Fault, FaultKind, Mark, Observation, Offer
from grader.runtime.plan import Plan
from grader.runtime.stimuli.calls import Ask, PlannedCalls
from grader.runtime.stimuli.server import AddServer, RemoveServer
from grader.runtime.worker.discovery import Discovery, announce, compatible, counts, is_claim, passes, readers_of
from grader.runtime.worker.ending import ending
from grader.runtime.worker.observer import Observer, Taken, in_order
from grader.runtime.worker.runner import Runner
from grader.runtime.worker.student_process import NodeProcess
from grader.runtime.worker.topic_peers import VirtualTopicPeers
from grader.runtime.worker.trace_recorder import NAME_CHARACTERS, OFFERS
from grader.runtime.worker.workload import Workload

#: The most steps at once, and how many more may come with each second of virtual time; more end the scenario. Nodes
#: that rest need far fewer: ten with timers of 100 Hz that hear each other take some thousand a second.
STEPS, STEPS_HZ = 400_000, 10_000
#: The host never sends more reports before it waits or ends, and never reports more endpoints and parameters.
MOST_REPORTS, CLAIMS = 10_000, 1_000
#: Nodes may take messages so often while none of them lets time pass. After HOPS, each time also takes as long as a
#: message needs between two processes; after MOST_HOPS they answer each other without end, and the run is over.
HOPS, HOP_NS, MOST_HOPS = 200, 250_000, 4_000
#: More messages of one report are not held back until all of them have arrived.
MOST_ARRIVED = 1_000
#: Reasons for recording on the wall clock.
THREADS = "the node's threads wait for each other without blocking"
OUTSIDE = "the node waits for something that is neither ROS nor time"
BUSY = "the node needs so much processor time that virtual time would hide it"
#: The host's codes for a program that does not settle, with their reasons.
UNSETTLED = {"threads": THREADS, "outside": OUTSIDE}


#: The end of a service of a process that says nothing about its QoS, and each of the grader's.
ORDINARY_END: Mapping[str, Any] = {}


class VirtualRunner(Runner):
    """Runs one plan on the virtual clock; see `Runner`."""

    clock = ClockKind.VIRTUAL

    def __init__(self, plan: Plan, students: list[NodeProcess], observer: Observer) -> None:
        super().__init__(plan, students, observer)
        self._now_ns = 0
        self._free_until_ns = 0
        self._steps = 0
        self._hops = 0
        self._has_lost = False
        #: When the publishers of each process, by their numbers there, have appeared.
        self._appeared_ns: dict[tuple[str, int], int] = {}
        self._discovery = Discovery(students, observer, self._recorder, self._services, self._mark_dead)
        self._topics = VirtualTopicPeers(students, observer, self._recorder, self._discovery)

    def _time_ns(self) -> int:
        return self._now_ns

    def _clock_ns(self, now_ns: int) -> int:
        return self._plan.epoch_ns + now_ns

    def _begin(self) -> None:
        self._play(phase="before")
        for student in self._students:
            student.wake_ns = self._starts_ns.get(student.name)
            if student.wake_ns is None:
                self._step(student)

    def _last_look(self) -> int:
        # Otherwise two recordings of one program would differ in their last snapshot.
        if not any(s.ended for s in self._students):
            self._discovery.look(self._now_ns)  # the endpoints of an ended process disappear at a random time
        return self._now_ns

    def _unfit(self) -> str:
        return self._graders_fault() or unfit(
            self._students, self._recorder.observations, full=bool(self._recorder.full)
        )

    def _may_drift(self) -> bool:
        drifting = any(s.workload is not None and s.workload.delay.may_drift for s in self._students)
        return drifting and not self._recorder.full

    def _is_incomplete(self) -> bool:
        return self._discovery.patience.has_lost or self._has_lost

    def _run_on(self) -> None:
        """Step through time until the end, or until nothing more can happen."""
        while not self._finished():
            self._settle()
            if self._now_ns >= self._end_ns or self._is_interrupted():
                break
            self._discovery.retry()
            if self._next_student() is None:  # a match is an event that wakes a process
                self._now_ns = self._next_ns()

    def _is_interrupted(self) -> bool:
        """Return whether to stop at an instant at which nothing is left to do."""
        return False

    def _shut_down(self) -> None:
        self._now_ns = self._stop_ns
        super()._shut_down()

    def _interrupt(self, student: NodeProcess) -> None:
        self._step(student)

    def _next_ns(self) -> int:
        moments = [self._end_ns]
        moments += [s.wake_ns for s in self._students if not s.ended and s.wake_ns is not None]
        moments += [self._due[0].t_ns] if self._due else []
        return max(self._now_ns, min(moments))

    def _settle(self) -> None:
        """Execute everything that happens at this instant."""
        if self._now_ns >= self._end_ns:
            return
        while self._now_ns < self._end_ns:
            self._play()
            student = self._next_student()
            if student is not None:
                self._step(student)
            elif not self._due or self._due[0].t_ns > self._now_ns:
                self._hops = 0
                return

    def _next_student(self) -> NodeProcess | None:
        return next(self._ready_students(), None)

    def _ready_students(self) -> Iterator[NodeProcess]:
        """Yield the processes that have something to do at this instant, in the order of the plan."""
        for s in self._students:
            if not s.ended and (s.arrivals or s.nudged or (s.wake_ns is not None and s.wake_ns <= self._now_ns)):
                yield s

    def _step(self, student: NodeProcess) -> None:
        """Let one process run: send it the time and the messages on their way, and handle its reports."""
        arrivals, student.arrivals, student.nudged = student.arrivals, {}, False
        if arrivals:
            self._count_hop()
        if self._starts_ns.pop(student.name, 0):
            self._recorder.add(Mark(self._now_ns, "process_starts", student.name))
        self._free_until_ns = self._quiet_until(student)
        free_ns = self._plan.epoch_ns + self._free_until_ns
        answer = {"now_ns": self._plan.epoch_ns + self._now_ns, "free_until_ns": free_ns, "arrivals": arrivals}
        workload = student.measured(self._now_ns)
        workload.begin(self._now_ns, arrivals=bool(arrivals))
        student.tell({**answer, "interrupt": True} if student.stop_signalled and not student.stopping else answer)
        student.stopping = student.stop_signalled
        self._hear(student, workload)
        self._remove_done()
        self._steps += 1
        # A flood is wrong on every clock. It runs until its limit, which is the same on every machine.
        if self._plan.stop_when_unfit and hopeless([student]) and self._unfit() and not self._floods():
            self._end_ns = self._now_ns
        most = STEPS + STEPS_HZ * self._now_ns // NS_PER_S
        if self._steps >= most:
            self._recorder.stop(self._now_ns, f"more than {most:,} wake-ups")
        self._end_if_full(self._now_ns)

    def _floods(self) -> bool:
        return self._hops > HOPS or self._recorder.floods(self._now_ns)

    def _count_hop(self) -> None:
        """Note that a process takes messages, which takes time if the nodes have not rested for long."""
        self._hops += 1
        if self._hops > HOPS:
            self._now_ns = min(self._now_ns + HOP_NS, self._end_ns)
        if self._hops > MOST_HOPS:
            self._recorder.stop(self._now_ns, f"the nodes answered each other {MOST_HOPS:,} times without a pause")

    def _quiet_until(self, student: NodeProcess) -> int:
        """Return the next moment at which a stimulus or any other process is due."""
        moments = [self._end_ns]
        moments += [self._due[0].t_ns] if self._due else []
        for other in self._students:
            if other is not student and not other.ended:
                moments += [self._now_ns] if other.arrivals or other.nudged else []
                moments += [other.wake_ns] if other.wake_ns is not None else []
        return max(self._now_ns, min(moments))

    def _catch_up(self, report: Mapping[str, Any]) -> None:
        """Adopt the time that a process has reached on its own."""
        now_ns = report.get("now_ns")
        if isinstance(now_ns, int) and min(now_ns - self._plan.epoch_ns, self._free_until_ns) > self._now_ns:
            self._now_ns = min(now_ns - self._plan.epoch_ns, self._free_until_ns)
            self._hops = 0  # it has rested

    def _hear(self, student: NodeProcess, workload: Workload) -> None:
        """Handle reports until a process has nothing left to do at this instant, or has ended."""
        began_ns = self._now_ns
        for _ in range(MOST_REPORTS):
            report = student.report()
            kind = None if report is None else report.get("kind")
            # What the host never sends comes from the program, which then speaks for it.
            if report is None or kind not in ("arrived", "note", "fault", "idle", "exited"):
                self._mark_dead(student)
                return
            if kind == "arrived":
                workload.arrived()
                continue
            # Before anything is recorded: the process may have let time pass on its own.
            self._catch_up(report)
            if kind == "note":
                student.note(report)
                continue
            self._write_output(student, final=kind == "exited")
            if kind == "fault":
                self._report_fault(student, report, self._now_ns)
                continue
            # Before the messages are collected: waiting for them is the grader's time, not the program's.
            workload.end(report, self._now_ns - began_ns)
            student.leaving = report.get("leaving") is True
            self._account(student, report)
            if kind == "exited":
                student.unsettled = str(report.get("unsettled", ""))
                student.exit_code = code if type(code := report.get("code")) is int else None
                stopped, places = student.stop_signalled, student.places
                self._end(student, ending(student.name, self._now_ns, report, self._plan, places, stopped=stopped))
                if report.get("left"):
                    self._discovery.await_departure(self._now_ns)
                return
            if student.leaving:
                self._hand_over()
            wake_ns = report.get("wake_ns")
            student.wake_ns = wake_ns - self._plan.epoch_ns if isinstance(wake_ns, int) else None
            return
        self._mark_dead(student)

    def _account(self, student: NodeProcess, report: Mapping[str, Any]) -> None:
        """Take what a process has published, announce it to the receivers, and match new endpoints."""
        for channel, count in counts(report.get("lost")).items():
            where = channel[:NAME_CHARACTERS]
            some = "a message" if count == 1 else f"{count:,} messages"
            self._recorder.note(f"{student.name}: {some} on {where} did not arrive in time")
            self._has_lost = True
        if sent := counts(report.get("sent")):
            early = _of_topics(counts(report.get("early")))
            # In this order: recorded, then announced. A process that answers an announcement must not be recorded
            # before what it answers.
            self._collect(_of_topics(sent), {t: n for t, n in early.items() if self._is_new(student, t)})
            self._collect_exchanges(student, sent)
            self._forward(student, sent)
        endpoints = report.get("endpoints")
        if isinstance(endpoints, list) and report["kind"] == "idle":
            if len(endpoints) > CLAIMS:
                self._recorder.stop(self._now_ns, f"more than {CLAIMS:,} endpoints and parameters of {student.name}")
            # Replaced as a whole: the host reports all of its endpoints each time.
            student.claims, student.renewed = [c for c in endpoints[:CLAIMS] if is_claim(c)], True
            student.sees_graph = report.get("sees_graph") is True
            for claim in student.claims:
                if claim["kind"] == "publisher":
                    self._appeared_ns.setdefault((student.name, claim.get("number", 0)), self._now_ns)
            self._note_offers(student)
            self._discovery.match(self._now_ns)
            # A new endpoint may be the server that a call has waited for.
            for due in self._services.ready(self._is_served):
                self._later(replace(due, t_ns=self._now_ns))

    def _note_offers(self, student: NodeProcess) -> None:
        """Record the services, clients and parameters that a process reports for the first time."""
        for claim in student.claims:
            offer = (claim["kind"], claim["name"][:300], claim["type"][:300])
            told = offer in student.offers or len(student.offers) >= OFFERS
            if claim["kind"] in ("service", "client", "parameter") and not told:
                student.offers.add(offer)
                self._recorder.add(Offer(self._now_ns, student.name, *offer))

    def _is_new(self, student: NodeProcess, topic: str) -> bool:
        """Return whether a process has a publisher on a topic that has appeared at this instant."""
        publishers = (c for c in student.claims if c["kind"] == "publisher" and c["name"] == topic)
        return any(self._appeared_ns.get((student.name, c.get("number", 0))) == self._now_ns for c in publishers)

    def _collect(self, sent: Mapping[str, int], early: Mapping[str, int]) -> None:
        """Wait until the observer has taken all published messages, and record them.

        Args:
            sent: How many messages a process has published on each topic.
            early: How many of them, the first ones, it has sent before any subscription could have discovered it.
        """
        expected = Counter({topic: n for topic, n in sent.items() if self._observer.reads(topic)})
        if not expected:
            return
        arrived: list[Taken] = []
        first = Counter(early)

        def complete() -> bool:
            taken = self._observer.take()
            arrived.extend(taken)
            expected.subtract(message.topic for message in taken)
            # A flood is recorded as it comes, so that the limit of the recording can end it.
            if len(arrived) > MOST_ARRIVED:
                record_arrived()
            return bool(self._recorder.full) or all(count <= 0 for count in expected.values())

        def record_arrived() -> None:
            # By topic: whose messages arrive first is up to the middleware, and differs from run to run.
            for message in in_order(arrived):
                self._record(self._now_ns, message, early=first[message.topic] > 0)
                first[message.topic] -= 1
            arrived.clear()

        in_time = self._discovery.patience.wait(complete)
        record_arrived()
        if not in_time:
            for topic in sorted(t for t, n in expected.items() if n > 0):
                self._recorder.note(f"some messages on {topic[:NAME_CHARACTERS]} did not arrive")

    def _collect_exchanges(self, sender: NodeProcess, sent: Mapping[str, int]) -> None:
        """Wait until all requests and responses for the grader have been taken, and record them."""
        reaching = {c: n for c, n in sent.items() if any(passes(end, ORDINARY_END) for end in _senders(sender, c))}
        expected = self._services.expected(reaching)
        if not expected:
            return

        def complete() -> bool:
            expected.subtract(self._services.take())
            return all(count <= 0 for count in expected.values())

        if not self._discovery.patience.wait(complete):
            for channel in sorted(c for c, n in expected.items() if n > 0):
                self._recorder.note(f"a {channel[:NAME_CHARACTERS]} did not arrive")
        self._services.record(self._now_ns)

    def _is_served(self, calls: PlannedCalls) -> bool:
        return self._discovery.is_served(calls)

    def _do(self, event: Event, now_ns: int) -> None:
        super()._do(event, now_ns)
        if isinstance(event, (AddServer, RemoveServer)):
            self._discovery.tell_all()

    def _forward(self, sender: NodeProcess, sent: Mapping[str, int]) -> None:
        """Announce sent messages to every process that receives them."""
        for channel, count in sorted(sent.items()):
            kind, _, name = channel.partition(" ")
            if kind == "topic":
                writers = [c for c in sender.claims if c["kind"] == "publisher" and c["name"] == name]
                self._discovery.kept[sender.name, name] += count if any(w["latched"] for w in writers) else 0
                for student in self._students:
                    if any(compatible(w, r) for w in writers for r in readers_of(student, name)):
                        announce(student, channel, count)
            elif kind in ("request", "response"):
                self._announce_exchange(kind, name, count, _senders(sender, channel))

    def _announce_exchange(
        self, kind: str, service: str, count: int, senders: Sequence[Mapping[str, Any]] = (ORDINARY_END,)
    ) -> None:
        """Announce requests to servers, or responses to clients: every client of a service receives all responses."""
        for student in self._students:
            ends = student.claims_of("service" if kind == "request" else "client", service)
            if not student.ended and any(passes(sender, end) for sender in senders for end in ends):
                announce(student, f"{kind} {service}", count)

    def _hand_over(self) -> None:
        """Make every process wait for the messages on their way to it, because their sender is about to leave."""
        for student in self._students:
            if student.arrivals and not student.ended and student.workload is not None:
                expected, student.arrivals, student.nudged = student.arrivals, {}, True
                with student.workload.beside():
                    student.tell({"expect": expected})
                    answer = student.report()
                if answer is None or answer.get("kind") != "arrived":
                    self._mark_dead(student)

    def _write_output(self, student: NodeProcess, *, final: bool) -> None:
        self._recorder.add(*student.output(self._now_ns, final=final))

    def _mark_dead(self, student: NodeProcess) -> None:
        """Record the end of a process that died or stopped reporting, with its last output and messages."""
        death = student.death(self._now_ns)
        student.drain()
        self._write_output(student, final=True)
        for message in self._observer.take_rest():
            self._record(self._now_ns, message)
        if self._services.take():
            self._services.record(self._now_ns)
        self._discovery.lose(student)
        self._end(student, death)

    def _end(self, student: NodeProcess, *endings: Fault | Mark) -> None:
        self._recorder.add(*endings)
        student.ended = True
        student.wake_ns = None
        student.claims = []

    def _play(self, *, phase: str = "") -> None:
        """Execute the stimuli that are due; return after each call. In phase `before`, stop at the first message."""
        while self._due and self._due[0].t_ns <= self._now_ns:
            if phase and not self._due[0].creates:
                return
            due = self._due.pop(0)
            self._do(due, self._now_ns)
            if isinstance(due, Ask):
                return  # the next call follows after this one has arrived, so that their order is always the same

    def _remove_done(self) -> None:
        """Remove the servers that have given their last answer, once it has arrived."""
        for server in self._services.done():
            if not any(f"response {server.service}" in s.arrivals for s in self._students if not s.ended):
                self._do(RemoveServer(self._now_ns, server), self._now_ns)


def _of_topics(counted: Mapping[str, int]) -> dict[str, int]:
    """Return the counts of topics by their names, without those of services."""
    return {channel[6:]: count for channel, count in counted.items() if channel.startswith("topic ")}


def _senders(process: NodeProcess, channel: str) -> Sequence[Mapping[str, Any]]:
    """Return the ends of a service with which a process sends on a channel."""
    kind, _, service = channel.partition(" ")
    return process.claims_of("client" if kind == "request" else "service", service) or (ORDINARY_END,)


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
    hiding = [s.workload for s in students if s.workload is not None and s.workload.delay.hides]
    if not hiding:
        return ""
    return OUTSIDE if any(workload.waited_ns > workload.used_ns for workload in hiding) else BUSY


def _with_place(reason: str, fault: Fault | None) -> str:
    """Return a reason with what a process did, and the line at which it did it."""
    if fault is None:
        return reason
    place = f"{fault.file}:{fault.line}" if fault.file and fault.line else fault.process
    return f"{reason}: {place} {fault.text}"
