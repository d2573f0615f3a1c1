"""Decides what happens next in a run in virtual time, and does none of it: it is told events and answers with commands.

It holds the time, the processes and the events that are due. A runner tells it what a process has reported, carries out
its commands, and keeps everything that touches the world to itself: sockets, ROS, waiting. The rules are numbered in
docs/explanation/rules.md.
"""

from __future__ import annotations

import bisect
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from typing import Any, Generic, NamedTuple, TypeAlias, TypeVar

from grader.runtime.host.protocol import NO_COUNTERPARTS, Claim, Counterparts
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.scenario import Event
from grader.runtime.stimuli.calls import Ask
from grader.runtime.stimuli.events import TopicEvent
from grader.runtime.stimuli.simulation import Step
from grader.runtime.worker.claims import ORDINARY_END, claims_of, compatible, ends_of_kind, passes, readers_of
from grader.runtime.worker.launch_service import LaunchDue

#: The most steps at once, and how many more may come with each second of virtual time; more end the scenario. Nodes
#: that rest need far fewer: ten with timers of 100 Hz that hear each other take some thousand a second.
STEPS, STEPS_HZ = 400_000, 10_000
#: Nodes may take messages so often while none of them lets time pass. After HOPS, each time also takes as long as a
#: message needs between two processes; after MOST_HOPS they answer each other without end, and the run is over.
HOPS, HOP_NS, MOST_HOPS = 200, 250_000, 4_000
#: How long a participant that gives no sign of life stays in the graph: Fast DDS's own lease, from the last sign.
LEASE_NS = 20 * NS_PER_S
#: More messages of one report are not held back until all of them have arrived.
MOST_ARRIVED = 1_000


@dataclass
class Process:
    """What virtual time knows of a student's process.

    Attributes:
        name: The wanted file name, which identifies the process in traces.
        resumes_ns: Until when it does not run, whatever arrives.
        released: Messages that it holds and that arrive with its next step, by channel.
        wake_ns: When it next wants to run, in nanoseconds of virtual time, or None.
        claims: Its endpoints, as it reports them.
        told: The counterparts that it has to wait for.
        renewed: Whether it has reported its endpoints since then.
        sees_graph: Whether its program queries the graph, as it reports.
        arrivals: Messages that are on their way to it and not yet announced to it, by channel.
        unmatched: The channels of its endpoints that had too few counterparts when the wait for them timed out.
        nudged: Whether it has to run again at this instant, because its endpoints were matched.
        leaving: Whether it waits until what it has sent has arrived, before it tells which endpoints it removes.
        ended: Whether it has ended.
    """

    name: str
    resumes_ns: int = field(default=0, kw_only=True)
    released: dict[str, int] = field(default_factory=dict, kw_only=True)
    wake_ns: int | None = field(default=None, kw_only=True)
    claims: list[Claim] = field(default_factory=list, kw_only=True)
    told: Counterparts = field(default=NO_COUNTERPARTS, kw_only=True)
    renewed: bool = field(default=False, kw_only=True)
    sees_graph: bool = field(default=False, kw_only=True)
    arrivals: dict[str, int] = field(default_factory=dict, kw_only=True)
    unmatched: frozenset[str] = field(default=frozenset(), kw_only=True)
    nudged: bool = field(default=False, kw_only=True)
    leaving: bool = field(default=False, kw_only=True)
    ended: bool = field(default=False, kw_only=True)


P = TypeVar("P", bound=Process)


@dataclass(frozen=True, slots=True)
class Remains:
    """What a process that ended without a farewell leaves in the graph, until the lease of its participants ends.

    Attributes:
        name: The name of the process.
        claims: Its endpoints.
        died_ns: When it ended.
        witnesses: The processes that have known its endpoints. Whoever joins the graph later never hears of them,
            because nobody announces them any more.
    """

    name: str
    claims: list[Claim]
    died_ns: int
    witnesses: frozenset[str]

    @property
    def gone_ns(self) -> int:
        """When its participants leave the graph."""
        return self.died_ns + LEASE_NS


@dataclass(frozen=True, slots=True)
class LeaseEnds(Event):
    """The lease of a participant ends that gives no sign of life any more, or that of the liveliness of a publisher."""

    remains: Remains


