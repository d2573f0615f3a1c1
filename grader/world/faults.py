"""The faults that a test lets happen to programs and to their messages, and which of them a seed turns on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from random import Random
from typing import Any

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.plan import InjectedFault, derive

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
            drawn = derive(seed, "fault", on if kind in OF_TOPICS else f"{kind} {on}")
            if kind == "lose":
                if not rising(0, value, 1):
                    raise ValueError(f"between: {on}: lose: expected a share from 0 to 1, found {value!r}")
                yield InjectedFault(kind, on, 0, 0, value, drawn)
                continue
            if not (isinstance(value, (tuple, list)) and len(value) == 2 and rising(0, *value)):
                text = f"between: {on}: {kind}: expected the least and the most seconds, found {value!r}"
                raise ValueError(text)
            least_ns, most_ns = (round(one * NS_PER_S) for one in value)
            yield InjectedFault(kind, on, least_ns, most_ns, 0.0, drawn)


def names_of(delay: Iterable[str], lose: Iterable[str], faults: Sequence[InjectedFault]) -> tuple[str, ...]:
    """Return the names of all faults of a test: of messages of the test itself, and of those between programs."""
    topics = [("delay", topic) for topic in delay] + [("lose", topic) for topic in lose]
    own = [f"{kind} {topic if topic.startswith('/') else f'/{topic}'}" for kind, topic in topics]
    return tuple(dict.fromkeys([*own, *(one.name for one in faults)]))


def subset(seed: int, names: Sequence[str]) -> tuple[str, ...]:
    """Draw which faults a seed turns on: each with a chance of one half, so that none hides what another one shows.

    This is swarm testing: Groce, Zhang, Eide, Chen and Regehr, ISSTA 2012.
    """
    return tuple(name for name in names if Random(derive(seed, "on", name)).getrandbits(1))  # noqa: S311 - it has to repeat


def rising(*numbers: Any) -> bool:
    """Return whether all of some values are numbers, and none is less than the one before it."""
    return all(isinstance(one, (int, float)) for one in numbers) and all(a <= b for a, b in pairwise(numbers))
