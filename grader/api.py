"""The public interface: what examples, rubrics of one's own and other programs may import; any other name is private.

    from grader.api import Finding, Trace, met, not_met

A name is imported when it is first looked up, because simulations import this module in the worker, which has neither
msgspec nor pydantic, and because all of it takes half a second.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from grader.course.classroom.local import Attempt as Attempt
    from grader.course.classroom.local import ClassScheduler as ClassScheduler
    from grader.course.classroom.local import failed_attempt as failed_attempt
    from grader.course.classroom.receiving import UnwantedError as UnwantedError
    from grader.course.classroom.receiving import grade_packed as grade_packed
    from grader.course.classroom.schedulers import Connect as Connect
    from grader.course.classroom.sending import pack_task as pack_task
    from grader.course.classroom.sending import store_answer as store_answer
    from grader.grading.judging.charts import Lanes as Lanes
    from grader.grading.judging.charts import compared_panels as compared_panels
    from grader.grading.judging.charts import drawn_case as drawn_case
    from grader.grading.judging.charts import gaps_panel as gaps_panel
    from grader.grading.judging.charts import series as series
    from grader.grading.judging.charts import time_chart as time_chart
    from grader.grading.judging.checks.services import too_few_responses as too_few_responses
    from grader.grading.judging.diagnosis.rules import NO_SOURCE as NO_SOURCE
    from grader.grading.judging.diagnosis.rules import Case as Case
    from grader.grading.judging.diagnosis.rules import Clue as Clue
    from grader.grading.judging.diagnosis.rules import Crash as Crash
    from grader.grading.judging.diagnosis.rules import Maker as Maker
    from grader.grading.judging.diagnosis.rules import Rule as Rule
    from grader.grading.judging.diagnosis.rules import crash_rule as crash_rule
    from grader.grading.judging.diagnosis.rules import file_for as file_for
    from grader.grading.judging.diagnosis.rules import hint_rule as hint_rule
    from grader.grading.judging.diagnosis.rules import lines_of as lines_of
    from grader.grading.judging.diagnosis.rules import log_call as log_call
    from grader.grading.judging.diagnosis.rules import silent_topic as silent_topic
    from grader.grading.judging.diagnosis.rules import unheard_topic as unheard_topic
    from grader.grading.judging.diagnosis.values import draws as draws
    from grader.grading.judging.diagnosis.wiring import Constant as Constant
    from grader.grading.judging.diagnosis.wiring import Made as Made
    from grader.grading.judging.diagnosis.wiring import Pause as Pause
    from grader.grading.judging.diagnosis.wiring import Switch as Switch
    from grader.grading.judging.diagnosis.wiring import conditions as conditions
    from grader.grading.judging.diagnosis.wiring import constant as constant
    from grader.grading.judging.diagnosis.wiring import elsewhere_because as elsewhere_because
    from grader.grading.judging.diagnosis.wiring import given_leaf as given_leaf
    from grader.grading.judging.diagnosis.wiring import goes_to as goes_to
    from grader.grading.judging.diagnosis.wiring import head_of as head_of
    from grader.grading.judging.diagnosis.wiring import is_flag as is_flag
    from grader.grading.judging.diagnosis.wiring import is_log as is_log
    from grader.grading.judging.diagnosis.wiring import made as made
    from grader.grading.judging.diagnosis.wiring import made_for as made_for
    from grader.grading.judging.diagnosis.wiring import message_classes as message_classes
    from grader.grading.judging.diagnosis.wiring import names_in as names_in
    from grader.grading.judging.diagnosis.wiring import node_made as node_made
    from grader.grading.judging.diagnosis.wiring import number_in_code as number_in_code
    from grader.grading.judging.diagnosis.wiring import pauses as pauses
    from grader.grading.judging.diagnosis.wiring import publish_calls as publish_calls
    from grader.grading.judging.diagnosis.wiring import python_loggers as python_loggers
    from grader.grading.judging.diagnosis.wiring import reached as reached
    from grader.grading.judging.diagnosis.wiring import received as received
    from grader.grading.judging.diagnosis.wiring import roots as roots
    from grader.grading.judging.diagnosis.wiring import runs as runs
    from grader.grading.judging.diagnosis.wiring import short as short
    from grader.grading.judging.diagnosis.wiring import spins as spins
    from grader.grading.judging.diagnosis.wiring import switches as switches
    from grader.grading.judging.diagnosis.wiring import target_of as target_of
    from grader.grading.judging.diagnosis.wiring import text_comparisons as text_comparisons
    from grader.grading.judging.diagnosis.wiring import text_in_code as text_in_code
    from grader.grading.judging.diagnosis.wiring import timer_code as timer_code
    from grader.grading.judging.diagnosis.wiring import used as used
    from grader.grading.judging.diagnosis.wiring import value_of as value_of
    from grader.grading.judging.diagnosis.wiring import variable_of as variable_of
    from grader.grading.judging.diagnosis.wiring import waits_for_ever as waits_for_ever
    from grader.grading.judging.facts import AnswerFacts as AnswerFacts
    from grader.grading.judging.facts import AnswerRow as AnswerRow
    from grader.grading.judging.facts import DrawFacts as DrawFacts
    from grader.grading.judging.facts import LogFacts as LogFacts
    from grader.grading.judging.facts import LogPaceFacts as LogPaceFacts
    from grader.grading.judging.facts import OtherEnd as OtherEnd
    from grader.grading.judging.facts import RateFacts as RateFacts
    from grader.grading.judging.facts import SeriesFacts as SeriesFacts
    from grader.grading.judging.facts import WrongLogFacts as WrongLogFacts
    from grader.grading.judging.findings import FAULT_KEY as FAULT_KEY
    from grader.grading.judging.findings import explain_fault as explain_fault
    from grader.grading.judging.findings import explain_no_client as explain_no_client
    from grader.grading.judging.findings import explain_no_message as explain_no_message
    from grader.grading.judging.findings import explain_no_server as explain_no_server
    from grader.grading.judging.findings import explain_no_subscription as explain_no_subscription
    from grader.grading.judging.findings import fault_hint as fault_hint
    from grader.grading.judging.findings import fault_sentence as fault_sentence
    from grader.grading.judging.findings import faulted as faulted
    from grader.grading.judging.findings import first_fault as first_fault
    from grader.grading.judging.findings import met as met
    from grader.grading.judging.findings import not_met as not_met
    from grader.grading.judging.findings import only_printed as only_printed
    from grader.grading.judging.findings import partly as partly
    from grader.grading.judging.findings import waiting_for as waiting_for
    from grader.grading.judging.logs.matching import chance as chance
    from grader.grading.judging.logs.outputs import number_told as number_told
    from grader.grading.judging.logs.outputs import printed_lines as printed_lines
    from grader.grading.judging.logs.outputs import shape_of as shape_of
    from grader.grading.judging.logs.outputs import student_records as student_records
    from grader.grading.judging.logs.outputs import written as written
    from grader.grading.judging.plots import Drawing as Drawing
    from grader.grading.judging.plots import Plot as Plot
    from grader.grading.judging.plots import threshold_drawing as threshold_drawing
    from grader.grading.judging.series import lag_ns as lag_ns
    from grader.grading.judging.series import steps_behind as steps_behind
    from grader.grading.judging.service_calls import Call as Call
    from grader.grading.judging.service_calls import calls_of as calls_of
    from grader.grading.judging.source import Function as Function
    from grader.grading.judging.source import Source as Source
    from grader.grading.judging.source import argument as argument
    from grader.grading.judging.source import chain as chain
    from grader.grading.judging.source import covers as covers
    from grader.grading.judging.source import first_line as first_line
    from grader.grading.judging.source import last_line as last_line
    from grader.grading.judging.source import last_name as last_name
    from grader.grading.judging.source import parameters as parameters
    from grader.grading.judging.source import subtree as subtree
    from grader.grading.judging.source import text_of as text_of
    from grader.grading.judging.source import words as words
    from grader.grading.judging.texts import Printed as Printed
    from grader.grading.judging.texts import clean as clean
    from grader.grading.judging.texts import printed_numbers as printed_numbers
    from grader.grading.judging.texts import readings as readings
    from grader.grading.judging.texts import segments as segments
    from grader.grading.judging.texts import template_of as template_of
    from grader.grading.judging.texts import with_decimal_points as with_decimal_points
    from grader.grading.judging.values import EXACT as EXACT
    from grader.grading.judging.values import JITTER_NS as JITTER_NS
    from grader.grading.judging.values import Held as Held
    from grader.grading.judging.values import Reading as Reading
    from grader.grading.judging.values import as_number as as_number
    from grader.grading.judging.values import carries_number as carries_number
    from grader.grading.judging.values import delivered as delivered
    from grader.grading.judging.values import delivered_numbers as delivered_numbers
    from grader.grading.judging.values import heard_from_ns as heard_from_ns
    from grader.grading.judging.values import held as held
    from grader.grading.judging.values import last_of_instant as last_of_instant
    from grader.grading.judging.values import number_at as number_at
    from grader.grading.judging.values import per_trace as per_trace
    from grader.grading.judging.values import published as published
    from grader.grading.judging.values import published_numbers as published_numbers
    from grader.grading.judging.values import student_endpoints as student_endpoints
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
    from grader.grading.model.report import ExerciseReport as ExerciseReport
    from grader.grading.model.report import Report as Report
    from grader.grading.model.report import Summary as Summary
    from grader.grading.model.report import Verdict as Verdict
    from grader.grading.model.wording import in_unit as in_unit
    from grader.grading.model.wording import listed as listed
    from grader.grading.model.wording import moment as moment
    from grader.grading.model.wording import number as number
    from grader.grading.model.wording import numbers as numbers
    from grader.grading.model.wording import quote as quote
    from grader.grading.model.wording import span as span
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
    from grader.runtime.model.quantities import NS_PER_MS as NS_PER_MS
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
    from grader.runtime.model.quantities import counted as counted
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
    from grader.runtime.model.trace import unmet_policy as unmet_policy
    from grader.runtime.simulation import DifferentialDrive as DifferentialDrive
    from grader.runtime.simulation import Moment as Moment
    from grader.runtime.simulation import Output as Output
    from grader.runtime.simulation import Simulation as Simulation
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
    from grader.world.errors import GoalAborted as GoalAborted
    from grader.world.errors import GoalCanceled as GoalCanceled
    from grader.world.errors import GoalRejected as GoalRejected
    from grader.world.errors import NoMessage as NoMessage
    from grader.world.errors import ParameterRejected as ParameterRejected
    from grader.world.errors import ProgramFailed as ProgramFailed
    from grader.world.errors import StepTimeout as StepTimeout
    from grader.world.errors import WrongType as WrongType
    from grader.world.opening import Worlds as Worlds
    from grader.world.opening import open_world as open_world
    from grader.world.programs import Program as Program
    from grader.world.world import Failure as Failure
    from grader.world.world import Launched as Launched
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
        "grader.grading.judging.findings": (
            "met partly not_met only_printed waiting_for explain_fault faulted first_fault fault_sentence "
            "explain_no_message explain_no_subscription explain_no_server explain_no_client fault_hint FAULT_KEY"
        ),
        "grader.grading.judging.checks.services": "too_few_responses",
    },
    "Parameters": {
        "grader.runtime.model.quantities": (
            "DurationNs Hertz FieldNumber Topic MessageType ServiceType ActionType Pattern FieldOf"
        ),
    },
    "Recordings": {
        "grader.runtime.model.trace": (
            "Trace Message Delivery LogRecord OutputLine Request Response Fault FaultKind GraphSnapshot Endpoint "
            "ServiceEnd Mark ClockKind unmet_policy"
        ),
        "grader.grading.judging.values": (
            "Reading Held published delivered published_numbers delivered_numbers held value_at number_at "
            "student_endpoints as_number carries_number heard_from_ns last_of_instant per_trace EXACT "
            "JITTER_NS"
        ),
        "grader.grading.judging.logs.outputs": "student_records printed_lines written shape_of number_told",
        "grader.grading.judging.texts": (
            "Printed printed_numbers clean readings with_decimal_points segments template_of"
        ),
        "grader.grading.judging.logs.matching": "chance",
        "grader.grading.judging.series": "lag_ns steps_behind",
        "grader.grading.judging.service_calls": "Call calls_of",
    },
    "Text": {
        "grader.runtime.model.quantities": "NS_PER_S seconds counted within NS_PER_MS",
        "grader.grading.model.wording": "moment span number numbers quote listed in_unit",
    },
    "Charts": {
        "grader.grading.judging.plots": "Drawing Plot threshold_drawing",
        "grader.grading.model.chart": "Chart Panel Series Point Band Level Look Tone",
        "grader.grading.judging.charts": "series time_chart gaps_panel compared_panels drawn_case Lanes",
    },
    "Hint rules": {
        "grader.grading.judging.diagnosis.rules": (
            "Rule Clue Case Crash hint_rule crash_rule silent_topic unheard_topic file_for lines_of log_call "
            "Maker NO_SOURCE"
        ),
        "grader.grading.judging.facts": (
            "RateFacts SeriesFacts DrawFacts AnswerRow AnswerFacts LogFacts WrongLogFacts LogPaceFacts OtherEnd"
        ),
    },
    "Source code": {
        "grader.grading.judging.source": (
            "Source first_line last_line covers last_name chain argument parameters text_of subtree words Function"
        ),
        "grader.grading.judging.diagnosis.values": "draws",
        "grader.grading.judging.diagnosis.wiring": (
            "Constant Made constant given_leaf made made_for target_of roots reached runs names_in is_log "
            "publish_calls used conditions is_flag spins node_made variable_of timer_code short received "
            "message_classes value_of number_in_code text_in_code elsewhere_because goes_to head_of "
            "python_loggers waits_for_ever Switch switches text_comparisons Pause pauses"
        ),
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
        "grader.runtime.simulation": "Simulation Moment Output DifferentialDrive Turtle Unicycle",
    },
    "Own nodes, step by step": {
        "grader.world.opening": "open_world Worlds",
        "grader.world.world": "World Launched Failure",
        "grader.world.asking": "Received PendingCall GoalHandle GoalResult",
        "grader.world.programs": "Program",
        "grader.world.errors": (
            "ProgramFailed StepTimeout NoMessage ParameterRejected WrongType GoalRejected GoalAborted GoalCanceled"
        ),
    },
    "Tests": {
        "grader.testing": "TraceBuilder judge explain builtin_check",
    },
}
_HOMES = {name: home for homes in CONTENTS.values() for home, names in homes.items() for name in names.split()}

__all__ = ["grade", "observe", "rejudge", *_HOMES]  # noqa: PLE0604  the table is the list


def __getattr__(name: str) -> Any:
    """Import a public name when it is first looked up."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__} has no attribute {name}")
    value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


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
    report = start.grade(request, _quiet, writer.remember)
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
    from grader.grading.app.observe import observe as observed  # noqa: PLC0415
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
    from grader.grading.app.rejudge import rejudge as judged_again  # noqa: PLC0415
    from grader.grading.evidence.store import open_evidence  # noqa: PLC0415

    how = judgement(tuple(exercises), tuple(map(Path, rubrics)), pictures=True)
    return judged_again(open_evidence(Path(evidence)), how)


def _quiet(step: str) -> None:
    """Report progress to nobody."""
