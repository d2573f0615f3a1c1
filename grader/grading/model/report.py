"""Everything that is shown to people: reports (format version 1), summaries of what nodes did, and explanations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from typing import Any, TypeAlias

from grader.grading.model.chart import Excerpt, Figure, SourceFile
from grader.grading.model.exercise import Audience, Feedback, Location, Outcome, Problem, Variant
from grader.runtime.model.author_files import AuthorMistake
from grader.runtime.model.checkup import Property
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ALL_MET, NOT_ALL_MET, UNDECIDED, UNUSABLE
from grader.runtime.model.packages import BroughtPackage
from grader.runtime.model.trace import ClockKind, Endpoint, Fault, GraphSnapshot, LogRecord, Offer, OutputLine, Start

#: JSON values, as in reports, evidence and decoded messages.
JsonValue: TypeAlias = bool | int | float | str | Sequence["JsonValue"] | Mapping[str, "JsonValue"] | None
JsonObject: TypeAlias = Mapping[str, JsonValue]

SCHEMA = "grader/report/v1"
#: Prefix of the reason of a criterion that is blocked by another one.
NOT_JUDGED = "not judged: "
#: Evidence key for the mistake of a rubric's author that leaves a criterion undecided: its file, line and text.
AUTHOR_MISTAKE = "author_mistake"
#: The key of the evidence that says that the submission itself may be why a criterion is undecided.
SUBMISSION_SUSPECTED = "submission_suspected"


@dataclass(frozen=True, slots=True)
class Verdict:
    """The result of one criterion."""

    id: str
    title: str
    outcome: Outcome
    score: Fraction
    max_score: Fraction
    reason: str  # one sentence, no markup
    hint: str = ""  # one thing to do; empty if there is none
    location: Location | None = None  # place in the student's file
    evidence: Mapping[str, Any] = field(default_factory=dict)  # plain JSON values
    blocked_by: str = ""  # id of the criterion that has to be met before this one can be judged; empty if there is none
    missing_file: str = ""  # the missing file that it needs, if that is the reason; empty otherwise
    # Id of the criterion that lost its points for the same cause and explains it; empty if none does
    same_cause_as: str = ""
    # The problem that its check found, for programs; None if the check finds only one, or a fault
    problem: Problem | None = None
    # The reason in a few words, for terminals; empty if the reason itself is short. Not shown in other reports.
    brief: str = ""
    # Id of the scenario whose recording decided, if its scenario is drawn several times; not shown in reports
    recording: str = ""

    @property
    def suspected(self) -> bool:
        """Whether it is undecided for a reason that the submission itself may have caused."""
        return self.outcome is Outcome.UNDECIDED and self.evidence.get(SUBMISSION_SUSPECTED) is True

    @property
    def author_mistake(self) -> str:
        """The mistake of the rubric's author that leaves it undecided, with its place; empty if there is none."""
        found = self.evidence.get(AUTHOR_MISTAKE)
        return str(AuthorMistake(**found)) if self.outcome is Outcome.UNDECIDED and found else ""


@dataclass(frozen=True, slots=True)
class ReportedFault:
    """A fault as the report shows it; `t_ns` since the start of its scenario, `frames` the student's own."""

    kind: str
    file: str
    line: int
    text: str
    t_ns: int
    scenario: str
    frames: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ExerciseReport:
    """The part of a report on one exercise."""

    id: str
    number: str  # number in the chapter, as text
    title: str
    required: bool  # whether the chapter requires it
    clock: ClockKind  # the wall clock if any of its scenarios ran on it
    clock_reason: str  # why it was not the virtual clock; empty if it was
    verdicts: tuple[Verdict, ...]  # in rubric order
    faults: tuple[ReportedFault, ...] = ()  # in order of scenario and time
    notes: tuple[str, ...] = ()  # sentences that readers must know
    graph: GraphSnapshot | None = None  # the ROS graph of the exercise, if one was recorded with all its processes
    figures: tuple[Figure, ...] = ()  # charts of what the nodes did; left out in plain-text and data formats
    excerpts: tuple[Excerpt, ...] = ()  # the source around the places that verdicts and faults name
    sources: tuple[SourceFile, ...] = ()  # the student's files, left out in plain-text and data formats
    expected: Mapping[str, str] = field(default_factory=dict)  # criterion id -> what it requires, in one phrase
    # Criterion id -> how much of its result a student sees; not shown in reports
    feedback: Mapping[str, Feedback] = field(default_factory=dict)
    # Criterion id -> scenario that it is judged on; not shown in reports
    situations: Mapping[str, str] = field(default_factory=dict)
    variant: Variant | None = None  # the values of this student's variant; None if there are none
    starts: tuple[Start, ...] = ()  # how each file was started
    unchecked: str = ""  # why a check on the wall clock ended without a result; empty if it had one, or none was due

    @property
    def score(self) -> Fraction:
        """Points earned."""
        return sum((v.score for v in self.verdicts), Fraction(0))

    @property
    def max_score(self) -> Fraction:
        """Points to be had."""
        return sum((v.max_score for v in self.verdicts), Fraction(0))


