"""Steps student processes and stimuli through virtual time, in lock-step, and writes down what happens.

At every instant: stimuli first, then each process that is due or has something on its way, one at a time, until nothing
is left to do at that instant. Then time jumps to the next moment at which anybody wants to do anything.
"""

from __future__ import annotations

import bisect
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

from grader.model.quantities import NS_PER_S
from grader.model.trace import ClockKind, Delivery, Fault, FaultKind, GraphSnapshot, Mark, Offer, Trace
from grader.recording.claims import (
    announce,
    compatible,
    counts,
    is_claim,
    offered,
    readers_of,
    serves,
    takes_ordinary,
)
from grader.recording.desk import Desk
from grader.recording.ending import ending, never_stopped, reported_fault
from grader.recording.exchanges import PlannedCalls, PlannedMessages
from grader.recording.interfaces import built, message_class, plain_fields
from grader.recording.observer import Observer, Taken, wait_until
from grader.recording.plan import Plan
from grader.recording.stimuli import APPEARANCES, BROADCASTS, Due, number_message, numeric_field, schedule
from grader.recording.student import Student
from grader.recording.tape import NAME_CHARACTERS, OFFERS, Tape

#: Where the hosts' virtual time starts: 2026-01-01 00:00:00 UTC, as `grader/host/clock.py` has it.
EPOCH_NS = 1_767_225_600_000_000_000
#: How long, in real time, an endpoint or a message that was announced is waited for.
SETTLE_S = 5.0
#: Looking at the graph costs much: not so often that it holds up what is looked for.
GRAPH_PAUSE_S = 0.003
#: After so many messages that never came, later ones are waited for only briefly.
PATIENCE = 3
IMPATIENT_S = 0.05
#: A node that needs more processor seconds than this a virtual second is judged on the real clock.
BUSY_SHARE = 0.5
#: Beyond that share of the whole observation, and this much more, there is no need to go on in virtual time.
HOPELESS_NS = 2 * NS_PER_S
#: What a host says when its program does not settle, in words.
UNSETTLED = {
    "threads": "the node's threads wait for each other without blocking",
    "outside": "the node waits for something that is neither ROS nor time",
}
#: Processor time that a process may have used beyond what it says, as a share of virtual time and besides: looking at
#: the clock again and again is not charged, but costs something.
HIDDEN_SHARE, HIDDEN_NS = 1.0, 5 * NS_PER_S
#: Wake-ups of one scenario; more end it.
STEPS = 400_000
#: A process that has more to say than this before it waits or ends does not talk like the host, nor does one that says
#: that it has more endpoints and parameters.
WORDS, CLAIMS = 10_000, 1_000


