"""Exercises: the contents of a rubric file as values, and the interface of checks."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import field
from enum import Enum
from fractions import Fraction
from numbers import Rational, Real
from typing import TYPE_CHECKING, Any, ClassVar, Final, Protocol, TypeGuard

from grader.grading.model.measures import Measure, Measured, Reading, Scale, readings_of
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.projects import ExaminedPackage
from grader.runtime.model.scenario import Scenario
from grader.runtime.model.trace import AssessedTrace, Trace
from grader.runtime.stimuli import RecordedStream


class ProblemKind(Enum):
    """The kinds of problems that checks find; diagnosis and the page of a class tell problems apart by them."""

    ABSENT = "absent"  # there is no such publisher, subscription, server, node or parameter
    OTHER_NAME = "other_name"  # there is one of another name
    OTHER_TYPE = "other_type"  # there is one of another type
    SILENT = "silent"  # it is there, and sends nothing
    TOO_FEW = "too_few"  # fewer messages, requests or responses than expected
    TOO_MANY = "too_many"  # more of them
    TOO_EARLY = "too_early"  # everything was sent before anybody could have discovered the publisher
    TOO_LATE = "too_late"  # what is expected comes, but late
    WRONG_RATE = "wrong_rate"  # the time between messages, requests or logs is wrong
    RATE_CHANGES = "rate_changes"  # the rate is right on average, but not to the end
    BURSTS = "bursts"  # several messages arrive at once
    STOPPED = "stopped"  # messages arrived, then stopped
    NO_MESSAGE = "no_message"  # no message arrived
    NO_FIELD = "no_field"  # the message type has no such field
    NO_NUMBER = "no_number"  # the message type contains no number
    WRONG_VALUE = "wrong_value"  # a value differs from the expected one
    NOT_RANDOM = "not_random"  # the values follow a pattern
    CONSTANT = "constant"  # the values are all the same
    NEVER_CHANGES = "never_changes"  # the answer cannot change, because the input stays on one side of the threshold
    WRONG_ANSWER = "wrong_answer"  # an answer does not fit its input, or one of the two answers never occurs
    NO_ANSWER = "no_answer"  # an input or a request is never answered
    REFUSED = "refused"  # a goal or a transition is refused
    BEHIND = "behind"  # each answer fits an earlier input
    CONTRADICTION = "contradiction"  # two answers come at one instant
    KEPT_APART = "kept_apart"  # types or QoS of publisher and subscription are incompatible
    NO_EDGE = "no_edge"  # two processes are not connected in the graph
    COUNT_START = "count_start"  # a count starts at the wrong number
    ONE_PER_MESSAGE = "one_per_message"  # every message is logged
    NO_NODE = "no_node"  # a program writes, but has no node
    NOT_LOGGED = "not_logged"  # nothing is logged, or not all of it
    PRINTED = "printed"  # it is printed instead of logged
    AMONG_OTHERS = "among_others"  # the right values are logged among so many others that they prove nothing
    ERRORS_LOGGED = "errors_logged"  # records say that something failed
    ENDED = "ended"  # a program ends by itself too early
    STILL_RUNNING = "still_running"  # a program does not end when it is stopped


@dataclass(frozen=True, slots=True)
class Problem:
    """One problem."""

    kind: ProblemKind
    topics: tuple[str, ...] = ()  # the topics concerned, if a check looks at several
    # What tells problems of this kind apart, e.g. `swapped` for values in the wrong order; empty if nothing does
    detail: str = ""
    # The number that a count starts at; None for problems of other kinds; not shown in reports
    start: int | None = None


#: Values of `until` besides a date; only a platform knows when these events happen.
DUE_DATE, PUBLISHED = "due_date", "published"
_DATE = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}")


class Audience(str, Enum):
    """Who reads a report."""

    STUDENT = "student"
    INSTRUCTOR = "instructor"


class Shows(str, Enum):
    """How much of the result of a criterion a student sees, from everything to nothing."""

    ALL = "all"
    WITHOUT_NUMBERS = "reason_without_numbers"
    OUTCOME = "outcome_only"
    NOTHING = "nothing"


#: From the least to the most restrictive.
ORDER = tuple(Shows)


@dataclass(frozen=True, slots=True)
class Feedback:
    """What a student sees of one criterion."""

    shows: Shows = Shows.ALL  # how much of the result
    # The last day on which this applies, as `2026-12-01`; everything is shown afterwards. `due_date` and `published`
    # are events that only a platform knows; empty if it always applies.
    until: str = ""

    def on(self, day: str) -> Shows:
        """Return how much is shown on a day, written as `2026-12-01`."""
        over = _DATE.fullmatch(self.until) is not None and day > self.until
        return Shows.ALL if over else self.shows


#: The default if a rubric states no feedback policy.
OPEN = Feedback()


def strictest(shown: tuple[Shows, ...]) -> Shows:
    """Return the most restrictive level; `Shows.ALL` if there is none."""
    return max(shown, key=ORDER.index, default=Shows.ALL)


#: The value of a variant in a rubric.
Value = str | int | float | bool


@dataclass(frozen=True, slots=True)
class Variant:
    """The values of one exercise for one student."""

    student: str  # the student, as staff wrote the name; empty if the values belong to nobody
    values: tuple[tuple[str, Value], ...]  # name and value, in the order of the rubric

    @property
    def text(self) -> str:
        """The values with their names, for readers."""
        return ", ".join(f"{name.replace('_', ' ')} {written_value(value)}" for name, value in self.values)


@dataclass(frozen=True, slots=True)
class Drawn:
    """The values of all exercises for one student."""

    student: str  # the student
    values: Mapping[str, Mapping[str, Value]] = field(default_factory=dict)  # exercise id -> name -> value


def variant_notes(variant: Variant | None) -> tuple[str, ...]:
    """Return the notes of a report about the graded variant; empty if nothing varies."""
    return () if variant is None else (f"graded by the variant of {variant.student}: {variant.text}",)


def written_value(value: Value) -> str:
    """Format a value as in a rubric."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def exercise_name(number: str) -> str:
    """Return the name of an exercise: `Exercise 1` for the number 1, but `Project 1` if the number is `Project 1`."""
    return f"Exercise {number}" if number[:1].isdigit() else number


