"""What a node publishes for a simulation that does not hear it: another type on its topic, or its type elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from grader.grading.judging.values import student_endpoints
from grader.grading.model.wording import nearest
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import Endpoint, Trace


@dataclass(frozen=True, slots=True)
class NotHeard:
    """A publisher that no simulation hears, though it was probably meant for one.

    Attributes:
        end: The publisher.
        topic: The topic that a simulation hears.
        types: The types that it takes there.
    """

    end: Endpoint
    topic: str
    types: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """What differs, with both types or both topics."""
        wanted = f"{' or '.join(self.types)} on {self.topic}"
        return f"{self.end.node} publishes {self.end.type} on {self.end.topic}; the simulation hears {wanted}"


def heard_by_simulations(trace: Trace) -> Mapping[str, tuple[str, ...]]:
    """Return the topics that simulations of a recording listen to, with the types that they take."""
    found: dict[str, dict[str, None]] = {}
    for mark in trace.marks("simulation_hears"):
        topic, _, type_ = mark.detail.partition(" ")
        found.setdefault(topic, {})[type_] = None
    return {topic: tuple(types) for topic, types in found.items()}


def not_heard(trace: Trace) -> Iterator[NotHeard]:
    """Yield one publisher for each topic of a simulation on which no node publishes what it takes.

    Of publishers on other topics, one is meant that has the type and a name that is alike, or that is the only one.
    """
    publishers, heard = student_endpoints(trace, "publisher"), heard_by_simulations(trace)
    for topic, types in heard.items():
        here = [end for end in publishers if end.topic == topic]
        if any(end.type in types for end in here):
            continue
        elsewhere = {end.topic: end for end in publishers if end.type in types and end.topic not in heard}
        close = nearest(topic, elsewhere)
        meant = [*here, *([elsewhere[close]] if close else elsewhere.values() if len(elsewhere) == 1 else [])]
        if meant:
            yield NotHeard(meant[0], topic, types)


def unheard_by_simulations(trace: Trace) -> tuple[str, ...]:
    """Return a note for each of them."""
    return tuple(one.sentence for one in not_heard(trace))
