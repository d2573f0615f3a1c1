"""The public interface: what examples, rubrics of one's own and other programs may import; any other name is private.

    from grader.api import Finding, Trace, met, not_met

`grader.api.unstable` has more, which may change between versions. A name is imported when it is first looked up, since
simulations import this module in the worker, which has neither msgspec nor pydantic, and all of it takes half a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grader.api.lazily import homes, look_up

if TYPE_CHECKING:
    from grader.course.classroom.local import Attempt as Attempt
    from grader.course.classroom.local import ClassScheduler as ClassScheduler
    from grader.course.classroom.local import failed_attempt as failed_attempt
    from grader.course.classroom.receiving import UnwantedError as UnwantedError
    from grader.course.classroom.receiving import grade_packed as grade_packed
    from grader.course.classroom.schedulers import Connect as Connect
    from grader.course.classroom.sending import pack_task as pack_task
    from grader.course.classroom.sending import store_answer as store_answer
    from grader.grading.judging.diagnosis.rules import Case as Case
    from grader.grading.judging.diagnosis.rules import Clue as Clue
    from grader.grading.judging.diagnosis.rules import Crash as Crash
    from grader.grading.judging.diagnosis.rules import Rule as Rule
    from grader.grading.judging.diagnosis.rules import crash_rule as crash_rule
    from grader.grading.judging.diagnosis.rules import hint_rule as hint_rule
    from grader.grading.judging.facts import RateFacts as RateFacts
    from grader.grading.judging.findings import explain_fault as explain_fault
    from grader.grading.judging.findings import explain_no_client as explain_no_client
    from grader.grading.judging.findings import explain_no_message as explain_no_message
    from grader.grading.judging.findings import explain_no_server as explain_no_server
    from grader.grading.judging.findings import explain_no_subscription as explain_no_subscription
    from grader.grading.judging.findings import met as met
    from grader.grading.judging.findings import not_met as not_met
    from grader.grading.judging.findings import partly as partly
    from grader.grading.judging.logs.outputs import printed_lines as printed_lines
    from grader.grading.judging.logs.outputs import student_records as student_records
    from grader.grading.judging.plots import Drawing as Drawing
    from grader.grading.judging.plots import Plot as Plot
    from grader.grading.judging.service_calls import Call as Call
    from grader.grading.judging.service_calls import calls_of as calls_of
    from grader.grading.judging.values import delivered as delivered
    from grader.grading.judging.values import delivered_numbers as delivered_numbers
    from grader.grading.judging.values import number_at as number_at
    from grader.grading.judging.values import published as published
    from grader.grading.judging.values import published_numbers as published_numbers
    from grader.grading.judging.values import value_at as value_at
    from grader.grading.model.chart import Band as Band
    from grader.grading.model.chart import Chart as Chart
    from grader.grading.model.chart import Level as Level
    from grader.grading.model.chart import Look as Look
    from grader.grading.model.chart import Panel as Panel
    from grader.grading.model.chart import Point as Point
    from grader.grading.model.chart import Series as Series
    from grader.grading.model.chart import Tone as Tone
    from grader.grading.model.exercise import NODE_GRAPH as NODE_GRAPH
    from grader.grading.model.exercise import Check as Check
    from grader.grading.model.exercise import Finding as Finding
    from grader.grading.model.exercise import Location as Location
    from grader.grading.model.exercise import Outcome as Outcome
    from grader.grading.model.exercise import Problem as Problem
    from grader.grading.model.exercise import ProblemKind as ProblemKind
    from grader.grading.model.exercise import Roles as Roles
    from grader.grading.model.measures import Measure as Measure
    from grader.grading.model.measures import Reading as Reading
    from grader.grading.model.report import ExerciseReport as ExerciseReport
    from grader.grading.model.report import Report as Report
    from grader.grading.model.report import Summary as Summary
    from grader.grading.model.report import Verdict as Verdict
    from grader.grading.reporting.escape import csv_cell as csv_cell
    from grader.grading.reporting.escape import shown as shown
    from grader.grading.reporting.escape import shown_lines as shown_lines
    from grader.grading.reporting.formats import Format as Format
    from grader.grading.reporting.json_report import report_to_json as report_to_json
    from grader.runtime.model.errors import ClassError as ClassError
    from grader.runtime.model.errors import EnvironmentFault as EnvironmentFault
    from grader.runtime.model.errors import EvidenceError as EvidenceError
    from grader.runtime.model.errors import GraderError as GraderError
    from grader.runtime.model.errors import HarnessError as HarnessError
    from grader.runtime.model.errors import KeyFileError as KeyFileError
    from grader.runtime.model.errors import RecordingError as RecordingError
    from grader.runtime.model.errors import RubricError as RubricError
    from grader.runtime.model.errors import SubmissionError as SubmissionError
    from grader.runtime.model.errors import VariantError as VariantError
    from grader.runtime.model.quantities import NS_PER_S as NS_PER_S
    from grader.runtime.model.quantities import ActionType as ActionType
    from grader.runtime.model.quantities import DurationNs as DurationNs
    from grader.runtime.model.quantities import FieldNumber as FieldNumber
    from grader.runtime.model.quantities import FieldOf as FieldOf
    from grader.runtime.model.quantities import Hertz as Hertz
    from grader.runtime.model.quantities import MessageType as MessageType
    from grader.runtime.model.quantities import Pattern as Pattern
    from grader.runtime.model.quantities import ServiceType as ServiceType
    from grader.runtime.model.quantities import Topic as Topic
    from grader.runtime.model.quantities import seconds as seconds
    from grader.runtime.model.quantities import within as within
    from grader.runtime.model.trace import ClockKind as ClockKind
    from grader.runtime.model.trace import Delivery as Delivery
    from grader.runtime.model.trace import Endpoint as Endpoint
    from grader.runtime.model.trace import Fault as Fault
    from grader.runtime.model.trace import FaultKind as FaultKind
    from grader.runtime.model.trace import GraphSnapshot as GraphSnapshot
    from grader.runtime.model.trace import LogRecord as LogRecord
    from grader.runtime.model.trace import Mark as Mark
    from grader.runtime.model.trace import Message as Message
    from grader.runtime.model.trace import OutputLine as OutputLine
    from grader.runtime.model.trace import Request as Request
    from grader.runtime.model.trace import Response as Response
    from grader.runtime.model.trace import ServiceEnd as ServiceEnd
    from grader.runtime.model.trace import Trace as Trace
    from grader.runtime.served_actions import GoalAborted as GoalAborted
    from grader.runtime.served_actions import GoalCanceled as GoalCanceled
    from grader.runtime.served_actions import GoalRejected as GoalRejected
    from grader.runtime.simulation import Box as Box
    from grader.runtime.simulation import DifferentialDrive as DifferentialDrive
    from grader.runtime.simulation import Moment as Moment
    from grader.runtime.simulation import Obstacle as Obstacle
    from grader.runtime.simulation import Output as Output
    from grader.runtime.simulation import RobotInMap as RobotInMap
    from grader.runtime.simulation import Simulation as Simulation
    from grader.runtime.simulation import Sketch as Sketch
    from grader.runtime.simulation import Turtle as Turtle
    from grader.runtime.simulation import Unicycle as Unicycle
    from grader.testing import TraceBuilder as TraceBuilder
    from grader.testing import builtin_check as builtin_check
    from grader.testing import explain as explain
    from grader.testing import judge as judge
    from grader.world.asking import GoalHandle as GoalHandle
    from grader.world.asking import GoalResult as GoalResult
    from grader.world.asking import PendingCall as PendingCall
    from grader.world.asking import Received as Received
    from grader.world.errors import NoMessage as NoMessage
    from grader.world.errors import NoTransform as NoTransform
    from grader.world.errors import ParameterRejected as ParameterRejected
    from grader.world.errors import ProgramFailed as ProgramFailed
    from grader.world.errors import RecordingDiffers as RecordingDiffers
    from grader.world.errors import StepTimeout as StepTimeout
    from grader.world.errors import WrongType as WrongType
    from grader.world.frames import FrameTransform as FrameTransform
    from grader.world.opening import Worlds as Worlds
    from grader.world.opening import open_world as open_world
    from grader.world.running import Failure as Failure
    from grader.world.running import Launched as Launched
    from grader.world.started import Program as Program
    from grader.world.world import World as World

#: The public names by topic and by the module that they are in.
CONTENTS: dict[str, dict[str, str]] = {
    "Errors": {
        "grader.runtime.model.errors": (
            "GraderError RubricError SubmissionError RecordingError EvidenceError ClassError VariantError "
            "KeyFileError EnvironmentFault HarnessError"
        ),
    },
    "Results": {
        "grader.grading.model.report": "Report ExerciseReport Verdict Summary",
        "grader.grading.model.exercise": "Outcome",
    },
    "Checks": {
        "grader.grading.model.exercise": "Check Roles NODE_GRAPH Finding Problem ProblemKind Location",
        "grader.grading.model.measures": "Measure Reading",
        "grader.grading.judging.findings": (
            "met partly not_met explain_fault explain_no_message explain_no_subscription explain_no_server "
            "explain_no_client"
        ),
    },
    "Parameters": {
        "grader.runtime.model.quantities": (
            "DurationNs Hertz FieldNumber Topic MessageType ServiceType ActionType Pattern FieldOf"
        ),
    },
    "Recordings": {
        "grader.runtime.model.trace": (
            "Trace Message Delivery LogRecord OutputLine Request Response Fault FaultKind GraphSnapshot Endpoint "
            "ServiceEnd Mark ClockKind"
        ),
        "grader.grading.judging.values": ("published delivered published_numbers delivered_numbers value_at number_at"),
        "grader.grading.judging.logs.outputs": "student_records printed_lines",
        "grader.grading.judging.service_calls": "Call calls_of",
    },
    "Text": {
        "grader.runtime.model.quantities": "NS_PER_S seconds within",
    },
    "Charts": {
        "grader.grading.judging.plots": "Drawing Plot",
        "grader.grading.model.chart": "Chart Panel Series Point Band Level Look Tone",
    },
    "Hint rules": {
        "grader.grading.judging.diagnosis.rules": "Rule Clue Case Crash hint_rule crash_rule",
        "grader.grading.judging.facts": "RateFacts",
    },
    "Report formats": {
        "grader.grading.reporting.formats": "Format",
        "grader.grading.reporting.json_report": "report_to_json",
        "grader.grading.reporting.escape": "shown shown_lines csv_cell",
    },
    "Class schedulers": {
        "grader.course.classroom.schedulers": "Connect",
        "grader.course.classroom.local": "ClassScheduler Attempt failed_attempt",
        "grader.course.classroom.sending": "pack_task store_answer",
        "grader.course.classroom.receiving": "grade_packed UnwantedError",
    },
    "Simulations": {
        "grader.runtime.simulation": (
            "Simulation Moment Output Sketch DifferentialDrive RobotInMap Box Obstacle Turtle Unicycle"
        ),
    },
    "Own nodes, step by step": {
        "grader.world.opening": "open_world Worlds",
        "grader.world.world": "World",
        "grader.world.running": "Launched Failure",
        "grader.world.asking": "Received PendingCall GoalHandle GoalResult",
        "grader.world.frames": "FrameTransform",
        "grader.world.started": "Program",
        "grader.world.errors": (
            "ProgramFailed StepTimeout NoMessage NoTransform ParameterRejected RecordingDiffers WrongType"
        ),
        "grader.runtime.served_actions": "GoalRejected GoalAborted GoalCanceled",
    },
    "Tests": {
        "grader.testing": "TraceBuilder judge explain builtin_check",
    },
}
_HOMES = homes(CONTENTS)

__all__ = ["grade", "observe", "rejudge", *_HOMES]  # noqa: PLE0604  the table is the list


def __getattr__(name: str) -> Any:
    """Import a public name when it is first looked up."""
    return look_up(globals(), _HOMES, name)


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)


def grade(  # noqa: PLR0913  options of the command
    submission: str | Path,
    *,
    rubrics: Sequence[str | Path] = (),
    exercises: Sequence[str] = (),
    seed: int | None = None,
    interfaces: Sequence[str | Path] = (),
    clock: str = "auto",
    isolation: str = "auto",
    evidence: str | Path | None = None,
) -> Report:
    """Grade a submission, as `grade SUBMISSION` does.

    Args:
        submission: A folder, an archive, or a `.py` file.
        rubrics: Rubric files; without any, the exercises that come with the grader.
        exercises: Exercises to grade, by id or number; all of the rubrics if empty.
        seed: Seed of all drawn values; drawn from the submission if None.
        interfaces: Folders with packages of messages that are not installed.
        clock: `virtual`, `wall`, or `auto`.
        isolation: `auto`, `none`, or the name of a sandbox.
        evidence: A new folder that keeps the recordings, for `rejudge`; None to keep none.

    Raises:
        GraderError: The submission, a rubric or the machine cannot be used; its class says who must act.
    """
    from grader.grading.app import start  # noqa: PLC0415  takes long
    from grader.grading.app.keeping import EvidenceWriter  # noqa: PLC0415
    from grader.grading.app.request import GradeRequest  # noqa: PLC0415

    request = GradeRequest(
        str(submission),
        exercises=tuple(exercises),
        rubrics=tuple(map(Path, rubrics)),
        seed=seed,
        interfaces=tuple(map(Path, interfaces)),
        clock=clock,
        isolation=isolation,
    )
    writer = EvidenceWriter([Path(evidence)] if evidence is not None else [], request)
    report = start.grade_once(request, _quiet, writer.remember)
    writer.write(report)
    return report


def observe(
    *programs: str | Path,
    duration_s: float = 10.0,
    interfaces: Sequence[str | Path] = (),
    clock: str = "auto",
    isolation: str = "auto",
) -> Summary:
    """Run programs together without a rubric, as `grade observe PROGRAM...` does, and return what they did.

    Args:
        programs: Python files, launch files, packages, workspaces, or executables as `FOLDER/NAME`.
        duration_s: How long they run, in seconds of their clock.
        interfaces: Folders with packages of messages that are not installed.
        clock: `virtual`, `wall`, or `auto`.
        isolation: `auto`, `none`, or the name of a sandbox.

    Raises:
        GraderError: A program or the machine cannot be used; its class says who must act.
    """
    from grader.grading.app.observe import ObserveRequest  # noqa: PLC0415  takes long
    from grader.grading.app.observe import observe_programs as observed  # noqa: PLC0415
    from grader.runtime.model.quantities import nanoseconds  # noqa: PLC0415

    files, folders = tuple(map(Path, programs)), tuple(map(Path, interfaces))
    request = ObserveRequest(files, nanoseconds(duration_s), clock=clock, isolation=isolation, interfaces=folders)
    return observed(request, _quiet)


def rejudge(evidence: str | Path, *, rubrics: Sequence[str | Path] = (), exercises: Sequence[str] = ()) -> Report:
    """Judge kept recordings again without running anything, as `grade rejudge EVIDENCE` does.

    Args:
        evidence: The folder that `grade` kept.
        rubrics: Rubric files; without any, the exercises that come with the grader.
        exercises: Exercises to judge; those that were graded if empty.

    Raises:
        EvidenceError: The folder is damaged, or has no recording of these exercises.
        RubricError: A rubric cannot be used.
    """
    from grader.grading.app.rejudge import judgement  # noqa: PLC0415  takes long
    from grader.grading.app.rejudge import rejudge_evidence as judged_again  # noqa: PLC0415
    from grader.grading.evidence.store import open_evidence  # noqa: PLC0415

    how = judgement(tuple(exercises), tuple(map(Path, rubrics)), pictures=True)
    return judged_again(open_evidence(Path(evidence)), how)


def _quiet(step: str) -> None:
    """Report progress to nobody."""
