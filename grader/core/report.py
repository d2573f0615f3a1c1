"""Everything that is shown to people: reports (format version 1), summaries of what nodes did, and explanations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from grader.core.chart import Excerpt, Figure
from grader.core.checkup import Property
from grader.core.exercise import Feedback, Location, Outcome, Problem, Variant
from grader.core.trace import ClockKind, Endpoint, Fault, GraphSnapshot, LogRecord, Offer, OutputLine, Start

SCHEMA = "grader/report/v1"
#: Prefix of the reason of a criterion that is blocked by another one.
NOT_JUDGED = "not judged: "


@dataclass(frozen=True, slots=True)
class Verdict:
    """The result of one criterion.

    Attributes:
        id: Criterion id.
        title: Criterion title.
        outcome: See Outcome.
        score: Points earned.
        max_score: Maximum points.
        reason: One sentence, no markup.
        hint: One thing to do; empty if there is none.
        location: Place in the student's file.
        evidence: Plain JSON values.
        blocked_by: Id of the criterion that has to be met before this one can be judged; empty if there is none.
        missing_file: The missing file that both need, if that is the reason; empty otherwise.
        same_cause_as: Id of the criterion that lost its points for the same cause and explains it; empty if none does.
        problem: The problem that its check found, for programs; None if the check finds only one, or a fault.
    """

    id: str
    title: str
    outcome: Outcome
    score: Fraction
    max_score: Fraction
    reason: str
    hint: str = ""
    location: Location | None = None
    evidence: Mapping[str, Any] = field(default_factory=dict)
    blocked_by: str = ""
    missing_file: str = ""
    same_cause_as: str = ""
    problem: Problem | None = None


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
    """The part of a report on one exercise.

    Attributes:
        id: Exercise id.
        number: Number in the chapter, as text.
        title: Exercise title.
        required: Whether the chapter requires it.
        clock: The wall clock if any of its scenarios ran on it.
        clock_reason: Why it was not the virtual clock; empty if it was.
        verdicts: In rubric order.
        faults: In order of scenario and time.
        notes: Sentences that readers must know.
        graph: The ROS graph of the exercise, if one was recorded with all its processes.
        figures: Charts of what the nodes did; left out in plain-text and data formats.
        excerpts: The source around the places that verdicts and faults name.
        expected: Criterion id -> what it requires, in one phrase.
        feedback: Criterion id -> how much of its result a student sees; not shown in reports.
        situations: Criterion id -> scenario that it is judged on; not shown in reports.
        variant: The values of this student's variant; None if there are none.
        starts: How each file was started; empty in reports on evidence of earlier versions.
    """

    id: str
    number: str
    title: str
    required: bool
    clock: ClockKind
    clock_reason: str
    verdicts: tuple[Verdict, ...]
    faults: tuple[ReportedFault, ...] = ()
    notes: tuple[str, ...] = ()
    graph: GraphSnapshot | None = None
    figures: tuple[Figure, ...] = ()
    excerpts: tuple[Excerpt, ...] = ()
    expected: Mapping[str, str] = field(default_factory=dict)
    feedback: Mapping[str, Feedback] = field(default_factory=dict)
    situations: Mapping[str, str] = field(default_factory=dict)
    variant: Variant | None = None
    starts: tuple[Start, ...] = ()

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
    """The software that a report was made with.

    Attributes:
        grader: Version of the grader.
        ros_distro: ROS release.
        rclpy: Version of rclpy.
        rmw: The middleware.
        python: Version of Python.
        isolation: Name of the sandbox tier; `none` without a sandbox.
        containment: What the self-test found the tier to prevent; empty without a sandbox.
    """

    grader: str
    ros_distro: str
    rclpy: str
    rmw: str
    python: str
    isolation: str
    containment: tuple[Property, ...] = ()


@dataclass(frozen=True, slots=True)
class Reproduction:
    """What is needed to reproduce a report, besides the versions of its environment and its seed.

    Attributes:
        command: The arguments of the command, before shell quoting; empty if no command made the report.
        rubrics: Exercise id and digest of its rubric, in the order graded.
        recording: Digest of the /odom recording that was played; empty if none was.
    """

    command: tuple[str, ...] = ()
    rubrics: tuple[tuple[str, str], ...] = ()
    recording: str = ""


@dataclass(frozen=True, slots=True)
class Report:
    """The result of grading one submission.

    Attributes:
        name: Submission name.
        path: Where it came from, as the user typed it.
        digest: Submission digest.
        environment: What it was made with.
        seed: The seed of every drawn value, printed so that a run can be repeated; None if it is not shown.
        exercises: In the order graded.
        duration_s: Wall time of the run; the only value that differs between two runs.
        notes: Sentences about the submission's files.
        reproduce: How to reproduce this report.
        pending: Ids of the exercises that were not graded yet when the report was made; their criteria are undecided.
            Empty for a complete report.
    """

    name: str
    path: str
    digest: str
    environment: Environment
    seed: int | None
    exercises: tuple[ExerciseReport, ...]
    duration_s: float
    notes: tuple[str, ...] = ()
    reproduce: Reproduction = Reproduction()
    pending: tuple[str, ...] = ()

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
        """Whether every criterion was decided."""
        return all(v.outcome is not Outcome.UNDECIDED for e in self.exercises for v in e.verdicts)

    @property
    def all_met(self) -> bool:
        """Whether every criterion is fully met."""
        return all(v.outcome is Outcome.MET for e in self.exercises for v in e.verdicts)


@dataclass(frozen=True, slots=True)
class Pace:
    """The rate of messages, as `ros2 topic hz` prints it; times in seconds.

    Attributes:
        rate_hz: (n - 1) / (t_last - t_first).
        min_s: Shortest interval.
        max_s: Longest interval.
        std_dev_s: Standard deviation of the intervals.
    """

    rate_hz: float
    min_s: float
    max_s: float
    std_dev_s: float


@dataclass(frozen=True, slots=True)
class TopicSummary:
    """One topic of the students' nodes.

    Attributes:
        name: Absolute name.
        types: Message types seen on it.
        publishers: Its publishers, in order of appearance.
        subscriptions: Its subscriptions, in order of appearance.
        messages: How many messages the nodes published on it.
        first_s: When the first one came; None if none came.
        pace: None for fewer than two messages at different times.
        ranges: Numeric field, dotted -> least and greatest value.
    """

    name: str
    types: tuple[str, ...]
    publishers: tuple[Endpoint, ...]
    subscriptions: tuple[Endpoint, ...]
    messages: int
    first_s: float | None
    pace: Pace | None
    ranges: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Summary:
    """What nodes did in one scenario, without a rubric and without a mark.

    Attributes:
        processes: Names of the files that ran.
        clock: Which clock they ran on.
        clock_reason: Why virtual time is not suitable for them; empty if it is.
        duration_s: How long they were observed.
        nodes: Node names, sorted.
        topics: Sorted by name.
        offers: Services, clients and parameters, as the processes say.
        records: Log records, in order.
        lines: Other output, in order.
        faults: In order.
        notes: Sentences a reader must know.
        graph: The richest snapshot of the graph, if there is any.
        isolation: The sandbox tier.
        starts: How each file was started.
    """

    processes: tuple[str, ...]
    clock: ClockKind
    clock_reason: str
    duration_s: float
    nodes: tuple[str, ...]
    topics: tuple[TopicSummary, ...]
    offers: tuple[Offer, ...]
    records: tuple[LogRecord, ...]
    lines: tuple[OutputLine, ...]
    faults: tuple[Fault, ...]
    notes: tuple[str, ...]
    graph: GraphSnapshot | None
    isolation: str
    starts: tuple[Start, ...] = ()


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a check.

    Attributes:
        name: As in rubrics.
        value: As a rubric writes it; empty where there is none.
        meaning: What the manual says of it.
        required: Whether a rubric has to give it.
    """

    name: str
    value: str
    meaning: str
    required: bool = False


@dataclass(frozen=True, slots=True)
class CheckExplanation:
    """What a check asks of a recording, whatever rubric uses it.

    Attributes:
        name: As in rubrics.
        asks: What it asks, in one sentence or two.
        details: How it measures that; may be empty.
        parameters: In order, with their defaults.
        used_by: Criteria that ask it, as `exercise/criterion`.
    """

    name: str
    asks: str
    details: str
    parameters: tuple[Parameter, ...]
    used_by: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CriterionExplanation:
    """What a criterion asks of a submission.

    Attributes:
        id: Criterion id.
        title: Criterion title.
        exercise: Number, title and id of its exercise.
        points: Points to be had.
        chapter: Which part of the chapter asks for it; empty if none does.
        needs: Criteria that must be met first.
        hint: What its rubric tells a student who did not meet it.
        situation: What runs, for how long, and what is published meanwhile.
        check: Name of the check.
        asks: What the check asks.
        details: How the check measures that.
        parameters: With the values of the rubric.
    """

    id: str
    title: str
    exercise: str
    points: Fraction
    chapter: str
    needs: tuple[str, ...]
    hint: str
    situation: str
    check: str
    asks: str
    details: str
    parameters: tuple[Parameter, ...]
