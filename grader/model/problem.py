"""Problems: what a check found wrong, as values that diagnosis asks for; reasons say the same in words."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class ProblemKind(Enum):
    """The kinds of problems that diagnosis tells apart; a check names one only where a diagnosis needs it."""

    BURSTS = "bursts"  # several messages come at once
    STOPPED = "stopped"  # messages came, and then no more
    NO_MESSAGE = "no_message"  # none ever came
    NO_NUMBER = "no_number"  # the type of the messages has no number in it
    CONSTANT = "constant"  # the values are all the same
    NEVER_CHANGES = "never_changes"  # the answer cannot change, because the input stays on one side of the threshold
    WRONG_ANSWER = "wrong_answer"  # an answer does not fit its input, or one of the two is never given
    KEPT_APART = "kept_apart"  # types or QoS keep publisher and subscription from talking to each other
    NO_EDGE = "no_edge"  # two processes are not joined in the graph
    COUNT_START = "count_start"  # a count starts at another number
    ONE_PER_MESSAGE = "one_per_message"  # there is a log for every message


@dataclass(frozen=True, slots=True)
class Problem:
    """One problem.

    Attributes:
        kind: What is wrong.
        topics: The topics that it is about, where a check looks at several.
        start: The number that a count starts at; None for problems of other kinds.
    """

    kind: ProblemKind
    topics: tuple[str, ...] = ()
    start: int | None = None