class Outcome(str, Enum):
    """The result of judging a criterion."""

    MET = "met"
    PARTLY = "partly"
    NOT_MET = "not_met"
    BLOCKED = "blocked"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Location:
    """A place in a student's file; lines count from 1.

    Raises:
        TypeError: The file is not a text, or the line not a whole number.
    """

    file: str
    line: int

    def __post_init__(self) -> None:
        """Check the types: checks that authors write make locations too."""
        if not isinstance(self.file, str) or isinstance(self.line, bool) or not isinstance(self.line, int):
            found = f"{type(self.file).__name__} and {type(self.line).__name__}"
            raise TypeError(f"Location: expected a file name and the number of a line, found {found}")


#: Denominators that a float may have as a share of points. With them, 0.7 + 0.2 + 0.1 is 1, and 1 - 1.0000000001 is 0:
#: a rounding error costs no points and is not a mistake. Points are shown with two decimals.
_FINEST_SHARE = 1_000_000


def exact_share(share: object) -> Fraction:
    """Return a share of the points as a fraction; a float becomes the nearest one with a denominator up to a million.

    Raises:
        TypeError: It is not a number.
        ValueError: It is not in the range from 0 to 1.
    """
    if isinstance(share, bool) or not isinstance(share, Real):
        raise TypeError(f"Finding: expected a credit from 0 to 1, found a {type(share).__name__}")
    if isinstance(share, Rational):
        exact = Fraction(share)
    elif math.isfinite(share):
        exact = Fraction(float(share)).limit_denominator(_FINEST_SHARE)
    else:
        raise ValueError(f"Finding: expected a credit from 0 to 1, found {float(share)}")
    if not 0 <= exact <= 1:
        raise ValueError(f"Finding: expected a credit from 0 to 1, found {float(share):g}")
    return exact


@dataclass(frozen=True, slots=True)
class Finding:
    """What a check found in a trace.

    Raises:
        TypeError: The credit is not a number, or something else than numbers was measured.
        ValueError: The credit is not in the range from 0 to 1.
    """

    credit: Fraction  # share of the points earned, in [0, 1]; may be given as any number, see `exact_share`
    reason: str  # one sentence in the form `where: what was found, what was expected`; no markup
    # Plain JSON values behind the reason; keys in a fixed order
    evidence: Mapping[str, Any] = field(default_factory=dict)
    location: Location | None = None  # place in the student's file, if the trace names one
    hint: str = ""  # one thing to do; empty if no advice is very likely to be right
    # The criterion that must be met before this one can be judged: its id, the name of its check, or a topic of which
    # it judges the logs (`Roles.logs`); credit is then 0
    blocked_by: str | None = None
    problem: Problem | None = None  # the problem found, if the check tells several problems apart
    # The reason in a few words, without the place of a fault, for terminals; empty if the reason itself is short
    brief: str = ""
    # What hint rules may read of it: a frozen dataclass, as in `grader/grading/judging/facts.py`; None if there is
    # nothing.
    # It is not shown in reports, so that a rule and a check can change it together
    facts: object = None
    # The numbers that the check measures (`Check.measures`), in its unit; infinite for what never came, such as a goal
    # that was not reached. A rubric with `full` and `none` gives the credit for them in place of `credit`
    measured: Measured = ()

    def __post_init__(self) -> None:
        """Make the credit a fraction, here and not later, so that the traceback shows the author's line."""
        object.__setattr__(self, "credit", exact_share(self.credit))
        readings_of(self.measured)

    @property
    def readings(self) -> tuple[Reading, ...]:
        """What was measured, one reading for each number."""
        return readings_of(self.measured)