class Conductor:
    """Runs one plan on the virtual clock.

    Args:
        plan: What to run.
        students: The started processes, each waiting to be told the time.
        observer: The grader's node.
    """

    def __init__(self, plan: Plan, students: list[Student], observer: Observer) -> None:
        self._plan = plan
        self._students = students
        self._observer = observer
        self._now_ns = 0
        self._free_until_ns = 0
        self._end_ns = plan.wait_at_most_ns if plan.first_message_on else plan.duration_ns
        self._due = schedule(plan)
        self._streams: dict[str, str] = {}
        self._fixed: dict[str, PlannedMessages] = {}
        self._tape = Tape(plan.limits)
        nodes = lambda: self._tape.graph.nodes  # noqa: E731 - it changes
        self._desk = Desk(plan, observer.services, self._tape, nodes=nodes, later=self._later)
        self._starts_ns = dict(plan.starts_ns)
        self._stop_ns = 0
        self._losses = 0
        self._steps = 0

    def run(self) -> Trace:
        """Run the plan to its end and return the trace."""
        for student in self._students:
            student.ready_ns = student.measured_ns
        self._play(phase="before")
        for student in self._students:
            student.wake_ns = self._starts_ns.get(student.name)
            if student.wake_ns is None:
                self._step(student)
        self._run_on()
        if not any(s.ended for s in self._students):
            self._look_at_graph()  # what has ended disappears from the graph at a moment that is nobody's
        self._stop_ns = self._end_ns
        unfit = self._unfit()
        if self._plan.shutdown_ns and not (unfit or self._tape.full):
            self._shut_down()
        return Trace(
            scenario=self._plan.scenario,
            clock=ClockKind.VIRTUAL,
            clock_reason=unfit,
            stop_ns=self._stop_ns,
            observations=tuple(self._tape.observations),
            notes=self._tape.notes([*self._observer.notes(), *(note for s in self._students for note in s.notes)]),
        )

    def _run_on(self) -> None:
        """Step through time until the end, or until nothing more can happen."""
        while not self._finished():
            self._settle()
            if self._now_ns >= self._end_ns:
                break
            self._now_ns = self._next_ns()

    def _shut_down(self) -> None:
        """Send every process the stop signal, as Ctrl-C does, and let time go on until all have ended."""
        self._now_ns, self._due = self._stop_ns, []
        self._end_ns = self._stop_ns + self._plan.shutdown_ns
        for student in self._students:
            if not student.ended:
                student.stop_signalled = True
                self._tape.add(Mark(self._now_ns, "stop_signal", student.name))
                self._step(student)
        self._run_on()
        for student in self._students:
            if not student.ended:
                self._tape.add(never_stopped(student.name, self._end_ns, self._plan.shutdown_ns))

    def _finished(self) -> bool:
        return all(s.ended for s in self._students) and not any(d.action in BROADCASTS for d in self._due)

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

    def _next_student(self) -> Student | None:
        return next(
            (
                s
                for s in self._students
                if not s.ended and (s.arrivals or s.nudged or (s.wake_ns is not None and s.wake_ns <= self._now_ns))
            ),
            None,
        )

    def _step(self, student: Student) -> None:
        """Tell one process the time and what is on its way, and handle its report."""
        arrivals, student.arrivals, student.nudged = student.arrivals, {}, False
        if self._starts_ns.pop(student.name, 0):
            student.ready_ns = student.measured_ns
            self._tape.add(Mark(self._now_ns, "process_starts", student.name))
        self._free_until_ns = self._quiet_until(student)
        free_ns = EPOCH_NS + self._free_until_ns
        answer = {"now_ns": EPOCH_NS + self._now_ns, "free_until_ns": free_ns, "arrivals": arrivals}
        student.tell({**answer, "interrupt": True} if student.stop_signalled and not student.stopping else answer)
        student.stopping = student.stop_signalled
        self._hear(student)
        self._dismiss_done()
        self._steps += 1
        if self._plan.stop_when_unfit and self._hopeless():
            self._end_ns = self._now_ns
        if self._steps >= STEPS:
            self._tape.stop(self._now_ns, f"more than {STEPS:,} wake-ups")
        self._end_if_full()

    def _end_if_full(self) -> None:
        if self._tape.full:
            self._end_ns = min(self._end_ns, self._now_ns)

    def _quiet_until(self, student: Student) -> int:
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

    def _hear(self, student: Student) -> None:
        """Wait until a process has nothing left to do at this instant, or has ended."""
        for _ in range(WORDS):
            report = student.report()
            kind = None if report is None else report.get("kind")
            if report is None or kind not in ("note", "fault", "idle", "exited"):
                self._bury(student)
                return
            self._catch_up(report)
            if kind == "note":
                student.note(str(report.get("text", "")))
                continue
            self._write_output(student, final=kind == "exited")
            if kind == "fault":
                self._tape.add(reported_fault(student.name, self._now_ns, report, self._plan.limits))
                continue
            self._account(student, report)
            if kind == "exited":
                student.unsettled = str(report.get("unsettled", ""))
                stopped = student.stop_signalled
                self._end(student, ending(student.name, self._now_ns, report, self._plan, stopped=stopped))
                return
            wake_ns = report.get("wake_ns")
            student.wake_ns = wake_ns - EPOCH_NS if isinstance(wake_ns, int) else None
            return
        self._bury(student)

    def _account(self, student: Student, report: Mapping[str, Any]) -> None:
        """Take what a process has published, let it reach everybody, and match new endpoints."""
        used_ns = report.get("cpu_ns")
        student.used_ns = used_ns if isinstance(used_ns, int) else student.used_ns
        for channel, count in counts(report.get("lost")).items():
            where = channel[:NAME_CHARACTERS]
            some = "a message" if count == 1 else f"{count:,} messages"
            self._tape.note(f"{student.name}: {some} on {where} did not arrive in time")
        sent = counts(report.get("sent"))
        self._collect({c[6:]: n for c, n in sent.items() if c.startswith("topic ")})
        self._collect_exchanges(sent)
        self._forward(student, sent)
        endpoints = report.get("endpoints")
        if isinstance(endpoints, list) and report["kind"] == "idle":
            if len(endpoints) > CLAIMS:
                self._tape.stop(self._now_ns, f"more than {CLAIMS:,} endpoints and parameters of {student.name}")
            student.claims = [c for c in endpoints[:CLAIMS] if is_claim(c)]
            self._note_offers(student)
            self._match()

    def _note_offers(self, student: Student) -> None:
        """Write down the services, clients and parameters that a process has not told of before."""
        for claim in student.claims:
            offer = (claim["kind"], claim["name"][:300], claim["type"][:300])
            told = offer in student.offers or len(student.offers) >= OFFERS
            if claim["kind"] in ("service", "client", "parameter") and not told:
                student.offers.add(offer)
                self._tape.add(Offer(self._now_ns, student.name, *offer))

    def _collect(self, sent: Mapping[str, int]) -> None:
        """Wait until everything published has been taken here, and write it down."""
        expected = Counter({topic: n for topic, n in sent.items() if self._readable(topic)})
        if not expected:
            return

        def complete() -> bool:
            for message in self._observer.take():
                self._record(message)
                expected[message.topic] -= 1
            return bool(self._tape.full) or all(count <= 0 for count in expected.values())

        if not wait_until(complete, SETTLE_S if self._losses < PATIENCE else IMPATIENT_S):
            self._losses += 1
            for topic in sorted(t for t, n in expected.items() if n > 0):
                self._tape.note(f"some messages on {topic[:NAME_CHARACTERS]} did not arrive")

    def _collect_exchanges(self, sent: Mapping[str, int]) -> None:
        """Wait until the requests and responses for the grader have been taken here, and write them down."""
        expected = self._desk.expected(sent)
        if not expected:
            return

        def complete() -> bool:
            expected.subtract(self._desk.take())
            return all(count <= 0 for count in expected.values())

        if not wait_until(complete, SETTLE_S if self._losses < PATIENCE else IMPATIENT_S):
            self._losses += 1
            for channel in sorted(c for c, n in expected.items() if n > 0):
                self._tape.note(f"a {channel[:NAME_CHARACTERS]} did not arrive")
        self._desk.write_down(self._now_ns)

    def _record(self, message: Taken) -> None:
        if message.topic == self._plan.first_message_on and not self._tape.seen(message.topic):
            self._end_ns = self._now_ns + self._plan.duration_ns
        self._tape.message(self._now_ns, message)

    def _readable(self, topic: str) -> bool:
        return self._observer.reads(topic)

    def _forward(self, sender: Student, sent: Mapping[str, int]) -> None:
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

    def _match(self) -> None:
        """Wait until every endpoint that the processes say they have is seen, watched and matched."""
        claims = [c for s in self._students if not s.ended for c in s.claims]
        ends = [c for c in claims if c["kind"] in ("publisher", "subscription")]
        if not wait_until(lambda: self._sees(claims), SETTLE_S, pause_s=GRAPH_PAUSE_S):
            self._tape.note("an endpoint that a node created was not seen in the graph")
        self._look_at_graph()
        unknown = self._observer.watch(self._tape.graph)
        self._tape.note(*(f"the type of {name} is not known on this machine" for name in unknown))
        writers = [c for c in ends if c["kind"] == "publisher"]
        wait_until(lambda: all(self._watched(c, writers) for c in writers), SETTLE_S)
        self._tell_all_matches()
        for due in self._desk.ready(self._is_served):
            self._later(Due(self._now_ns, due.action, due.topic, due.payload))

    def _tell_all_matches(self) -> None:
        """Have every process wait for the counterparts of its endpoints."""
        claims = [c for s in self._students if not s.ended for c in s.claims]
        for student in self._students:
            if not student.ended and student.claims:
                self._tell_matches(student, claims)

    def _sees(self, claims: list[dict[str, Any]]) -> bool:
        """Return whether the graph holds what the processes claim."""
        graph = self._graph_now()
        seen = Counter((e.kind, e.topic, e.type) for e in graph.endpoints)
        ends = [c for c in claims if c["kind"] in ("publisher", "subscription")]
        wanted = Counter((c["kind"], c["name"], c["type"]) for c in ends)
        offered = {(e.kind, e.service, e.type) for e in graph.services}
        exchanging = {(c["kind"], c["name"], c["type"]) for c in claims if c["kind"] in ("service", "client")}
        nodes = {c["name"] for c in claims if c["kind"] == "node"}
        return (
            all(seen[key] >= count for key, count in wanted.items())
            and exchanging <= offered
            and nodes <= set(graph.nodes)
        )

    def _graph_now(self) -> GraphSnapshot:
        """Return the live graph, with services where a process has said that it has any."""
        services = any(c["kind"] in ("service", "client") for s in self._students for c in s.claims)
        return self._observer.graph(self._now_ns, services=services or bool(self._tape.graph.services))

    def _is_served(self, calls: PlannedCalls) -> bool:
        """Return whether the server that some calls need is there and matched."""
        service = self._desk.resolved(calls.service)
        claims = [c for s in self._students if not s.ended for c in s.claims]
        if service is None or not any(serves(c, service, calls.type) for c in claims):
            return False
        self._desk.meet(calls)
        if wait_until(lambda: self._observer.services.met(service), SETTLE_S):
            return True
        self._tape.note(f"{service[:NAME_CHARACTERS]} was not matched in time")
        return False

    def _watched(self, claim: dict[str, Any], writers: list[dict[str, Any]]) -> bool:
        same = [
            w
            for w in writers
            if (w["name"], w["type"], w["reliable"]) == (claim["name"], claim["type"], claim["reliable"])
        ]
        matched = self._observer.publishers_matched(claim["name"], claim["type"], reliable=claim["reliable"])
        # A reader that takes best effort also matches reliable writers: it may see more than its own.
        return matched >= len(same) or not self._readable(claim["name"])

    def _tell_matches(self, student: Student, claims: list[dict[str, Any]]) -> None:
        """Have a process wait for the counterparts of its endpoints, unless it was told of as many before."""
        expected: dict[str, dict[str, list[int]]] = {}
        for claim in student.claims:
            count = self._counterparts(claim, claims)
            if count:
                expected.setdefault(claim["kind"], {}).setdefault(claim["name"], []).append(count)
        gone = sorted(student.told.get("client", {}).keys() - expected.get("client", {}).keys())
        if expected == student.told or not (expected or gone):
            return
        student.told = expected
        student.tell({"match": expected, "gone": gone})
        answer = student.report()
        if answer is None or answer.get("kind") != "matched":
            self._bury(student)
            return
        student.nudged = True  # a match is an event that a node may have a callback for
        missing = answer.get("missing")
        for name in missing[:WORDS] if isinstance(missing, list) else ():
            self._tape.note(f"{student.name}: {str(name)[:NAME_CHARACTERS]} was not matched in time")

    def _counterparts(self, claim: dict[str, Any], claims: list[dict[str, Any]]) -> int:
        kind, name = claim["kind"], claim["name"]
        if kind == "publisher":
            students = sum(compatible(claim, c) for c in claims if c["kind"] == "subscription")
            return students + sum(
                1 for key in self._observer.watching(name, claim["type"]) if claim["reliable"] or not key
            )
        if kind == "subscription":
            fixed = self._fixed.get(name)
            fits = takes_ordinary(claim) if fixed is None else compatible(offered(fixed), claim)
            stimulus = self._streams.get(name) == claim["type"] and fits
            return int(stimulus) + sum(compatible(c, claim) for c in claims if c["kind"] == "publisher")
        if kind != "client":
            return 0
        return int(
            self._desk.serves(name, claim["type"])
            or any((c["kind"], c["name"], c["type"]) == ("service", name, claim["type"]) for c in claims)
        )

    def _look_at_graph(self) -> None:
        self._tape.look(self._graph_now(), self._observer.participants())

    def _write_output(self, student: Student, *, final: bool) -> None:
        self._tape.add(*student.output(self._now_ns, final=final))

    def _bury(self, student: Student) -> None:
        """Note the end of a process that ended without a word, and what it wrote before."""
        death = student.death(self._now_ns)
        student.drain()
        self._write_output(student, final=True)
        self._end(student, death)

    def _end(self, student: Student, *endings: Fault | Mark) -> None:
        self._tape.add(*endings)
        student.ended = True
        student.wake_ns = None
        student.claims = []

    def _play(self, *, phase: str = "") -> None:
        """Do what stimuli do at this instant, of calls one at a time; before the start, only what appears at once."""
        while self._due and self._due[0].t_ns <= self._now_ns:
            if phase and self._due[0].action not in APPEARANCES:
                return
            due = self._due.pop(0)
            self._do(due)
            if due.action == "call":
                return  # the next one follows when this one has arrived: so their order is always the same

    def _later(self, due: Due) -> None:
        """Have something done at a time, after everything else that is due then."""
        bisect.insort(self._due, due, key=lambda d: d.t_ns)

    def _do(self, due: Due) -> None:
        action: dict[str, Callable[[Due], None]] = {
            "appear": self._appear,
            "offer": self._offer,
            "publish": self._publish,
            "say": self._say,
            "disappear": self._disappear,
            "serve": self._serve,
            "dismiss": self._dismiss,
            "answer": self._answer,
            "meet": self._meet,
            "call": self._call,
        }
        action[due.action](due)

    def _disappear(self, due: Due) -> None:
        self._streams.pop(due.topic, None)
        self._fixed.pop(due.topic, None)
        self._observer.withdraw(due.topic)
        self._tape.add(Mark(self._now_ns, "stream_stops", due.topic))

    def _meet(self, due: Due) -> None:
        self._desk.meet(due.payload)

    def _serve(self, due: Due) -> None:
        self._desk.serve(self._now_ns, due.payload)
        self._tell_all_matches()

    def _dismiss(self, due: Due) -> None:
        self._desk.dismiss(self._now_ns, due.payload)
        self._tell_all_matches()

    def _dismiss_done(self) -> None:
        """Let servers go that have given their last answer, when it has arrived."""
        for server in self._desk.done():
            if not any(f"response {server.service}" in s.arrivals for s in self._students if not s.ended):
                self._dismiss(Due(self._now_ns, "dismiss", server.service, server))

    def _answer(self, due: Due) -> None:
        server, number = due.payload
        if self._desk.answer(self._now_ns, server, number):
            self._announce_exchange("response", server.service, 1)

    def _call(self, due: Due) -> None:
        """Send a request, or keep it until its server is there."""
        if self._is_served(due.payload.calls):
            service = self._desk.call(self._now_ns, due.payload)
            self._announce_exchange("request", service, 1)
        else:
            self._desk.wait(due)

    def _offer(self, due: Due) -> None:
        """Create the publisher of messages of a fixed type."""
        stream = due.payload
        self._fixed[due.topic] = stream
        self._streams[due.topic] = stream.type
        self._observer.advertise(due.topic, stream.type, latched=stream.latched, best_effort=stream.best_effort)
        readers = [c for s in self._students for c in readers_of(s, due.topic) if compatible(offered(stream), c)]
        wait_until(lambda: self._observer.subscribers_matched(due.topic) >= len(readers), SETTLE_S)
        self._tell_all_matches()
        self._tape.add(Mark(self._now_ns, "stream_starts", due.topic))

    def _say(self, due: Due) -> None:
        """Publish one message of a fixed type."""
        stream, fields = due.payload
        message = built(message_class(stream.type), fields, due.topic)
        self._tape.add(Delivery(self._now_ns, due.topic, stream.type, plain_fields(message)))
        self._observer.publish(due.topic, message)
        for student in self._students:
            if any(compatible(offered(stream), c) for c in readers_of(student, due.topic)):
                announce(student.arrivals, f"topic {due.topic}", 1)

    def _appear(self, due: Due) -> None:
        """Create a stimulus's publisher, of the type and durability that the students' subscriptions ask for."""
        self._start_stream(due.topic, due.payload)
        self._tape.add(Mark(self._now_ns, "stream_starts", due.topic))

    def _start_stream(self, topic: str, default: str) -> None:
        asked = [c for s in self._students for c in readers_of(s, topic)]
        carrying = [c for c in asked if default == c["type"] or numeric_field(c["type"]) is not None]
        interface = carrying[0]["type"] if carrying and "nav_msgs" not in default else default
        latched = any(c["latched"] for c in asked if c["type"] == interface)
        self._observer.advertise(topic, interface, latched=latched)
        self._streams[topic] = interface
        readers = [c for c in asked if c["type"] == interface and takes_ordinary(c)]
        wait_until(lambda: self._observer.subscribers_matched(topic) >= len(readers), SETTLE_S)
        self._tell_all_matches()

    def _publish(self, due: Due) -> None:
        """Publish one message of a stimulus and note for whom it is on its way."""
        self._follow_type(due.topic)
        interface = self._streams[due.topic]
        if interface == "nav_msgs/msg/Odometry":
            cdr, value = due.payload
            message: Any = cdr
        else:
            message, value = number_message(interface, due.payload)
            cdr = b""
        self._tape.add(Delivery(self._now_ns, due.topic, interface, value, cdr))
        self._observer.publish(due.topic, message)
        for student in self._students:
            if any(c["type"] == interface and takes_ordinary(c) for c in readers_of(student, due.topic)):
                announce(student.arrivals, f"topic {due.topic}", 1)

    def _follow_type(self, topic: str) -> None:
        """Change a stimulus's type or durability when a student's node subscribed with another one."""
        current = self._streams[topic]
        asked = [c for s in self._students for c in readers_of(s, topic)]
        if current == "nav_msgs/msg/Odometry" or not asked or any(c["type"] == current for c in asked):
            return
        if any(numeric_field(c["type"]) is not None for c in asked):
            self._observer.withdraw(topic)
            self._start_stream(topic, current)

    def _hopeless(self) -> bool:
        """Return whether it is clear already that virtual time hides how much processor time a node needs."""
        busiest_ns = max(s.used_ns for s in self._students)
        return busiest_ns > BUSY_SHARE * self._end_ns + HOPELESS_NS or self._hides_work(self._end_ns)

    def _hides_work(self, virtual_ns: int) -> bool:
        """Return whether a process has used much more processor time than it says."""
        hidden_ns = max((s.measured_ns - s.ready_ns - s.used_ns for s in self._students), default=0)
        return hidden_ns > HIDDEN_SHARE * virtual_ns + HIDDEN_NS

    def _unfit(self) -> str:
        """Say why virtual time does not do these nodes justice, if it does not."""
        seen = self._tape.observations
        if any(isinstance(o, Fault) and o.kind is FaultKind.HUNG for o in seen):
            return next((UNSETTLED[s.unsettled] for s in self._students if s.unsettled in UNSETTLED), "")
        if self._tape.full:
            return ""
        virtual_ns = max(self._now_ns, NS_PER_S)
        busiest_ns = max((s.used_ns for s in self._students), default=0)
        if busiest_ns > BUSY_SHARE * virtual_ns or self._hides_work(virtual_ns):
            return "the node needs so much processor time that virtual time would hide it"
        return ""
