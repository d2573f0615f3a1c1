"""What a launch file does while its nodes run: event handlers, starting nodes again, and shutting all of them down.

It starts and stops nothing itself: it is told what has happened, and answers with what is to be done. The order is that
of `launch` (ros2/launch, `ExecuteLocal` and `LaunchService`): the handler that was registered last is called first.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace

from grader.runtime.host.protocol import LaunchedNode, LaunchHandler, LaunchStep
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.scenario import Event

#: How often all nodes of a launch file are started again at most. ROS has no limit, but there each start takes time; in
#: virtual time, a node that fails at once would be started again without end.
MOST_RESPAWNS = 100
#: How long after the stop signal a node is killed that has not ended: launch sends SIGTERM after 5 s, which nodes of
#: rclpy take for another Ctrl-C, and SIGKILL 5 s later.
PATIENCE_S = 10.0


@dataclass(frozen=True, slots=True)
class BeginNode:
    """Start a node."""

    node: int


@dataclass(frozen=True, slots=True)
class StopNode:
    """Send a process the stop signal, as Ctrl-C does."""

    name: str


@dataclass(frozen=True, slots=True)
class KillNode:
    """Kill a process."""

    name: str


@dataclass(frozen=True, slots=True)
class DoLater:
    """Come back with a step after its delay."""

    step: LaunchStep


@dataclass(frozen=True, slots=True)
class TellReader:
    """Say something that the reader of the recording has to know."""

    text: str


Order = BeginNode | StopNode | KillNode | DoLater | TellReader


@dataclass(eq=False)
class LaunchService:
    """One launch file whose nodes run.

    Args:
        name: What the launch file is called in notes.
        root: The folder that its nodes lie in.
        nodes: The nodes that can be started, by their numbers.
        processes: What the process of each of these is called first.
        files: The file of each of these, relative to `root`.
        steps: What is done when the launch file begins.
        handlers: Its event handlers, by their numbers.

    Attributes:
        names: Each process that was started, with the name that the first one of its node has.
    """

    name: str
    root: str
    nodes: Mapping[int, LaunchedNode]
    processes: Mapping[int, str]
    files: Mapping[int, str]
    steps: Sequence[LaunchStep]
    handlers: Sequence[LaunchHandler]
    names: dict[str, str] = field(default_factory=dict)
    _running: dict[str, int] = field(default_factory=dict)
    _started: set[str] = field(default_factory=set)
    _executed: set[int] = field(default_factory=set)
    _registered: list[int] = field(default_factory=list)
    _respawned: dict[int, int] = field(default_factory=dict)
    _stopped: tuple[str, ...] = ()
    _is_shut: bool = False

    @property
    def first(self) -> list[int]:
        """The nodes that start with the launch file, and not later."""
        found = (one.number for one in self.steps if one.act == "start" and not one.delay_s)
        return [number for number in dict.fromkeys(found) if number in self.nodes]

    def renamed(self, names: Mapping[str, str]) -> LaunchService:
        """Return the same with other names of processes."""
        processes = {number: names.get(name, name) for number, name in self.processes.items()}
        return replace(self, processes=processes)

    def begin(self) -> Iterator[Order]:
        """BeginNode, once the first nodes were started."""
        for number in self.first:
            self.began(number, self.processes[number])
        starting = set(self.first)
        for step in self.steps:
            if step.act == "start" and step.number in starting:
                starting.discard(step.number)
            else:
                yield from self._soon(step)

    def began(self, number: int, name: str) -> None:
        """Note that a process of a node was started under a name."""
        self._running[name] = number
        self._executed.add(number)
        self.names[name] = self.processes[number]

    def started(self, name: str) -> Iterator[Order]:
        """Return what is done because a process runs for the first time."""
        if name in self._running and name not in self._started:
            self._started.add(name)
            yield from self._called("start", self._running[name])

    def ended(self, name: str) -> Iterator[Order]:
        """Return what is done because a process has ended."""
        if name not in self._running:
            return
        number = self._running.pop(name)
        yield from self._called("exit", number)
        # After the handlers, so that one that shuts down keeps the node from starting again: launch looks whether it is
        # shut down before it calls them, but asks once more after the delay.
        yield DoLater(LaunchStep("respawn", number))

    def interrupted(self) -> None:
        """Note that Ctrl-C is sent to everything: nothing is started any more."""
        self._is_shut = True

    def perform(self, step: LaunchStep) -> Iterator[Order]:
        """Return what a step does whose time has come."""
        if step.act == "end":
            yield from (KillNode(name) for name in self._stopped if name in self._running)
        elif step.act == "respawn":
            yield from self._respawn(step.number)
        elif self._is_shut:
            return
        elif step.act == "again":
            yield BeginNode(step.number)
        elif step.act == "start" and step.number in self._executed:
            process = self.processes[step.number]
            yield TellReader(f"{self.name}: {process} was to be started twice, at which launch shuts down")
            yield from self._shut_down()
        elif step.act == "start" and step.number in self.nodes:
            yield BeginNode(step.number)
        elif step.act == "register" and 0 <= step.number < len(self.handlers):
            self._registered.insert(0, step.number)
        elif step.act == "shutdown":
            yield from self._shut_down()

    def _soon(self, step: LaunchStep) -> Iterator[Order]:
        """Return what a step does now, or that it comes later."""
        if step.delay_s or step.act in ("start", "shutdown"):
            yield DoLater(step)
        else:
            yield from self.perform(step)

    def _respawn(self, number: int) -> Iterator[Order]:
        node, times = self.nodes[number], self._respawned.get(number, 0)
        again = node.respawn and not self._is_shut and not 0 <= node.respawn_most <= times
        if again and sum(self._respawned.values()) >= MOST_RESPAWNS:
            again = False
            yield TellReader(f"{self.name}: nodes were started again {MOST_RESPAWNS} times, and are not any more")
        if again:
            self._respawned[number] = times + 1
            yield DoLater(LaunchStep("again", number, node.respawn_delay_s))
        else:
            yield from self._called("complete", number)

    def _called(self, event: str, number: int = -1) -> Iterator[Order]:
        for step in self._steps_at(event, number):
            yield from self._soon(step)

    def _steps_at(self, event: str, number: int = -1) -> Iterable[LaunchStep]:
        """Return what the handlers of an event do; one that handles one event only is forgotten."""
        found: list[LaunchStep] = []
        for place in [*self._registered]:
            handler = self.handlers[place]
            if handler.event == event and handler.node in (-1, number):
                found += handler.steps
                if handler.once:
                    self._registered.remove(place)
        return found

    def _shut_down(self) -> Iterator[Order]:
        """Stop all nodes.

        As in launch, a node that a handler of this event starts is started, and nobody stops it; what a timer would
        start then is not.
        """
        self._stopped = tuple(self._running)
        for step in self._steps_at("shutdown"):
            if step.act == "start" and not step.delay_s:
                yield from self.perform(step) if step.number not in self._executed else ()
        self._is_shut = True
        yield from (StopNode(name) for name in self._stopped)
        yield DoLater(LaunchStep("end", 0, PATIENCE_S))


@dataclass(frozen=True, slots=True)
class LaunchDue(Event):
    """The time has come for a step of a launch file."""

    service: LaunchService
    step: LaunchStep

    @staticmethod
    def at(now_ns: int, service: LaunchService, step: LaunchStep) -> LaunchDue:
        """Return the event for a step that waits from now on."""
        return LaunchDue(now_ns + round(step.delay_s * NS_PER_S), service, step)