@dataclass(frozen=True, slots=True)
class Roles:
    """What the parameters of a check are, by their names; a name that the check does not have is ignored.

    A parameter with one of the usual names, which are the defaults here, needs no declaration. The last six have no
    usual name: a check that declares them lets the general hint rules explain a topic that is silent or that nobody
    subscribes to, missing logs, and a service that nobody offers or calls. Criteria that need a sign of the data wait
    for one that declares `logs`. `grade rubric check` warns if no stimulus publishes on a topic that is `given`.
    """

    topics: tuple[str, ...] = ("input", "topic", "output", "forward", "back", "publishes", "subscribes")
    fields: tuple[str, ...] = ("field", "fields")  # field paths of the last topic
    services: tuple[str, ...] = ("service",)
    actions: tuple[str, ...] = ("action",)
    process: str = "process"  # the file that the check is about
    type: str = "type"  # the type of the topic
    hears: tuple[str, ...] = ()  # topics to which a node of the student's has to subscribe
    speaks: tuple[str, ...] = ()  # topics on which the check itself misses messages of the student's nodes
    logs: tuple[str, ...] = ()  # topics of which the process has to log what arrives
    given: tuple[str, ...] = ()  # topics of which the check reads what the grader publishes, and nobody else
    serves: tuple[str, ...] = ()  # services that a node of the student's has to offer
    calls: tuple[str, ...] = ()  # services that a node of the student's has to call


#: The value of `drawing` of a check whose picture is the graph of nodes and topics.
NODE_GRAPH: Final = "node graph"


class Check(Protocol):
    """A typed question about a trace: a frozen dataclass whose fields are the rubric's parameters.

    A check needs `judge`. It may have the other members, which are all that the grader looks for; without them, the
    values here apply. The docstring of the class is its manual, with the parameters listed under `Attributes:`.
    """

    def judge(self, trace: Trace) -> Finding:
        """Judge the trace. This is a pure function, and nothing that a student does makes it raise."""

    if not TYPE_CHECKING:  # for type checkers, every member of a protocol is required
        #: What the parameters are, for charts and for hint rules.
        roles: ClassVar[Roles] = Roles()
        #: What it measures, if a rubric may give a share of the points for a number: `full` and `none`.
        measures: ClassVar[Measure | None] = None

        @property
        def expected(self) -> str:
            """What the check expects, in one phrase without a full stop, from its parameters; empty for none."""
            return ""

        def drawing(self, trace: Trace) -> Any:
            """Return a `Drawing` or a `Chart` of what was judged; None for no picture.

            Without this method, a check gets a chart of the topics, services and actions that its parameters name. The
            attribute `drawing = NODE_GRAPH` in place of the method chooses the graph of nodes and topics.
            """

        def judge_sources(self, trace: Trace, sources: Mapping[str, str]) -> Finding:
            """Judge the trace and the text of the students' files, by their required names; called in place of `judge`.

            It is a pure function too.
            """

        def of_beginning(self) -> Check | None:
            """Return the check that judges the beginning of a recording; None if only a whole recording can be judged.

            Spot checks judge the first seconds of a scenario, recorded again on the wall clock. Without this method,
            a beginning is judged like a whole recording, and counts only if the same seconds in virtual time suffice.
            """


def has_member(check: object, member: str) -> bool:
    """Return whether a check has an optional member of `Check` of its own."""
    return getattr(type(check), member, vars(Check)[member]) is not vars(Check)[member] or member in _own(check)


def _own(check: object) -> Mapping[str, object]:
    """Return the attributes that an instance has without slots, such as a parameter named `expected`."""
    return getattr(check, "__dict__", {})


class SourceCheck(Protocol):
    """A check that has `judge_sources`."""

    def judge_sources(self, trace: Trace, sources: Mapping[str, str]) -> Finding:
        """See `Check`."""


def reads_sources(check: object) -> TypeGuard[SourceCheck]:
    """Return whether a check also reads the students' files."""
    return has_member(check, "judge_sources")