@dataclass(frozen=True, slots=True)
class Play:
    """Execute an event of a stimulus, which is due."""

    event: Event


class RunProcess(NamedTuple, Generic[P]):
    """Let a process run until it has nothing left to do at this instant, and handle what it reports meanwhile.

    Attributes:
        process: The process.
        free_until_ns: Before this moment it may let time pass on its own.
        arrivals: How many messages are on their way to it, by channel.
        starts: Whether it is one that starts late, and starts now.
    """

    process: P
    free_until_ns: int
    arrivals: Mapping[str, int]
    starts: bool


@dataclass(frozen=True, slots=True)
class Receive(Generic[P]):
    """Make a process wait for messages that are on their way to it, because their sender is about to leave."""

    process: P
    arrivals: Mapping[str, int]


@dataclass(frozen=True, slots=True)
class Retry:
    """Wait once more for the counterparts that a process has missed: nothing else is left to do at this instant."""


@dataclass(frozen=True, slots=True)
class Limit:
    """End the recording, because a limit was reached: why, as a phrase."""

    why: str


Command: TypeAlias = Play | RunProcess[P] | Receive[P] | Retry | Limit


@dataclass(frozen=True, slots=True)
class Taken:
    """One received message: topic, type, bytes and decoded fields."""

    topic: str
    type: str
    cdr: bytes
    value: Mapping[str, Any]
    sent_ns: int = 0  # when it was sent, by the system clock; 0 if that is not known
    arrived_ns: int = 0  # when the middleware received it in this process, likewise


def in_order(messages: Iterable[Taken]) -> list[Taken]:
    """Sort messages of one instant by topic and type, because which topic's arrive first is up to the middleware."""
    return sorted(messages, key=lambda taken: (taken.topic, taken.type))


class Agenda:
    """The events and the processes that are still to come, and the end of the run; the same on both clocks.

    Attributes:
        due: The events, in order.
        starts_ns: When each process that starts late is to start, by its name.
        end_ns: When the run ends; what happens then does not belong to it.
    """

    def __init__(self, due: Iterable[Event], starts_ns: dict[str, int], end_ns: int) -> None:
        self.due = list(due)
        self.starts_ns = starts_ns
        self.end_ns = end_ns

    def later(self, event: Event) -> None:
        """Schedule an event, after all others that are due at the same time."""
        # To the right of what is due at the same time: causes before effects.
        bisect.insort(self.due, event, key=lambda e: e.t_ns)

    def is_due(self, now_ns: int) -> bool:
        """Return whether an event is due."""
        return bool(self.due) and self.due[0].t_ns <= now_ns

    def moments(self, before_end_ns: int = 0) -> list[int]:
        """Return when the next event is due, and when the run ends, or so long before that."""
        end_ns = self.end_ns - before_end_ns
        return [self.due[0].t_ns, end_ns] if self.due else [end_ns]

    def end_by(self, now_ns: int) -> None:
        """End the run now, if it does not end before."""
        self.end_ns = min(self.end_ns, now_ns)

    def shut_down(self, now_ns: int, patience_ns: int) -> None:
        """Drop all stimuli, which would wake processes that are about to end, and give these some time to do so."""
        self.due, self.end_ns = [], now_ns + patience_ns

    def is_over(self, processes: Iterable[Process]) -> bool:
        """Return whether nothing more can happen: nobody is left, and what is published is published to nobody."""
        going_on = (TopicEvent, Step, LeaseEnds, LaunchDue)
        return all(p.ended for p in processes) and not any(isinstance(d, going_on) for d in self.due)


