"""Keeps what each program of a stepped run does in each of its steps, so that two runs can be compared."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence

from grader.runtime.host.protocol import Claim
from grader.runtime.model.step_event import ProgramStep, StepEvent
from grader.runtime.worker.claims import claims_of
from grader.runtime.worker.core import Process, hearers

#: The most steps that are kept; a race shows in the first ones that differ.
MOST_STEPS = 50_000
#: The most messages of a channel whose senders are remembered for a process that has not read them.
MOST_UNREAD = 1_000
#: Who sends what no program has sent.
TEST = "the test"
#: What is shown of the endpoints of a program: kinds of claims.
_SHOWN = ("publisher", "subscription", "service", "client")


class StepLog:
    """The steps of all programs, in order.

    Args:
        processes: The processes; whoever owns the list may add more.
    """

    def __init__(self, processes: Sequence[Process]) -> None:
        self._processes = processes
        self._names: dict[str, str] = {}
        self._steps: list[ProgramStep] = []
        self._events: list[StepEvent] = []
        #: Who has sent the messages of a channel that a process has not read yet, oldest first.
        self._senders: dict[tuple[str, str], deque[str]] = {}

    def begin(self, t_ns: int, process: Process, name: str, *, deviates: bool) -> None:
        """Begin a step of a process."""
        self._events = []
        if len(self._steps) < MOST_STEPS:
            self._steps.append(ProgramStep(t_ns, process.name, name, deviates, ()))

    def told(self, t_ns: int, process: Process, did: Iterable[str], before: Sequence[Claim], *, drew: bool) -> None:
        """Note what a process reports: what it has done, and what it offers now and has not before.

        It may have let time pass on its own since the step began.
        """
        # Claims are replaced as a whole, and seldom.
        for claim in process.claims if process.claims is not before else ():
            if claim.kind in _SHOWN and claim not in before:
                self._events.append(StepEvent(self._name(process), "offers", f"{claim.kind} {claim.name}"))
        for one in did:
            verb, _, channel = one.partition(" ")
            others: tuple[str, ...] = ()
            if verb == "reads":
                waiting = self._senders.get((process.name, channel))
                others = (waiting.popleft() if waiting else TEST,)
            elif verb == "sends":
                receivers = self._receivers(process, channel)
                others = tuple(map(self._name, receivers))
                for receiver in receivers:
                    queue = self._senders.setdefault((receiver.name, channel), deque(maxlen=MOST_UNREAD))
                    queue.append(self._name(process))
            self._events.append(StepEvent(self._name(process), verb, channel, others))
        if self._steps and (self._events or drew):
            last = self._steps[-1]
            self._steps[-1] = last._replace(t_ns=t_ns, deviates=last.deviates or drew, events=tuple(self._events))

    def fault(self, t_ns: int, process: Process, does: str, what: str = "") -> None:
        """Note what a fault does to a process, as a step of its own."""
        if does == "loses" and (waiting := self._senders.get((process.name, what))):
            others: tuple[str, ...] = (waiting.pop(),)
        else:
            others = tuple([*self._senders.get((process.name, what.partition(" ")[2]), ())][-1:])
        if len(self._steps) < MOST_STEPS:
            event = StepEvent(self._name(process), does, what, others)
            self._steps.append(ProgramStep(t_ns, process.name, "", False, (event,)))  # noqa: FBT003 - nothing is drawn

    def steps(self) -> list[ProgramStep]:
        """Return the steps so far; of a program that had no node yet, by the name of the node that it made later."""

        def named(event: StepEvent) -> StepEvent:
            others = tuple(self._names.get(name, name) for name in event.others)
            return event._replace(node=self._names.get(event.node, event.node), others=others)

        return [step._replace(events=tuple(map(named, step.events))) for step in self._steps]

    def _name(self, process: Process) -> str:
        nodes = [claim.name for claim in process.claims if claim.kind == "node"]
        return self._names.setdefault(process.name, nodes[0]) if nodes else self._names.get(process.name, process.name)

    def _receivers(self, sender: Process, channel: str) -> list[Process]:
        kind, _, name = channel.partition(" ")
        if kind == "topic":
            return hearers(self._processes, claims_of(sender.claims, "publisher", name), name)
        return [p for p in self._processes if claims_of(p.claims, "service" if kind == "request" else "client", name)]