class PackageCheck(Protocol):
    """A check of the ROS packages that were handed in, which asks nothing of a recording."""

    def judge_packages(self, packages: tuple[ExaminedPackage, ...]) -> Finding:
        """Judge the packages; a pure function."""


def reads_packages(check: object) -> TypeGuard[PackageCheck]:
    """Return whether a check judges the packages of a submission."""
    return hasattr(type(check), "judge_packages")


def ask(check: Check, trace: Trace, sources: Mapping[str, str] | None) -> Finding:
    """Return the finding of a check, which may need the students' files too, and sees only what was recorded."""
    trace = trace.recorded if isinstance(trace, AssessedTrace) else trace
    if sources is not None and reads_sources(check):
        return check.judge_sources(trace, sources)
    return check.judge(trace)


def of_beginning(check: Check) -> Check | None:
    """Return the check that judges the beginning of a recording on the wall clock; None if none can."""
    if not has_member(check, "of_beginning"):
        return check
    found: Check | None = check.of_beginning()  # type: ignore[attr-defined]
    return found


def roles_of(kind: type) -> Roles:
    """Return the roles of a class's parameters: what it declares, else those of the usual names."""
    declared: object = getattr(kind, "roles", None)
    return declared if isinstance(declared, Roles) else Roles()


def measure_of(check: object) -> Measure | None:
    """Return what a check, or a class of checks, measures; None if it measures nothing."""
    declared: object = getattr(check, "measures", None)
    return declared if isinstance(declared, Measure) else None


def texts_under(check: object, *parameters: str) -> tuple[str, ...]:
    """Return the texts that a check holds under the names of parameters, without duplicates and empty ones."""
    found = (getattr(check, name, None) for name in parameters)
    return tuple(dict.fromkeys(text for text in found if isinstance(text, str) and text))


@dataclass(frozen=True, slots=True)
class Criterion:
    """One row of a rubric."""

    id: str  # unique within the exercise; never changes
    title: str  # its title
    points: Fraction  # above 0
    scenario: str  # id of the scenario whose trace is judged
    check: Check  # the check that judges it
    needs: tuple[str, ...] = ()  # ids of criteria that must be met or partly met before this one is judged
    hint: str = ""  # hint for a student who did not meet it, if the check has no better one
    # The part of the course text that requires it, e.g. `Exercise 1, acceptance criterion 2`; may be empty
    chapter: str = ""
    feedback: Feedback = OPEN  # how much of its result a student sees
    check_name: str = field(default="", compare=False)  # name of its check in the rubric
    scale: Scale | None = None  # which numbers of the check earn which share of the points; None if it is met or not


class HintRule(Protocol):
    """A rule that explains lost points: `grader/grading/judging/diagnosis/rules.py` has the class."""

    @property
    def id(self) -> str:
        """Its name, which reports state."""

    @property
    def priority(self) -> int:
        """Its place among all rules: the one with the lowest number is asked first."""


@dataclass(frozen=True, slots=True)
class Exercise:
    """One rubric file."""

    id: str  # unique, e.g. `velocity_publisher`
    number: str  # number in the chapter, as text
    title: str  # its title
    required: bool  # whether the chapter requires it
    files: tuple[str, ...]  # file names that a submission must contain, in order
    scenarios: tuple[Scenario, ...]  # its scenarios, in the order of recording
    criteria: tuple[Criterion, ...]  # its criteria, in order
    digest: str  # `sha256:` digest of the rubric file and of the files that it brings
    by_request: bool = False  # whether it is graded only on request
    variant: Variant | None = None  # the values for this student; None if nothing varies
    interfaces: tuple[str, ...] = ()  # paths of the folders with interface packages that the rubric brings
    bonus: Fraction = Fraction(0)  # points above the maximum that an instructor may give
    hints: Iterable[HintRule] = ()  # the rubric's own hint rules, in the order of its files
    # Scenario id -> ids of the scenarios that repeat it with other drawn values; only of those that are drawn again
    draws: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def wanted(self) -> tuple[str, ...]:
        """The files that a submission must contain, and the patterns of the recordings."""
        bags = (scenario.handed_in.bag for scenario in self.scenarios if scenario.handed_in is not None)
        return (*self.files, *dict.fromkeys(bags))

    def recordings_of(self, criterion: Criterion) -> tuple[str, ...]:
        """Return the ids of the scenarios that a criterion is judged on: its own, and those that repeat it."""
        return (criterion.scenario, *self.draws.get(criterion.scenario, ()))


def recordings_in(exercise: Exercise) -> tuple[RecordedStream, ...]:
    """Return the recordings that the scenarios of an exercise play."""
    return tuple(one for scenario in exercise.scenarios for one in scenario.stimuli if isinstance(one, RecordedStream))