class Core(Generic[P]):
    """The state of a run in virtual time, and the rules by which it goes on.

    Args:
        processes: The processes, in the order of the plan; whoever owns the list may add more.
        agenda: What is still to come.
        includes_end: Whether what happens at the moment to which a step goes belongs to the step, as it does not belong
            to a plan. The run then ends a nanosecond later, of which no process is told.
        choose: Returns which of the processes that could run at one instant does, from the name of the step; without
            it, they run in their order.
        held: The topics whose messages do not arrive at once where another process receives them.

    Attributes:
        processes: The processes.
        step: The name of the step that is next, or under way: the instant, and how many came before at it. What was
            drawn at an earlier instant does not change the names of later steps.
        deviates: Whether the process that runs next is another one than their order says.
        withheld: The messages that were sent and do not arrive at once: to whom, on which topic, how many.
        now_ns: Nanoseconds of virtual time since the start of the run.
        kept: How many messages each process has published on a topic of a latched publisher of its own.
        remains: What processes have left in the graph that ended without a farewell.
    """

    def __init__(
        self,
        processes: Sequence[P],
        agenda: Agenda,
        *,
        includes_end: bool = False,
        choose: Callable[[str, Sequence[P]], P] | None = None,
        held: Iterable[str] = (),
    ) -> None:
        self._agenda = agenda
        self._past_end_ns = int(includes_end)
        self._choose = choose
        self._held = frozenset(held)
        self._to_ns = 0
        self._free_until_ns = 0
        self._steps = 0
        self._counted_ns = self._counted = 0
        self.step = ""
        self.deviates = False
        self.withheld: list[tuple[P, str, int]] = []
        self._hops = 0
        #: When the publishers and subscriptions of each process, by their numbers there, have appeared.
        self._appeared_ns: dict[tuple[str, int], int] = {}
        self.processes = processes
        self.now_ns = 0
        self.kept: Counter[tuple[str, str]] = Counter()
        self.remains: list[Remains] = []

    # ---------------------------------------------------------- what to do next

    def begin(self) -> Iterator[Command[P]]:
        """Create the endpoints that exist from the start, then let each process start that does not start late."""
        agenda = self._agenda
        while agenda.is_due(self.now_ns) and agenda.due[0].creates:
            yield Play(agenda.due.pop(0))
        for process in self.processes:
            process.wake_ns = agenda.starts_ns.get(process.name)
            if process.wake_ns is None:
                yield from self.run(process)

    def run_on(self, is_enough: Callable[[], bool] = lambda: False) -> Iterator[Command[P]]:
        """Step through time until the end, or until nothing more can happen.

        Args:
            is_enough: Asked whether to stop at an instant at which nothing is left to do.
        """
        while not self._agenda.is_over(self.processes):
            yield from self._settle()
            if self.now_ns >= self._agenda.end_ns or is_enough():
                return
            yield Retry()
            if self._next_process() is None:  # a match is an event that wakes a process
                self.now_ns = self._next_ns()

    def run(self, process: P) -> Iterator[Command[P]]:
        """Let one process run, with the messages on their way to it."""
        arrivals, process.arrivals, process.nudged = process.arrivals, {}, False
        self._name_step()
        self._counted += 1
        if arrivals:
            self._count_hop()
            if self._hops > MOST_HOPS:
                yield Limit(f"the nodes answered each other {MOST_HOPS:,} times without a pause")
        starts = bool(self._agenda.starts_ns.pop(process.name, 0))
        self._free_until_ns = self._quiet_until(process)
        yield RunProcess(process, self._free_until_ns, arrivals, starts)
        self._steps += 1
        most = STEPS + STEPS_HZ * self.now_ns // NS_PER_S
        if self._steps >= most:
            yield Limit(f"more than {most:,} wake-ups")
            self._agenda.end_by(self.now_ns)

    def hand_over(self) -> Iterator[Receive[P]]:
        """Make every process wait for the messages on their way to it; each of them runs again at this instant."""
        for process in self.processes:
            if process.arrivals and not process.ended:
                arrivals, process.arrivals, process.nudged = process.arrivals, {}, True
                yield Receive(process, arrivals)

    def _settle(self) -> Iterator[Command[P]]:
        """Let everything happen that happens at this instant: first stimuli, then one process, and again."""
        while self.now_ns < self._agenda.end_ns:
            if self._agenda.is_due(self.now_ns):
                yield from self._play()
            process = self._next_process()
            if process is not None:
                yield from self.run(process)
            elif not self._agenda.is_due(self.now_ns):
                self._hops = 0
                return

    def _play(self) -> Iterator[Command[P]]:
        """Execute the events that are due, but no more than one call of a service."""
        while self._agenda.is_due(self.now_ns):
            event = self._agenda.due.pop(0)
            yield Play(event)
            if isinstance(event, Ask):
                return  # the next call follows after this one has arrived, so that their order is always the same

    def _next_process(self) -> P | None:
        """Return the process that runs next at this instant; None if none has anything to do."""
        found = []
        for process in self.processes:
            is_paused = process.resumes_ns > self.now_ns
            if not (process.ended or is_paused) and (process.arrivals or process.nudged or self._is_due(process)):
                if self._choose is None:
                    return process
                found.append(process)
        if self._choose is None or not found:
            return None
        self._name_step()
        chosen = self._choose(self.step, found)
        self.deviates = chosen is not found[0]
        return chosen

    def _name_step(self) -> None:
        if self._counted_ns != self.now_ns:
            self._counted_ns, self._counted = self.now_ns, 0
        self.step = f"{self.now_ns}.{self._counted}"

    def _is_due(self, process: P) -> bool:
        return process.wake_ns is not None and process.wake_ns <= self.now_ns

    def _next_ns(self) -> int:
        """Return the next moment at which anything is due."""
        running = [p for p in self.processes if not p.ended]
        wakes = [max(p.wake_ns, p.resumes_ns) for p in running if p.wake_ns is not None]
        wakes += [p.resumes_ns for p in running if p.resumes_ns > self.now_ns and (p.arrivals or p.nudged)]
        return max(self.now_ns, min(self._agenda.moments() + wakes))

    def _quiet_until(self, process: P) -> int:
        """Return the next moment at which a stimulus or any other process is due."""
        moments = self._agenda.moments(self._past_end_ns)
        for other in self.processes:
            if other is not process and not other.ended:
                if other.resumes_ns > self.now_ns:
                    moments.append(other.resumes_ns)
                elif other.arrivals or other.nudged:
                    return self.now_ns
                if other.wake_ns is not None:
                    moments.append(max(other.wake_ns, other.resumes_ns))
        return max(self.now_ns, min(moments))

    def _count_hop(self) -> None:
        """Note that a process takes messages, which takes time if the nodes have not rested for long."""
        self._hops += 1
        if self._hops > HOPS:
            self.now_ns = min(self.now_ns + HOP_NS, self._agenda.end_ns)

    # -------------------------------------------------------- what has happened

    def reached(self, t_ns: int) -> None:
        """Adopt the time that the running process has reached on its own."""
        t_ns = min(t_ns, self._free_until_ns)
        if t_ns > self.now_ns:
            self.now_ns = t_ns
            self._hops = 0  # it has rested

    def waits(self, process: P, wake_ns: int | None) -> None:
        """Note that a process has nothing left to do until a moment, or until something arrives."""
        process.wake_ns = wake_ns

    def ended(self, process: P) -> None:
        """Note that a process has ended, and its endpoints with it."""
        process.ended, process.wake_ns, process.claims = True, None, []

    def lost(self, process: P) -> None:
        """Note that a process is about to end without a farewell, so that its endpoints stay until its lease ends."""
        claims = [claim for claim in process.claims if claim.kind != "parameter"]
        if not claims:
            return
        others = [other for other in self.processes if other is not process and not other.ended]
        remains = Remains(process.name, claims, self.now_ns, frozenset(o.name for o in others if o.claims))
        self.remains.append(remains)
        process.claims = []
        leases = {
            reader.qos.lease_ns
            for writer in ends_of_kind(claims, "publisher")
            for other in others
            for reader in readers_of(other.claims, writer.name)
            if compatible(writer, reader) and 0 < reader.qos.lease_ns < LEASE_NS
        }
        for lease_ns in sorted({*leases, LEASE_NS}):
            self._agenda.later(LeaseEnds(self.now_ns + lease_ns, remains))

    def has(self, process: P, claims: list[Claim]) -> None:
        """Note which endpoints a process has: all of them, because it reports all of them each time."""
        process.claims, process.renewed = claims, True
        for claim in claims:
            if claim.kind in ("publisher", "subscription"):
                self._appeared_ns.setdefault((process.name, claim.number), self.now_ns)

    def sent(self, sender: P, counts: Mapping[str, int]) -> None:
        """Announce what a process has sent, by channel, to every process that receives it."""
        for channel, count in sorted(counts.items()):
            kind, _, name = channel.partition(" ")
            if kind == "topic":
                writers = claims_of(sender.claims, "publisher", name)
                self.kept[sender.name, name] += count if any(w.qos.latched for w in writers) else 0
                for process in hearers(self.processes, writers, name):
                    if name in self._held and process is not sender and channel not in process.unmatched:
                        self.withheld.append((process, name, count))
                    else:
                        announce(process, channel, count)
            elif kind in ("request", "response"):
                self.exchanged(kind, name, count, senders(sender, channel))

    def exchanged(self, kind: str, service: str, count: int, ends: Sequence[Claim] = (ORDINARY_END,)) -> None:
        """Announce requests to servers, or responses to clients: every client of a service receives all responses."""
        for process in self.processes:
            own = claims_of(process.claims, "service" if kind == "request" else "client", service)
            if not process.ended and any(passes(sender, end) for sender in ends for end in own):
                announce(process, f"{kind} {service}", count)

    def go_to(self, t_ns: int) -> None:
        """Let the run end after what happens at a moment, or after what happens now if that moment has passed."""
        self._to_ns = max(self.now_ns, t_ns)
        self._agenda.end_ns = self._to_ns + self._past_end_ns

    def arrive(self, *, early: bool) -> None:
        """End a step at the moment that it was to go to, or early, where it was stopped."""
        self.now_ns = min(self.now_ns, self._to_ns) if early else self._to_ns

    # ---------------------------------------------------------------- questions

    @property
    def is_restless(self) -> bool:
        """Whether the nodes answer each other so long already that each message takes time."""
        return self._hops > HOPS

    def is_new(self, process: P, topic: str) -> bool:
        """Return whether a process has a publisher on a topic that has appeared at this instant."""
        publishers = claims_of(process.claims, "publisher", topic)
        return any(self._appeared_ns.get((process.name, c.number)) == self.now_ns for c in publishers)

    def appeared_ns(self, process: P, claim: Claim) -> int:
        """Return when a publisher or a subscription of a process has appeared."""
        return self._appeared_ns.get((process.name, claim.number), 0)

    def is_on_its_way(self, channel: str) -> bool:
        """Return whether messages of a channel are on their way to any process."""
        return any(channel in p.arrivals for p in self.processes if not p.ended)


