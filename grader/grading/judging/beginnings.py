"""Judges the beginning of a recording by the checks of a rubric, to compare it with one on another clock; pure.

Both recordings are cut to the same length and judged in the same way. A criterion differs only if it is met in the
first and not in the second, wherever near the end they are cut, and only if losing the first messages cannot be why: a
message that a program sends before anybody has discovered its publisher arrives on one clock and not on the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from grader.grading.judging.agreement import Aspect, ClockDifference
from grader.grading.judging.idle_machine import shown_until_ns
from grader.grading.judging.run_check import for_beginning, run_check
from grader.grading.model.exercise import Criterion, Exercise
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S
from grader.runtime.model.submission import Submission
from grader.runtime.model.trace import AssessedTrace, Message

#: How long before the end both recordings are cut. An answer that comes just after one cut comes before another.
CUTS_NS = (100 * NS_PER_MS, 300 * NS_PER_MS, 700 * NS_PER_MS)
#: How much of the beginning of each topic may be lost until the grader's subscription is discovered: the first message,
#: or all in this time. Discovery on one machine takes up to 200 ms.
LOST_NS = (1, NS_PER_S // 2)
#: The lengths of a check, shortest first. Nearly all criteria can be judged in the first: a rate from a few dozen
#: messages, an answer from two inputs. A criterion that needs more than the last is not compared.
LENGTHS_NS = (4 * NS_PER_S, 6 * NS_PER_S, 9 * NS_PER_S)


@dataclass(frozen=True, slots=True)
class Comparison:
    """What a comparison of two recordings found.

    Attributes:
        lost: The criteria that earn more in the first than in the second, in rubric order.
        unsure: Whether some criterion could not be judged in the second because the machine was too busy.
    """

    lost: tuple[ClockDifference, ...] = ()
    unsure: bool = False


class BeginningJudge:
    """Judges the beginnings of the recordings of one scenario.

    Args:
        exercise: The exercise.
        scenario: Id of the scenario.
        submission: Tells which files were found.
        sources: Wanted file name -> its text.
    """

    def __init__(self, exercise: Exercise, scenario: str, submission: Submission, sources: Mapping[str, str]) -> None:
        self._exercise = replace(exercise, draws={})
        self._scenario = scenario
        self._submission = submission
        self._sources = sources
        asked = (c for c in exercise.criteria if scenario in exercise.recordings_of(c))
        # Without `full` and `none`: numbers always differ a little between clocks, and a beginning has others anyway.
        alone = [replace(c, scenario=scenario, scale=None) for c in asked]
        self._criteria = [(c, part) for c in alone if (part := for_beginning(c))]

    def length_ns(self, trace: AssessedTrace, begins_ns: int) -> int:
        """Return how long a second recording has to be, from the moment at which the program has something to do.

        Args:
            trace: The whole first recording.
            begins_ns: That moment: of the first message, or of the first stimulus.
        """
        wanted = [part for whole, part in self._criteria if self._credit(whole, trace)]
        for length_ns in LENGTHS_NS:
            parts = [cut(trace, begins_ns + length_ns - cut_ns) for cut_ns in CUTS_NS]
            wanted = [c for c in wanted if not any(self._credit(c, part) for part in parts)]
            if not wanted:
                return length_ns
        return LENGTHS_NS[-1]

    def compare(self, first: AssessedTrace, second: AssessedTrace, starts_ns: tuple[int, int]) -> Comparison:
        """Judge both recordings, cut to the length of the second.

        Args:
            first: The whole recording.
            second: The recording that may be shorter.
            starts_ns: When the time that both have in common starts in each.
        """
        length_ns = second.stop_ns - starts_ns[1]
        second = replace(second, harness_problem="")  # a busy machine makes programs worse, never better
        pairs = [
            (cut(first, starts_ns[0] + length_ns - cut_ns), cut(second, starts_ns[1] + length_ns - cut_ns))
            for cut_ns in CUTS_NS
            if cut_ns < length_ns
        ]
        until_ns = shown_until_ns(first, second, starts_ns)
        lost: list[ClockDifference] = []
        unsure = False
        for whole, part in self._criteria:
            earned = self._credit(whole, first)
            judged = list(self._judged(part, earned, pairs)) if earned else []
            if not judged or any(after is not None and after >= before for before, after in judged):
                continue
            if all(after is None for _, after in judged):
                unsure = True
                continue
            before, after = next((before, after) for before, after in judged if after is not None)
            if until_ns < starts_ns[0] + length_ns and (self._credit(part, cut(first, until_ns)) or 0) < before:
                unsure = True  # the machine was so busy that the programs had no time for it
                continue
            lost.append(ClockDifference(Aspect.CRITERION, whole.title, _words(before), _words(after)))
        return Comparison(tuple(lost), unsure)

    def _judged(
        self, criterion: Criterion, earned: Fraction, pairs: Sequence[tuple[AssessedTrace, AssessedTrace]]
    ) -> Iterator[tuple[Fraction, Fraction | None]]:
        """Yield the credit in both recordings for each cut at which the first one shows all that it earns."""
        for before, after in pairs:
            credit = self._credit(criterion, before)
            if credit is None or credit < earned:
                continue
            if all(self._credit(criterion, part) == credit for part in _without_first(before)):
                yield credit, self._credit(criterion, after)

    def _credit(self, criterion: Criterion, trace: AssessedTrace) -> Fraction | None:
        """Return the share of its points that a criterion earns; None if it cannot be judged."""
        finding = run_check(criterion, self._exercise, {self._scenario: trace}, self._submission, self._sources).finding
        return None if finding is None else Fraction(finding.credit)


def _words(credit: Fraction) -> str:
    return "met" if credit == 1 else "partly met" if credit else "not met"


def cut(trace: AssessedTrace, stop_ns: int) -> AssessedTrace:
    """Return a recording as if it had been stopped earlier."""
    if stop_ns >= trace.stop_ns:
        return replace(trace, observations=tuple(o for o in trace.observations if o.t_ns < trace.stop_ns))
    return replace(trace, stop_ns=stop_ns, observations=tuple(o for o in trace.observations if o.t_ns < stop_ns))


def _without_first(trace: AssessedTrace) -> Iterator[AssessedTrace]:
    """Yield what is recorded if the first messages of each topic are lost."""
    first_ns: dict[str, int] = {}
    for message in trace.messages():
        first_ns.setdefault(message.topic, message.t_ns)
    for lost_ns in LOST_NS if first_ns else ():
        kept = (o for o in trace.observations if not isinstance(o, Message) or o.t_ns >= first_ns[o.topic] + lost_ns)
        yield replace(trace, observations=tuple(kept))