@dataclass(frozen=True, slots=True)
class Environment:
    """The software that a report was made with."""

    grader: str
    ros_distro: str
    rclpy: str
    rmw: str
    python: str
    isolation: str  # name of the sandbox tier; `none` without a sandbox
    containment: tuple[Property, ...] = ()  # what the self-test found the tier to prevent; empty without a sandbox


@dataclass(frozen=True, slots=True)
class Reproduction:
    """What is needed to reproduce a report, besides the versions of its environment and its seed."""

    # The arguments of the command, before shell quoting; empty if no command made the report
    command: tuple[str, ...] = ()
    rubrics: tuple[tuple[str, str], ...] = ()  # exercise id and digest of its rubric, in the order graded
    recording: str = ""  # digest of the recordings that were played; empty if none was


@dataclass(frozen=True, slots=True)
class Report:
    """The result of grading one submission."""

    name: str
    path: str  # where it came from, as the user typed it
    digest: str
    environment: Environment  # what it was made with
    seed: int | None  # the seed of every drawn value, printed so that a run can be repeated; None if it is not shown
    exercises: tuple[ExerciseReport, ...]  # in the order graded
    duration_s: float  # wall time of the run; the only value that differs between two runs
    notes: tuple[str, ...] = ()  # sentences about the submission's files and the machine
    # Those of `notes` that tell students nothing: on the machine, its sandbox and the key of drawn values
    staff_notes: tuple[str, ...] = ()
    reproduce: Reproduction = Reproduction()
    # Ids of the exercises that were not graded yet when the report was made; their criteria are undecided. Empty for a
    # complete report.
    pending: tuple[str, ...] = ()
    # Who reads it; students get no notes, digests or commands that only help whoever runs the grader
    audience: Audience = Audience.INSTRUCTOR
    interfaces: tuple[BroughtPackage, ...] = ()  # the interface packages that are not installed, sorted by name

    @property
    def score(self) -> Fraction:
        """Points earned."""
        return sum((e.score for e in self.exercises), Fraction(0))

    @property
    def max_score(self) -> Fraction:
        """Points to be had."""
        return sum((e.max_score for e in self.exercises), Fraction(0))

    @property
    def final(self) -> bool:
        """Whether every criterion was decided, and every check that was due came to a result."""
        decided = all(v.outcome is not Outcome.UNDECIDED for e in self.exercises for v in e.verdicts)
        return decided and not any(exercise.unchecked for exercise in self.exercises)

    @property
    def all_met(self) -> bool:
        """Whether every criterion is fully met."""
        return all(v.outcome is Outcome.MET for e in self.exercises for v in e.verdicts)


@dataclass(frozen=True, slots=True)
class Pace:
    """The rate of messages, as `ros2 topic hz` prints it; times in seconds."""

    rate_hz: float  # (n - 1) / (t_last - t_first)
    min_s: float
    max_s: float
    std_dev_s: float  # standard deviation of the intervals


