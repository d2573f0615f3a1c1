"""Runs the check of a criterion on its trace, and explains why if it cannot run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

from grader.grading.judging.authored import finding_flaw, is_authored, mistake_in, mistake_of
from grader.grading.judging.checks import CHECKS
from grader.grading.judging.findings import AT_ONCE_NS, fault_place, faulted, first_fault, not_met
from grader.grading.judging.idle_machine import quicker
from grader.grading.judging.installation import EXTRAS, INTERFACES, lacking_package, lacking_python, may_differ_by_numpy
from grader.grading.judging.launched import excuses
from grader.grading.judging.proportion import in_proportion, over_draws
from grader.grading.judging.values import student_endpoints
from grader.grading.model.exercise import Criterion, Exercise, Finding, ask, of_beginning, reads_packages, reads_sources
from grader.grading.model.wording import quote, span
from grader.runtime.model.author_files import AuthorMistake
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.extras import pip_install
from grader.runtime.model.scenario import Scenario, is_launch_file
from grader.runtime.model.submission import Submission
from grader.runtime.model.trace import AssessedTrace, ClockKind, Fault, FaultKind, Request, Response, Trace

#: How many gaps between messages show that the first one is unusual.
_FEWEST_GAPS = 5

#: What to do about a launch file that the grader can only run in part.
_LEFT_OUT_HINT = "grade this criterion by hand, or remove that from the launch file and grade again"


@dataclass(frozen=True, slots=True)
class Answer:
    """The result of running a check; exactly one attribute is set.

    Attributes:
        finding: The check's finding.
        missing: Files of the scenario that the submission lacks.
        problem: Why there is no finding: a failure of the grader or the machine, or a mistake of the rubric's author.
        error: Class and text of an exception in a built-in check; set together with `problem`.
        mistake: The mistake of the rubric's author; set together with `problem`.
        hint: One thing to do about the problem; empty if nothing is very likely right.
        fault: The fault that shows the problem; None if none does.
        suspected: Whether what the submission does may be why there is a problem.
        recording: Id of the scenario whose recording decided, where a scenario is drawn several times; else empty.
    """

    finding: Finding | None = None
    missing: tuple[str, ...] = ()
    problem: str = ""
    error: str = ""
    mistake: AuthorMistake | None = None
    hint: str = ""
    fault: Fault | None = None
    suspected: bool = False
    recording: str = ""


def check_name(criterion: Criterion) -> str:
    """Return the name of a criterion's check in rubrics."""
    known = (name for name, kind in CHECKS.items() if type(criterion.check) is kind)
    return criterion.check_name or next(known, type(criterion.check).__name__)


def run_check(
    criterion: Criterion,
    exercise: Exercise,
    traces: Mapping[str, AssessedTrace],
    submission: Submission,
    sources: Mapping[str, str] | None = None,
) -> Answer:
    """Run the criterion's check on the trace of its scenario, or on the source of its files.

    Of a scenario that is drawn several times, each recording is judged.
    """
    ids = exercise.recordings_of(criterion)
    if len(ids) == 1:
        return _run_once(criterion, exercise, traces, submission, sources)
    answers = []
    for id_ in ids:
        answers.append(_run_once(replace(criterion, scenario=id_), exercise, traces, submission, sources))
        if answers[-1].finding is None:  # what could not be judged leaves the criterion undecided
            return replace(answers[-1], recording=id_)
    place, finding = over_draws(criterion, [answer.finding for answer in answers if answer.finding is not None])
    return Answer(finding=finding, recording=ids[place])


def _run_once(  # noqa: PLR0911  one for each reason
    criterion: Criterion,
    exercise: Exercise,
    traces: Mapping[str, AssessedTrace],
    submission: Submission,
    sources: Mapping[str, str] | None,
) -> Answer:
    """Run a check on one recording."""
    scenario = next(s for s in exercise.scenarios if s.id == criterion.scenario)
    trace = traces.get(scenario.id)
    wanted = scenario.wanted if trace is None or trace.tested is None else trace.tested.missing
    missing = tuple(p for p in wanted if p in submission.files and submission.files[p].found is None)
    if missing:
        return Answer(missing=missing)
    if reads_packages(criterion.check):
        return Answer(finding=criterion.check.judge_packages(submission.packages))
    if trace is None or trace.author_mistake is not None or trace.harness_problem:
        return _unrecorded(scenario, trace)
    if scenario.test is not None:  # every program of its run counts, under whatever name it was started
        scenario = replace(scenario, processes=tuple(dict.fromkeys(fault.process for fault in trace.faults())))
    recorded = trace.recorded
    answer = _judged(criterion, scenario, recorded, sources)
    if answer.finding is not None and answer.finding.credit < 1:
        faster = (_judged(criterion, scenario, one, sources).finding for one in quicker(trace))
        if any(finding is not None and finding.credit > answer.finding.credit for finding in faster):
            lost = f"{span(trace.most_starved_ns)} of {span(trace.stop_ns)}"
            waited = f"the nodes waited {lost} for a processor"
            worked = f"an idle one may need {lost} less for the nodes' work"
            problem = f"the machine was too busy: {worked if trace.clock is ClockKind.VIRTUAL else waited}"
            return Answer(problem=f"{problem}, which may be the reason", suspected=trace.suspected)
        at_once = recorded.once("first at once", lambda: _with_first_at_once(recorded))
        finding = None if at_once is None else _judged(criterion, scenario, at_once, sources).finding
        if finding is not None and finding.credit > answer.finding.credit:
            return Answer(
                problem="the machine was too busy: the first message had to wait until its publisher was discovered, "
                "which can be why",
                suspected=trace.suspected,
            )
    answer = _for_other_numpy(_for_older_python(answer, scenario, recorded), scenario, recorded, sources or {})
    if not reads_sources(criterion.check):
        return _for_what_is_lacking(answer, criterion, scenario, recorded, sources or {})
    return answer if answer.finding is None else replace(answer, finding=_placed(answer.finding, submission))