def announce(process: Process, channel: str, count: int) -> None:
    """Add messages to those that are on their way to a process, unless its end of the channel has no counterpart."""
    if channel not in process.unmatched:
        process.arrivals[channel] = process.arrivals.get(channel, 0) + count


def hearers(processes: Iterable[P], writers: Sequence[Claim], topic: str) -> list[P]:
    """Return the processes that subscribe to a topic with a QoS that fits one of its publishers."""
    return [one for one in processes if any(compatible(w, r) for w in writers for r in readers_of(one.claims, topic))]


def senders(process: Process, channel: str) -> Sequence[Claim]:
    """Return the ends of a service with which a process sends on a channel."""
    kind, _, service = channel.partition(" ")
    return claims_of(process.claims, "client" if kind == "request" else "service", service) or (ORDINARY_END,)


class Arriving:
    """The published messages of one report, on their way to the grader's node.

    Args:
        sent: How many messages a process has published on each topic that the node reads.
        early: How many of them, the first ones, it has sent before any subscription could have discovered it.
    """

    def __init__(self, sent: Mapping[str, int], early: Mapping[str, int]) -> None:
        self._missing = Counter(sent)
        self._early = Counter(early)
        self._held: list[Taken] = []

    def take(self, taken: Sequence[Taken]) -> list[tuple[Taken, bool]]:
        """Note what has arrived; of a flood, return what to record already, so that its limit can end it."""
        self._held.extend(taken)
        self._missing.subtract(message.topic for message in taken)
        return self.held() if len(self._held) > MOST_ARRIVED else []

    def held(self) -> list[tuple[Taken, bool]]:
        """Return what to record, in order, each with whether it was sent before its publisher was discovered."""
        # By topic: whose messages arrive first is up to the middleware, and differs from run to run.
        found, self._held = in_order(self._held), []
        marked = []
        for message in found:
            marked.append((message, self._early[message.topic] > 0))
            self._early[message.topic] -= 1
        return marked

    @property
    def missing(self) -> list[str]:
        """The topics on which messages are still on their way, sorted."""
        return sorted(topic for topic, count in self._missing.items() if count > 0)
