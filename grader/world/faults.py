"""The faults that a test lets happen to programs and to their messages, and which of them a seed turns on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from random import Random
from typing import Any

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.plan import InjectedFault, PlannedConnection, derive
from grader.world.names import absolute_name

#: What can be done to a topic, and to a program.
OF_TOPICS, OF_PROGRAMS = ("delay", "lose"), ("pause", "kill")


@dataclass(frozen=True, slots=True)
class RunDraws:
    """What is drawn in a run, of all that its seed draws.

    Attributes:
        faults: The names of the faults that may be on; None for all of them.
        steps: The names of the steps in which the order of programs and callbacks is drawn; None for all of them.
        seed: The seed; None for that of the test.
    """

    faults: tuple[str, ...] | None = None
    steps: tuple[str, ...] | None = None
    seed: int | None = None

    @property
    def size(self) -> int:
        """How many draws it names."""
        return len(self.faults or ()) + len(self.steps or ())


#: Everything is drawn.
ALL = RunDraws()


@dataclass(frozen=True, slots=True)
class RunFaults:
    """The faults that are on in a run.

    Attributes:
        names: What they are called, such as `delay /scan`.
        connections: What happens to messages that the test publishes.
        injected: What happens to programs, and to what they send each other.
    """

    names: tuple[str, ...]
    connections: tuple[PlannedConnection, ...]
    injected: tuple[InjectedFault, ...]


def faults_of_run(  # noqa: PLR0913 - the options of the marker
    seed: int,
    *,
    delay: Mapping[str, tuple[float, float]] | None = None,
    lose: Mapping[str, float] | None = None,
    between: Mapping[str, Mapping[str, Any]] | None = None,
    swarm: bool = False,
    only: RunDraws = ALL,
) -> RunFaults:
    """Return the faults of a run, as a test gives them.

    Args:
        seed: What is drawn in the run follows from it.
        delay: For topics that the test publishes on, the least and the most seconds that a message is on its way.
        lose: For such topics, the share of messages that are lost.
        between: What is done to programs, and to what they send each other; see `injected`.
        swarm: Whether the seed also draws which of the faults are on.
        only: What is drawn at all, of all that the seed draws.

    Raises:
        ValueError: A fault that cannot be.
    """
    between_programs = tuple(injected(seed, between or {}))
    delays = {name: _times_ns(f"delay: {name}", value) for name, value in _by_topic(delay)}
    shares = {name: _share(f"lose: {name}", value) for name, value in _by_topic(lose)}
    names = names_of(delays, shares, between_programs)
    if swarm:
        names = subset(seed, names)
    if only.faults is not None:
        names = tuple(name for name in names if name in only.faults)
    late = {topic: times_ns for topic, times_ns in delays.items() if f"delay {topic}" in names}
    lost = {topic: share for topic, share in shares.items() if f"lose {topic}" in names}
    connections = (
        PlannedConnection(topic, late.get(topic, (0, 0)), lost.get(topic, 0.0), derive(seed, "connection", topic))
        for topic in dict.fromkeys((*late, *lost))
    )
    return RunFaults(names, tuple(connections), tuple(one for one in between_programs if one.name in names))


def injected(seed: int, between: Mapping[str, Mapping[str, Any]]) -> Iterator[InjectedFault]:
    """Yield the faults between programs, as a test gives them.

    Args:
        seed: What is drawn in the run follows from it.
        between: By name. For a topic, which begins with `/`: `delay`, the least and the most seconds that what a
            program publishes is on its way to others, and `lose`, the share of it that is lost. For a program, as it
            was started: `pause`, the least and the most seconds for which it stands still, from before one of its
            first steps, and `kill`, the least and the most seconds until it is killed.

    Raises:
        ValueError: A fault that cannot be.
    """
    for on, given in between.items():
        kinds = OF_TOPICS if on.startswith("/") else OF_PROGRAMS
        if not isinstance(given, Mapping):
            raise ValueError(f"between: {on}: expected {' or '.join(kinds)} by name, found {given!r}")
        for kind, value in given.items():
            if kind not in kinds:
                what = "a topic" if on.startswith("/") else "a program; a topic begins with /"
                raise ValueError(f"between: {on}: expected {' or '.join(kinds)} for {what}, found {kind!r}")
            drawn, where = derive(seed, "fault", on if kind in OF_TOPICS else f"{kind} {on}"), f"between: {on}: {kind}"
            if kind == "lose":
                yield InjectedFault(kind, on, 0, 0, _share(where, value), drawn)
            else:
                yield InjectedFault(kind, on, *_times_ns(where, value), 0.0, drawn)


def names_of(delay: Iterable[str], lose: Iterable[str], faults: Sequence[InjectedFault]) -> tuple[str, ...]:
    """Return the names of all faults of a test: of messages of the test itself, and of those between programs."""
    own = [*(f"delay {absolute_name(topic)}" for topic in delay), *(f"lose {absolute_name(topic)}" for topic in lose)]
    return tuple(dict.fromkeys([*own, *(one.name for one in faults)]))


def subset(seed: int, names: Sequence[str]) -> tuple[str, ...]:
    """Draw which faults a seed turns on: each with a chance of one half, so that none hides what another one shows.

    This is swarm testing: Groce, Zhang, Eide, Chen and Regehr, ISSTA 2012.
    """
    return tuple(name for name in names if Random(derive(seed, "on", name)).getrandbits(1))  # noqa: S311 - it has to repeat


def _by_topic(given: Mapping[str, Any] | None) -> Iterator[tuple[str, Any]]:
    return ((absolute_name(topic), value) for topic, value in (given or {}).items())


def _times_ns(where: str, value: Any) -> tuple[int, int]:
    """Return the least and the most nanoseconds of what a test gives in seconds."""
    if not (isinstance(value, (tuple, list)) and len(value) == 2 and _rising(0, *value)):
        raise ValueError(f"{where}: expected the least and the most seconds, found {value!r}")
    return round(value[0] * NS_PER_S), round(value[1] * NS_PER_S)


def _share(where: str, value: Any) -> float:
    """Return a share that a test gives."""
    if not _rising(0, value, 1):
        raise ValueError(f"{where}: expected a share from 0 to 1, found {value!r}")
    share: float = value
    return share


def _rising(*numbers: Any) -> bool:
    """Return whether all of some values are numbers, and none is less than the one before it."""
    return all(isinstance(one, (int, float)) for one in numbers) and all(a <= b for a, b in pairwise(numbers))