@dataclass(frozen=True, slots=True)
class TopicSummary:
    """One topic of the students' nodes."""

    name: str  # absolute name
    types: tuple[str, ...]  # message types seen on it
    publishers: tuple[Endpoint, ...]  # its publishers, in order of appearance
    subscriptions: tuple[Endpoint, ...]  # its subscriptions, in order of appearance
    messages: int  # how many messages the nodes published on it
    first_s: float | None  # when the first one came; None if none came
    pace: Pace | None  # None for fewer than two messages at different times
    # Numeric field, dotted -> least and greatest value; `name[]` stands for all elements of an array
    ranges: Mapping[str, tuple[float, float]]
    # Text field, dotted -> its different values in order of appearance, `MOST_TEXTS` at most, and how many there were
    texts: Mapping[str, tuple[tuple[str, ...], int]] = field(default_factory=dict)
    # Array, dotted -> least and greatest number of elements
    lengths: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    # Boolean field, dotted -> its different values in order of appearance
    flags: Mapping[str, tuple[bool, ...]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Summary:
    """What nodes did in one scenario, without a rubric and without a mark."""

    processes: tuple[str, ...]  # names of the files that ran
    clock: ClockKind  # which clock they ran on
    clock_reason: str  # why virtual time is not suitable for them; empty if it is
    duration_s: float  # how long they were observed
    nodes: tuple[str, ...]  # node names, sorted
    topics: tuple[TopicSummary, ...]  # sorted by name
    offers: tuple[Offer, ...]  # services, clients and parameters, as the processes say
    records: tuple[LogRecord, ...]  # log records, in order
    lines: tuple[OutputLine, ...]  # other output, in order
    faults: tuple[Fault, ...]
    notes: tuple[str, ...]  # sentences a reader must know
    graph: GraphSnapshot | None  # the richest snapshot of the graph, if there is any
    isolation: str
    starts: tuple[Start, ...] = ()  # how each file was started
    hints: tuple[str, ...] = ()  # one thing to do about each of `faults`; empty where no cause is very likely


@dataclass(frozen=True, slots=True)
class CheckParameter:
    """One parameter of a check."""

    name: str  # as in rubrics
    value: str  # as a rubric writes it; empty where there is none
    meaning: str  # what the manual says of it
    required: bool = False  # whether a rubric has to give it


@dataclass(frozen=True, slots=True)
class CheckExplanation:
    """What a check asks of a recording, whatever rubric uses it."""

    name: str  # as in rubrics
    asks: str  # what it asks, in one sentence or two
    details: str  # how it measures that; may be empty
    parameters: tuple[CheckParameter, ...]  # in order, with their defaults
    used_by: tuple[str, ...]  # criteria that ask it, as `exercise/criterion`


@dataclass(frozen=True, slots=True)
class RuleExplanation:
    """What a hint rule explains."""

    name: str  # as reports name it
    priority: int  # its place among all rules: the lowest number is asked first
    about: str  # the mistake, in a sentence; may be empty
    checks: tuple[str, ...]  # the checks that it explains, by their names in rubrics; empty for any
    problem: str  # the problem that the check must have found, such as `wrong_rate`; empty for any
    fault: bool | None  # whether the program must have failed, or must not; None for either
    file: str  # the author's file that holds it; empty for a rule of the grader


@dataclass(frozen=True, slots=True)
class RuleTrial:
    """A criterion that lost points in a recording, and the rules that explain it."""

    criterion: str  # as `exercise/criterion`
    outcome: str
    reason: str
    # Name, priority, place and hint of each rule that applies, in their order: reports show the first. A place is
    # written `file:line`, and is empty if the rule does not name one
    rules: tuple[tuple[str, int, str, str], ...]
    silent: tuple[str, ...]  # the rubric's own rules that were asked and return nothing


@dataclass(frozen=True, slots=True)
class CriterionExplanation:
    """What a criterion asks of a submission."""

    id: str
    title: str
    exercise: str  # number, title and id of its exercise
    points: Fraction  # points to be had
    chapter: str  # which part of the chapter asks for it; empty if none does
    needs: tuple[str, ...]  # criteria that must be met first
    hint: str  # what its rubric tells a student who did not meet it
    situation: str  # what runs, for how long, and what is published meanwhile
    check: str
    asks: str  # what the check asks
    details: str  # how the check measures that
    parameters: tuple[CheckParameter, ...]  # with the values of the rubric


def report_exit_code(report: Report, min_score: Fraction | None) -> int:
    """Return the exit code for a report as its reader may see it.

    The share of the points, in percent, that counts as success is `min_score`; None requires every criterion.
    """
    if any(verdict.author_mistake for exercise in report.exercises for verdict in exercise.verdicts):
        return UNUSABLE
    if not report.final:
        return UNDECIDED
    reached = report.all_met if min_score is None else report.score * 100 >= report.max_score * min_score
    return ALL_MET if reached else NOT_ALL_MET
