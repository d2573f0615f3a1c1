"""Steps student processes and stimuli through virtual time, in lock-step, and writes down what happens.

At every instant: stimuli first, then each process that is due or has something on its way, one at a time, until nothing
is left to do at that instant. Then time jumps to the next moment at which anybody wants to do anything.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from grader.core.trace import ClockKind, Fault, Mark, Offer
from grader.execution.discovery import Discovery, announce, compatible, counts, is_claim, readers_of
from grader.execution.ending import ending
from grader.execution.exchanges import PlannedCalls
from grader.execution.observer import Observer
from grader.execution.plan import Plan
from grader.execution.runner import Runner
from grader.execution.stimuli import APPEARANCES, AddServer, Ask, Event, RemoveServer
from grader.execution.student_process import NodeProcess
from grader.execution.topic_peers import VirtualTopicPeers
from grader.execution.trace_recorder import NAME_CHARACTERS, OFFERS
from grader.execution.virtual_time_suitability import hopeless, unfit
from grader.execution.workload import Workload

#: Where the hosts' virtual time starts: 2026-01-01 00:00:00 UTC, as `grader/student_host/clock.py` has it.
EPOCH_NS = 1_767_225_600_000_000_000
#: Wake-ups of one scenario; more end it.
STEPS = 400_000
#: A process that has more to say than this before it waits or ends does not talk like the host, nor does one that says
#: that it has more endpoints and parameters.
WORDS, CLAIMS = 10_000, 1_000


class VirtualRunner(Runner):
    """Runs one plan on the virtual clock; see `Runner`."""

    clock = ClockKind.VIRTUAL

    def __init__(self, plan: Plan, students: list[NodeProcess], observer: Observer) -> None:
        super().__init__(plan, students, observer)
        self._now_ns = 0
        self._free_until_ns = 0
        self._steps = 0
        self._discovery = Discovery(students, observer, self._recorder, self._services, self._mark_dead)
        self._topics = VirtualTopicPeers(students, observer, self._recorder, self._discovery)

    def _time_ns(self) -> int:
        return self._now_ns

    def _begin(self) -> None:
        self._play(phase="before")
        for student in self._students:
            student.wake_ns = self._starts_ns.get(student.name)
            if student.wake_ns is None:
                self._step(student)

    def _last_look(self) -> int:
        if not any(s.ended for s in self._students):
            self._discovery.look(self._now_ns)  # when the endpoints of an ended process disappear is chance
        return self._now_ns

    def _unfit(self) -> str:
        return unfit(self._students, self._recorder.observations, full=bool(self._recorder.full))

    def _run_on(self) -> None:
        """Step through time until the end, or until nothing more can happen."""
        while not self._finished():
            self._settle()
            if self._now_ns >= self._end_ns:
                break
            self._now_ns = self._next_ns()

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
        """Let everything happen that happens at this instant."""
        if self._now_ns >= self._end_ns:
            return
        while self._now_ns < self._end_ns:
            self._play()
            student = self._next_student()
            if student is not None:
                self._step(student)
            elif not self._due or self._due[0].t_ns > self._now_ns:
                return

    def _next_student(self) -> NodeProcess | None:
        return next(
            (
                s
                for s in self._students
                if not s.ended and (s.arrivals or s.nudged or (s.wake_ns is not None and s.wake_ns <= self._now_ns))
            ),
            None,
        )

    def _step(self, student: NodeProcess) -> None:
        """Tell one process the time and what is on its way, and handle its report."""
        arrivals, student.arrivals, student.nudged = student.arrivals, {}, False
        if self._starts_ns.pop(student.name, 0):
            self._recorder.add(Mark(self._now_ns, "process_starts", student.name))
        self._free_until_ns = self._quiet_until(student)
        free_ns = EPOCH_NS + self._free_until_ns
        answer = {"now_ns": EPOCH_NS + self._now_ns, "free_until_ns": free_ns, "arrivals": arrivals}
        workload = student.measured(self._now_ns)
        workload.begin(self._now_ns)
        student.tell({**answer, "interrupt": True} if student.stop_signalled and not student.stopping else answer)
        student.stopping = student.stop_signalled
        self._hear(student, workload)
        self._dismiss_done()
        self._steps += 1
        hopeless_now = self._plan.stop_when_unfit and hopeless(self._students) and self._unfit()
        # A flood is wrong on every clock: it goes on to its limit, which is the same on every machine.
        if hopeless_now and not self._recorder.floods(self._now_ns):
            self._end_ns = self._now_ns
        if self._steps >= STEPS:
            self._recorder.stop(self._now_ns, f"more than {STEPS:,} wake-ups")
        self._end_if_full(self._now_ns)

    def _quiet_until(self, student: NodeProcess) -> int:
        """Return the next moment at which anything but one process wants to do something."""
        moments = [self._end_ns]
        moments += [self._due[0].t_ns] if self._due else []
        for other in self._students:
            if other is not student and not other.ended:
                moments += [self._now_ns] if other.arrivals or other.nudged else []
                moments += [other.wake_ns] if other.wake_ns is not None else []
        return max(self._now_ns, min(moments))

    def _catch_up(self, report: Mapping[str, Any]) -> None:
        """Move to the time that a process reached by itself while nothing else happened."""
        now_ns = report.get("now_ns")
        if isinstance(now_ns, int):
            self._now_ns = max(self._now_ns, min(now_ns - EPOCH_NS, self._free_until_ns))

    def _hear(self, student: NodeProcess, workload: Workload) -> None:
        """Wait until a process has nothing left to do at this instant, or has ended."""
        for _ in range(WORDS):
            report = student.report()
            kind = None if report is None else report.get("kind")
            if report is None or kind not in ("arrived", "note", "fault", "idle", "exited"):
                self._mark_dead(student)
                return
            if kind == "arrived":
                workload.arrived()
                continue
            self._catch_up(report)
            if kind == "note":
                student.note(report)
                continue
            self._write_output(student, final=kind == "exited")
            if kind == "fault":
                self._report_fault(student, report, self._now_ns)
                continue
            workload.end(counted=bool(report.get("counted")), moved=report.get("moved"))
            self._account(student, report)
            if kind == "exited":
                student.unsettled = str(report.get("unsettled", ""))
                stopped, places = student.stop_signalled, student.places
                self._end(student, ending(student.name, self._now_ns, report, self._plan, places, stopped=stopped))
                if report.get("left"):
                    self._discovery.see_off(self._now_ns)
                return
            if report.get("leaving"):
                self._hand_over()
            wake_ns = report.get("wake_ns")
            student.wake_ns = wake_ns - EPOCH_NS if isinstance(wake_ns, int) else None
            return
        self._mark_dead(student)

    def _account(self, student: NodeProcess, report: Mapping[str, Any]) -> None:
        """Take what a process has published, let it reach everybody, and match new endpoints."""
        for channel, count in counts(report.get("lost")).items():
            where = channel[:NAME_CHARACTERS]
            some = "a message" if count == 1 else f"{count:,} messages"
            self._recorder.note(f"{student.name}: {some} on {where} did not arrive in time")
        sent = counts(report.get("sent"))
        self._collect({c[6:]: n for c, n in sent.items() if c.startswith("topic ")})
        self._collect_exchanges(sent)
        self._forward(student, sent)
        endpoints = report.get("endpoints")
        if isinstance(endpoints, list) and report["kind"] == "idle":
            if len(endpoints) > CLAIMS:
                self._recorder.stop(self._now_ns, f"more than {CLAIMS:,} endpoints and parameters of {student.name}")
            student.claims, student.renewed = [c for c in endpoints[:CLAIMS] if is_claim(c)], True
            student.sees_graph = report.get("sees_graph") is True
            self._note_offers(student)
            self._discovery.match(self._now_ns)
            for due in self._services.ready(self._is_served):
                self._later(replace(due, t_ns=self._now_ns))

    def _note_offers(self, student: NodeProcess) -> None:
        """Write down the services, clients and parameters that a process has not told of before."""
        for claim in student.claims:
            offer = (claim["kind"], claim["name"][:300], claim["type"][:300])
            told = offer in student.offers or len(student.offers) >= OFFERS
            if claim["kind"] in ("service", "client", "parameter") and not told:
                student.offers.add(offer)
                self._recorder.add(Offer(self._now_ns, student.name, *offer))

    def _collect(self, sent: Mapping[str, int]) -> None:
        """Wait until everything published has been taken here, and write it down."""
        expected = Counter({topic: n for topic, n in sent.items() if self._observer.reads(topic)})
        if not expected:
            return

        def complete() -> bool:
            for message in self._observer.take():
                self._record(self._now_ns, message)
                expected[message.topic] -= 1
            return bool(self._recorder.full) or all(count <= 0 for count in expected.values())

        if not self._discovery.patience.wait(complete):
            for topic in sorted(t for t, n in expected.items() if n > 0):
                self._recorder.note(f"some messages on {topic[:NAME_CHARACTERS]} did not arrive")

    def _collect_exchanges(self, sent: Mapping[str, int]) -> None:
        """Wait until the requests and responses for the grader have been taken here, and write them down."""
        expected = self._services.expected(sent)
        if not expected:
            return

        def complete() -> bool:
            expected.subtract(self._services.take())
            return all(count <= 0 for count in expected.values())

        if not self._discovery.patience.wait(complete):
            for channel in sorted(c for c, n in expected.items() if n > 0):
                self._recorder.note(f"a {channel[:NAME_CHARACTERS]} did not arrive")
        self._services.write_down(self._now_ns)

    def _is_served(self, calls: PlannedCalls) -> bool:
        return self._discovery.is_served(calls)

    def _do(self, event: Event, now_ns: int) -> None:
        super()._do(event, now_ns)
        if isinstance(event, (AddServer, RemoveServer)):
            self._discovery.tell_all()

    def _forward(self, sender: NodeProcess, sent: Mapping[str, int]) -> None:
        """Tell every process what is on its way to it."""
        for channel, count in sorted(sent.items()):
            kind, _, name = channel.partition(" ")
            if kind == "topic":
                writers = [c for c in sender.claims if c["kind"] == "publisher" and c["name"] == name]
                for student in self._students:
                    if any(compatible(w, r) for w in writers for r in readers_of(student, name)):
                        announce(student.arrivals, channel, count)
            elif kind in ("request", "response"):
                self._announce_exchange(kind, name, count)

    def _announce_exchange(self, kind: str, service: str, count: int) -> None:
        """Tell processes of requests, or of responses, of which every client of the service gets all."""
        for student in self._students:
            ends = student.claims_of("service" if kind == "request" else "client", service)
            if not student.ended and ends:
                announce(student.arrivals, f"{kind} {service}", count)

    def _hand_over(self) -> None:
        """Have every process wait until what is on its way to it has arrived, because its sender is about to go."""
        for student in self._students:
            if student.arrivals and not student.ended and student.workload is not None:
                student.tell({"expect": student.arrivals})
                student.arrivals, student.nudged = {}, True
                answer = student.report()
                if answer is None or answer.get("kind") != "arrived":
                    self._mark_dead(student)

    def _write_output(self, student: NodeProcess, *, final: bool) -> None:
        self._recorder.add(*student.output(self._now_ns, final=final))

    def _mark_dead(self, student: NodeProcess) -> None:
        """Note the end of a process that ended without a word, and what it wrote before."""
        death = student.death(self._now_ns)
        student.drain()
        self._write_output(student, final=True)
        for message in self._observer.take_rest():
            self._record(self._now_ns, message)
        if self._services.take():
            self._services.write_down(self._now_ns)
        self._discovery.lose(student)
        self._end(student, death)

    def _end(self, student: NodeProcess, *endings: Fault | Mark) -> None:
        self._recorder.add(*endings)
        student.ended = True
        student.wake_ns = None
        student.claims = []

    def _play(self, *, phase: str = "") -> None:
        """Do what stimuli do at this instant, of calls one at a time; before the start, only what appears at once."""
        while self._due and self._due[0].t_ns <= self._now_ns:
            if phase and not isinstance(self._due[0], APPEARANCES):
                return
            due = self._due.pop(0)
            self._do(due, self._now_ns)
            if isinstance(due, Ask):
                return  # the next one follows when this one has arrived: so their order is always the same

    def _dismiss_done(self) -> None:
        """Let servers go that have given their last answer, when it has arrived."""
        for server in self._services.done():
            if not any(f"response {server.service}" in s.arrivals for s in self._students if not s.ended):
                self._do(RemoveServer(self._now_ns, server), self._now_ns)