def _unrecorded(scenario: Scenario, trace: AssessedTrace | None) -> Answer:
    """Return why there is no recording that could be judged."""
    if trace is None:
        return Answer(problem=f"the scenario {scenario.id} was not recorded")
    if trace.author_mistake is not None:
        return _author_mistake(trace.author_mistake)
    return Answer(problem=trace.harness_problem, suspected=trace.suspected)


def for_beginning(criterion: Criterion) -> Criterion | None:
    """Return a criterion that judges the beginning of a recording; None if its check says that none can."""
    try:
        check = of_beginning(criterion.check)
    except Exception:  # a check of a rubric's own that fails here is not compared, and costs no points
        return None
    return None if check is None else replace(criterion, check=check, check_name=check_name(criterion))


def _for_older_python(answer: Answer, scenario: Scenario, trace: Trace) -> Answer:
    """Return the answer; no answer if points are lost for what the Python of the ROS release has and this one lacks."""
    if answer.finding is None or answer.finding.credit == 1:
        return answer
    lack = lacking_python(trace, scenario.processes, answer.finding.location)
    if lack is None:
        return answer
    fault = next((f for f in trace.faults(lack.process) if (f.file, f.line) == (lack.file, lack.line)), None)
    hint = f"grade again on Python {_version(lack.python)}, or write it for Python {_version(lack.here)}"
    return Answer(problem=lack.sentence, hint=hint, fault=fault)


def _for_other_numpy(answer: Answer, scenario: Scenario, trace: Trace, sources: Mapping[str, str]) -> Answer:
    """Return the answer; no answer if points are lost by a program whose numbers may be other ones on the release."""
    if answer.finding is None or answer.finding.credit == 1 or trace.other_numpy is None:
        return answer
    if not may_differ_by_numpy(trace, scenario.processes, sources):
        return answer
    hint = f"grade again with numpy {trace.other_numpy.wanted}, which needs Python 3.12 or older"
    return Answer(problem=f"{trace.other_numpy.sentence}, which may be the reason why this is not met", hint=hint)


def _for_what_is_lacking(
    answer: Answer, criterion: Criterion, scenario: Scenario, trace: Trace, sources: Mapping[str, str]
) -> Answer:
    """Return the answer; no answer if points are lost where this installation lacks a package of ROS.

    Nor is there one where a launch file asks for something that the grader cannot do.
    """
    lost = answer.finding is not None and answer.finding.credit < 1
    excuse = next(excuses(criterion.check, trace), "") if lost else ""
    if excuse:
        problem = f"{excuse}, which may be the reason why this is not met"
        return Answer(problem=problem, hint=_LEFT_OUT_HINT, suspected=True)
    lack = lacking_package(trace, scenario.processes, sources) if lost else None
    if lack is None:
        return answer
    kind = "part" if "." in lack.name else "package"
    text = f"{fault_place(lack.fault)}: {lack.name} is a {kind} of ROS 2 that is not installed where this was graded"
    hint = f"grade again where {lack.name} is installed, or leave the import out if the program does not need it"
    if lack.name in EXTRAS:
        text = f"{fault_place(lack.fault)}: {lack.name} comes with ROS 2 and is not installed where this was graded"
        hint = f"grade again after {pip_install(EXTRAS[lack.name])}, which brings {lack.name}"
    if lack.name.endswith(INTERFACES):
        hint = f"grade again with --interfaces and the folder of {lack.name}, which has its definitions"
    return Answer(problem=f"{text}, which is not the program's fault", hint=hint, fault=lack.fault)


def _version(version: tuple[int, int]) -> str:
    return ".".join(map(str, version))


def _with_first_at_once(trace: Trace) -> Trace | None:
    """Return what a quick machine may have recorded: no first message held back; None if none was, as far as is seen.

    On the wall clock, the host holds the first message of a publisher until the grader's subscription has been
    discovered; the second one is not late. So if the two are closer to each other than others are, the first is moved.
    """
    if trace.clock is not ClockKind.WALL or trace.bag is not None:
        return None
    moved: dict[int, int] = {}
    for topic in {message.topic for message in trace.messages()}:
        first, *rest = trace.messages(topic)
        times = [first.t_ns, *(message.t_ns for message in rest)]
        gaps = [after - before for before, after in pairwise(times)]
        if len(gaps) >= _FEWEST_GAPS and gaps[0] < (usual := sorted(gaps)[len(gaps) // 2]):
            moved[id(first)] = max(0, times[1] - usual)
    if not moved:
        return None
    observations = (replace(o, t_ns=moved[id(o)]) if id(o) in moved else o for o in trace.observations)
    return replace(trace, observations=tuple(sorted(observations, key=lambda one: one.t_ns)))


def _placed(finding: Finding, submission: Submission) -> Finding:
    """Return the finding with the path at which its file was found."""
    place = finding.location
    found = submission.files[place.file].found if place is not None and place.file in submission.files else None
    return finding if place is None or not found else replace(finding, location=replace(place, file=found))


def _judged(  # noqa: PLR0911  one for each reason
    criterion: Criterion, scenario: Scenario, trace: Trace, sources: Mapping[str, str] | None
) -> Answer:
    name = check_name(criterion)
    authored = bool(criterion.check_name) and is_authored(criterion.check)
    try:
        finding = ask(criterion.check, trace, sources)
    except HarnessError as error:
        if trace.bag is not None:  # what is missing in it, the student has not recorded
            hint = "record it again so that this is part of it"
            return Answer(finding=not_met(f"{quote(trace.bag.file)}: {error.message}", hint=hint))
        return Answer(problem=f"{name} cannot be judged: {error.message}")
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # a failing check must cost no points and must not end the report
        if authored:
            return _author_mistake(mistake_of(criterion.check, error))
        problem = f"the check {name} failed on this recording through no fault of the submission"
        return Answer(problem=problem, error=f"{type(error).__name__}: {quote(str(error))}")
    if authored and (wrong := finding_flaw(finding) or _unmeasured(criterion, finding)):
        method = "judge_sources" if sources is not None and reads_sources(criterion.check) else "judge"
        return _author_mistake(mistake_in(criterion.check, method, f"the check {name} {wrong}"))
    finding = in_proportion(criterion, finding)
    if scenario.test is not None:  # the test has decided what ends it
        return Answer(finding=finding)
    return Answer(finding=_start_failure_first(finding, scenario, trace))


def _unmeasured(criterion: Criterion, finding: Finding) -> str:
    """Describe a finding without the number that its criterion needs, as the end of a sentence; empty if it has one."""
    if criterion.scale is None or not finding.credit or finding.readings:
        return ""
    return "gave points and nothing `measured`, which the rubric's `full` and `none` need"


def _author_mistake(mistake: AuthorMistake) -> Answer:
    hint = f"for the author of the rubric: correct {mistake.file} and grade again"
    return Answer(problem=f"the rubric has a mistake: {mistake}", error=str(mistake), mistake=mistake, hint=hint)


def _start_failure_first(finding: Finding, scenario: Scenario, trace: Trace) -> Finding:
    """Return the finding; if a file could not start and no points were earned, that becomes the reason."""
    fault = start_failure(scenario, trace)
    if fault is None or finding.credit > 0:
        return finding
    consequence = ""
    if fault.kind is FaultKind.SYNTAX_ERROR:
        consequence = "the file cannot run"
    elif fault.kind is FaultKind.EXITED and fault.t_ns >= AT_ONCE_NS:
        consequence = "the node had sent and received nothing by then"
    return replace(faulted(fault, consequence, finding.evidence), facts=finding.facts)


def start_failure(scenario: Scenario, trace: Trace) -> Fault | None:
    """Return the fault that prevented a file from creating any endpoint, or None if all files started."""
    named = {fault.process for fault in trace.faults()} if any(map(is_launch_file, scenario.processes)) else ()
    processes = dict.fromkeys((*scenario.processes, *sorted(named)))  # a launch file's nodes have names of their own
    faults = [fault for process in processes if (fault := first_fault(trace, process)) is not None]
    if not faults:
        return None
    few = _started(trace) < len(scenario.processes)
    return next((fault for fault in faults if few or fault.kind is FaultKind.SYNTAX_ERROR), None)


def _started(trace: Trace) -> int:
    """Return how many processes created an endpoint in the ROS graph, or sent something."""
    endpoints = student_endpoints(trace)
    ends = (*trace.service_ends("service"), *trace.service_ends("client"))
    only_services = {e.node for e in ends} - {e.node for e in endpoints}
    known = len({e.participant for e in endpoints}) + len(only_services)
    calls: tuple[Request | Response, ...] = (*trace.of(Request), *trace.of(Response))
    return known or int(bool(trace.messages()) or any(r.sender == "student" for r in calls))
