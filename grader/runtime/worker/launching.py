"""Launch files: what one describes becomes ordinary processes of the plan, and the trace names what was left out.

The description comes from a student's process, so every field of it is checked; it can only name programs of the
submission.
"""

from __future__ import annotations

import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from grader.runtime.host.protocol import Go, LaunchedNode, LaunchReport, NotEvaluated
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.limits import MOST_LAUNCHED, MOST_LEFT_OUT
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import (
    AssessedTrace,
    ClockKind,
    Fault,
    FaultKind,
    LogRecord,
    Mark,
    Observation,
    Offer,
    OutputLine,
)
from grader.runtime.plan import Plan, PlannedStart
from grader.runtime.programs.executables import (
    IGNORED,
    Executable,
    executables,
    find_executable,
    find_loose,
    has_package,
    ignored_packages,
    why_unknown,
)
from grader.runtime.usage import families, usage
from grader.runtime.worker.ending import START_CPU_S, graders_fault, reported_fault
from grader.runtime.worker.launch_service import LaunchService
from grader.runtime.worker.notes import Places, left_out_sentence, quoted
from grader.runtime.worker.student_process import NodeProcess

#: The most real time that a launch file may take, and how often it is looked at, in seconds.
LONGEST_S, LOOK_S = 60.0, 0.02
#: The most arguments of a node and characters of a text that are taken from a description.
ARGUMENTS, CHARACTERS, FILE_CHARACTERS = 200, 1_000, 1 << 20
#: How much a process describes, as the arguments of `describe` in its host.
MOST = {"most_nodes": MOST_LAUNCHED, "most_left_out": MOST_LEFT_OUT}
#: What packages and programs are called; anything else that a launch file names is quoted.
_NAME = re.compile(r"[A-Za-z0-9_.-]{1,100}")
#: Commands that neither send nor change anything in the ROS graph, whatever their arguments; and those of `ros2`, by
#: their first two words.
HARMLESS = frozenset(
    {
        *("cat", "chmod", "clear", "code", "cp", "date", "echo", "env", "false", "firefox", "gedit", "google-chrome"),
        *(
            "gz",
            "hostname",
            "ign",
            "ls",
            "mkdir",
            "mv",
            "notify-send",
            "printenv",
            "printf",
            "pwd",
            "rm",
            "rmdir",
            "rqt",
        ),
        *("rqt_graph", "rqt_plot", "rqt_console", "rviz2", "sleep", "tee", "touch", "true", "uname", "which", "whoami"),
        *("xdg-open",),
    }
)
HARMLESS_OF_ROS = frozenset(
    {
        *(("topic", verb) for verb in ("echo", "list", "info", "hz", "bw", "delay", "type", "find")),
        *(("node", verb) for verb in ("list", "info")),
        *(("service", verb) for verb in ("list", "type", "find", "info", "echo")),
        *(("action", verb) for verb in ("list", "info", "type")),
        *(("param", verb) for verb in ("list", "get", "dump", "describe")),
        *(("bag", verb) for verb in ("record", "info")),
        *(("interface", verb) for verb in ("list", "show", "package", "packages", "proto")),
        *(("pkg", verb) for verb in ("list", "prefix", "executables", "xml")),
    }
)
#: Commands of `ros2` that use the one name before a type.
ONE_NAME = frozenset({("topic", "pub"), ("service", "call"), ("action", "send_goal")})
_TOPIC = re.compile(r"/?[A-Za-z_][A-Za-z0-9_]*(?:/[A-Za-z_][A-Za-z0-9_]*)*")
_TYPE = re.compile(r"[a-z][a-z0-9_]*/(?:(?:msg|srv|action)/)?[A-Z][A-Za-z0-9]*")
#: Packages with programs that only show what happens; leaving them out changes nothing for the nodes.
ONLY_LOOKING = frozenset({"rviz2", "rqt", "rqt_gui", "rqt_graph", "rqt_plot", "rqt_console", "plotjuggler"})


@dataclass(frozen=True, slots=True)
class EvaluatedLaunch:
    """What a launch file describes.

    Attributes:
        processes: Name and file of each process that it starts by itself, at once or after a time.
        later: Name and file of each that it starts when something has happened.
        service: What it does while they run; None for one that does nothing more.
        starts: What each is started with.
        labels: The name of each process in the trace.
        starts_ns: Name and start time of those that start late.
        left_out: Sentences about what the grader cannot do, which may matter.
        unstarted: The same about other programs, each with the only name that it would use, if that is known.
        notes: Sentences about what it left out and does not matter.
        fault: Why nothing can be started; None if something can.
        harness_problem: Why that is not the launch file's fault; empty if it is.
        written: What it has written while it was evaluated.
    """

    processes: tuple[tuple[str, str], ...] = ()
    later: tuple[tuple[str, str], ...] = ()
    service: LaunchService | None = None
    starts: tuple[PlannedStart, ...] = ()
    labels: tuple[tuple[str, str], ...] = ()
    starts_ns: tuple[tuple[str, int], ...] = ()
    left_out: tuple[str, ...] = ()
    unstarted: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()
    fault: Fault | None = None
    harness_problem: str = ""
    written: tuple[LogRecord | OutputLine, ...] = ()


def evaluated(student: NodeProcess, plan: Plan) -> EvaluatedLaunch:
    """Wait until a process has evaluated a launch file, and return what it describes."""
    made = _evaluated(student, plan)
    student.drain()
    written = tuple(student.output(0, final=True))
    if made.labels:
        # A node may go by the name of the launch file: what the launch file prints is nothing that the node logs.
        written = tuple(replace(one, process=f"{one.process} (evaluation)") for one in written)
    return replace(made, written=written)


def _evaluated(student: NodeProcess, plan: Plan) -> EvaluatedLaunch:
    report, why = _description(student)
    if report is None:
        kind = FaultKind.KILLED if student.stopped else FaultKind.HUNG if why else FaultKind.EXITED
        return EvaluatedLaunch(fault=Fault(0, student.name, kind, why or _ENDED))
    if graders := graders_fault(student.name, report.fault):
        return EvaluatedLaunch(harness_problem=graders)
    # The grader's own fault was looked for first: it is not the launch file's.
    if report.fault is not None:
        return EvaluatedLaunch(fault=reported_fault(student.name, 0, report.fault, plan.limits, student.places))
    return _launched(student.name, report, plan, student.places)


_ENDED = "ended while it was evaluated, before it described anything"


def _description(student: NodeProcess) -> tuple[LaunchReport | None, str]:
    """Return the report, or None and why there is none."""
    student.tell(Go())
    started = time.monotonic()
    while True:
        for report in student.reports():
            if report is None:
                return None, student.stopped
            if isinstance(report, LaunchReport):
                return report, ""
        # What it writes is read, because a full pipe would block it.
        student.drain()
        found = families(list(student.roots))
        # With its children: a launch file may start a program to find something out.
        used = usage(set().union(*found.values()))
        if used.processor_ns > START_CPU_S * NS_PER_S:
            return None, f"did not return within {START_CPU_S:g} s of processor time"
        if time.monotonic() - started > LONGEST_S:
            return None, f"did not return within {LONGEST_S:g} s"
        if student.stopped:
            return None, student.stopped
        time.sleep(LOOK_S)


def _launched(name: str, report: LaunchReport, plan: Plan, places: Places) -> EvaluatedLaunch:
    root, known = Path(plan.root), dict(plan.start_of(name).known)
    left_out, unstarted, notes = _not_done(name, report, places)
    ignored = ignored_packages(root) if plan.projects else {}
    made = EvaluatedLaunch()
    named: dict[int, str] = {}
    for number, node in enumerate(report.nodes[:MOST_LAUNCHED]):
        package, wanted = _text(node.package), _text(node.executable)
        # Reported by a process that the student's code shares: only a package that is there is named.
        near = _text(node.near) if has_package(plan.projects, _text(node.near)) else ""
        known_package = has_package(plan.projects, package)
        if not known_package and package in ignored:
            folder = ignored[package].relative_to(root).as_posix()
            text = f"PackageNotFoundError: package {quoted(package)} not found: colcon does not build it, because of"
            return _failed(name, f"{text} {folder}/{IGNORED}", _place(name, node, places), left_out, unstarted)
        # Where a program runs in place, its workspace is complete: another package's executable is another program.
        is_complete = bool(plan.working and plan.projects)
        whole = "workspace" if plan.working else "submission"  # of which a message says what it lacks
        loose = None if known_package or is_complete else find_loose(root, wanted)
        look = find_executable(root, plan.projects, package, wanted) if known_package else loose
        # A package that is misspelt is not there, even if a file of the same name lies elsewhere.
        found = None if near else look
        where = _place(name, node, places)
        if found is None or found.file is None:
            if found is None and (why := why_unknown(root, plan.projects, package, wanted)):
                unstarted.append((f"{where}: {_program(package, wanted)} was not started: {why}", ""))
                continue
            # As in ROS, where a launch file that names a program its package lacks starts nothing at all.
            if known_package or near:
                meant = f"the {whole} has {near}" if near else ""
                text = _not_found(package, wanted, found, executables(root, plan.projects), meant)
                return _failed(name, text, where, left_out, unstarted)
            sentence = f"{where}: {_program(package, wanted)} was not started: {_lacking(package, whole)}"
            if package in ONLY_LOOKING:
                notes.append(sentence)
            else:
                unstarted.append((sentence, ""))
            continue
        if not known_package:
            notes.append(f"{where}: {_lacking(package, whole)}; {found.file} was started")
        made = _added(made, name, node, found, where, known)
        named[number] = made.processes[-1][0]
        if problem := made.starts[-1].problem:
            fault = Fault(0, name, FaultKind.KILLED, problem)
            return EvaluatedLaunch(fault=fault, left_out=tuple(left_out), unstarted=tuple(unstarted))
    if not (made.processes or left_out or unstarted or notes):
        text = "describes no node"
        return EvaluatedLaunch(fault=Fault(0, name, FaultKind.EXITED, text), notes=tuple(notes))
    made = _arranged(made, name, report, named, plan.root)
    return replace(made, left_out=tuple(left_out), unstarted=tuple(unstarted), notes=tuple(notes))


def _arranged(
    made: EvaluatedLaunch, launch: str, report: LaunchReport, named: Mapping[int, str], root: str
) -> EvaluatedLaunch:
    """Return the processes sorted by when they start: with the launch file, or when something has happened.

    Args:
        made: All processes.
        launch: The name of the launch file.
        report: What it describes.
        named: The process of each node, by the number of the node.
        root: The folder of the submission.
    """
    starts = [step for step in report.steps if step.act == "start" and step.number in named]
    plain = not report.handlers and all(step.act == "start" for step in report.steps)
    if plain and not any(node.respawn for node in report.nodes):
        late_ns = {named[step.number]: round(step.delay_s * NS_PER_S) for step in starts}
        return replace(made, starts_ns=tuple((process, late_ns.get(process, 0)) for process, _ in made.processes))
    nodes = {number: report.nodes[number] for number in named}
    files = {number: dict(made.processes)[process] for number, process in named.items()}
    service = LaunchService(launch, root, nodes, named, files, report.steps, report.handlers)
    first = {named[number] for number in service.first}
    return replace(
        made,
        processes=tuple(one for one in made.processes if one[0] in first),
        later=tuple(one for one in made.processes if one[0] not in first),
        service=service,
    )


def _not_done(name: str, report: LaunchReport, places: Places) -> tuple[list[str], list[tuple[str, str]], list[str]]:
    """Return what a launch file does that the grader does not, as in `left_out`, `unstarted` and `notes`."""
    left_out: list[str] = []
    unstarted: list[tuple[str, str]] = []
    notes: list[str] = []
    for one in report.left_out[:MOST_LEFT_OUT]:
        words, text = _command(one), _left_out(name, one, places)
        if only := _only_name(words):
            unstarted.append((text, only))
        else:
            (notes if _is_harmless(words) else left_out).append(text)
    return left_out, unstarted, notes


def _failed(
    name: str, text: str, where: str, left_out: Sequence[str], unstarted: Sequence[tuple[str, str]]
) -> EvaluatedLaunch:
    """Return that a launch file starts nothing, because of what it says at a place."""
    file, _, line = where.rpartition(":")
    fault = Fault(0, name, FaultKind.EXCEPTION, text, file if line else "", int(line or 0))
    return EvaluatedLaunch(fault=fault, left_out=tuple(left_out), unstarted=tuple(unstarted))


def _added(  # noqa: PLR0913  what one node consists of
    made: EvaluatedLaunch,
    launch: str,
    node: LaunchedNode,
    found: Executable,
    where: str,
    known: Mapping[str, str],
) -> EvaluatedLaunch:
    """Return the processes with one more."""
    assert found.file is not None
    # Criteria know processes by the files that the rubric asks for; two of the same get numbers.
    label = known.get(f"{found.file} {found.name}") or known.get(found.file) or launch
    number = sum(1 for _, other in made.labels if other == label)
    process = f"{label} ({number + 1})" if number or label == launch else label
    files = [(_text(path), _text(text, FILE_CHARACTERS)) for path, text in node.parameter_files[:ARGUMENTS]]
    start = PlannedStart(
        process,
        executable=found.name if found.target else "",
        arguments=_texts(node.arguments),
        ros_arguments=_texts(node.ros_arguments),
        parameter_files=tuple(files),
        launched_by=where,
        given_parameters=_texts(node.parameters),
        given_remappings=tuple((_text(old), _text(new)) for old, new in node.remappings[:ARGUMENTS]),
    )
    return replace(
        made,
        processes=(*made.processes, (process, found.file)),
        starts=(*made.starts, start),
        labels=(*made.labels, (process, label)),
    )


def _program(package: str, wanted: str) -> str:
    """Return a program as a launch file names it; what no package or program can be called is quoted."""
    plain = _NAME.fullmatch(wanted) and (not package or _NAME.fullmatch(package))
    return f"{package}/{wanted}" if plain else f"the program {quoted(f'{package}/{wanted}')}"


def _lacking(package: str, where: str) -> str:
    return f"the {where} has no package {package if _NAME.fullmatch(package) else quoted(package)}"


def _not_found(package: str, wanted: str, found: Executable | None, known: Sequence[Executable], meant: str) -> str:
    if meant:
        return f"PackageNotFoundError: package {quoted(package)} not found; {meant}"
    if found is not None:
        return f"SubstitutionFailure: {found.problem}"
    names = ", ".join(one.name for one in known if one.package == package)
    name = f"'{wanted}'" if _NAME.fullmatch(wanted) else quoted(wanted)
    text = f"SubstitutionFailure: package '{package}' found, but executable {name} not found"
    return f"{text}; its executables are {names}" if names else f"{text}; it has no executables"


def _command(one: NotEvaluated) -> list[str]:
    """Return the words of a command that was left out; none for anything else, and where a shell may run more."""
    text = _text(one.text) if one.code == "command" else ""
    # A shell may run anything behind these characters, so that such a command counts as unknown.
    return [] if re.search(r"[;&|`$<>\n]", text) else text.split()


def _is_harmless(words: Sequence[str]) -> bool:
    """Return whether a command takes no part in the ROS graph, so that leaving it out changes nothing for the nodes."""
    command = words[0].rpartition("/")[2] if words else ""
    return command in HARMLESS or (command == "ros2" and tuple(words[1:3]) in HARMLESS_OF_ROS)


def _only_name(words: Sequence[str]) -> str:
    """Return the topic, service or action of a command of `ros2` that uses no other; empty for another command."""
    if list(words[:1]) != ["ros2"] or tuple(words[1:3]) not in ONE_NAME:
        return ""
    named = (name for name, kind in pairwise(words[3:]) if _TYPE.fullmatch(kind) and _TOPIC.fullmatch(name))
    return next((name if name.startswith("/") else f"/{name}" for name in named), "")


def _left_out(name: str, one: NotEvaluated, places: Places) -> str:
    return f"{_place(name, one, places)}: {left_out_sentence(one)}"


def _place(name: str, one: NotEvaluated | LaunchedNode, places: Places) -> str:
    file, line = one.file, one.line
    if places.has(file, line):
        return f"{file}:{line}"
    own = file == name and 0 < line < 100_000  # the rubric's own launch file
    return f"{name}:{line}" if own else name


def _text(text: str, most: int = CHARACTERS) -> str:
    return text[:most].replace("\0", "")


def _texts(texts: Sequence[str]) -> tuple[str, ...]:
    return tuple(map(_text, texts[:ARGUMENTS]))


def expanded(plan: Plan, launched: Mapping[str, EvaluatedLaunch]) -> Plan:
    """Return a plan with the processes of launch files in the place of these."""
    processes: list[tuple[str, str]] = []
    starts = [start for start in plan.starts if start.process not in launched]
    late, may_exit = dict(plan.starts_ns), list(plan.may_exit)
    for name, file in plan.processes:
        made = launched.get(name)
        if made is None:
            processes.append((name, file))
            continue
        processes += made.processes
        starts += made.starts
        # The delays in a launch file count from its own start.
        begins = late.pop(name, 0)
        late |= {process: begins + delay for process, delay in made.starts_ns if begins + delay}
        may_exit += [process for process, _ in made.labels if name in plan.may_exit]
    return replace(
        plan,
        processes=tuple(processes),
        starts=tuple(starts),
        starts_ns=tuple(late.items()),
        may_exit=tuple(may_exit),
    )


def unstarted(plan: Plan, launched: Mapping[str, EvaluatedLaunch]) -> AssessedTrace:
    """Return the trace of a scenario with a launch file from which nothing can be started."""
    faults = tuple(made.fault for made in launched.values() if made.fault is not None)
    trace = AssessedTrace(plan.scenario, ClockKind(plan.clock), stop_ns=plan.duration_ns, observations=faults)
    return renamed(trace, launched)


def renamed(trace: AssessedTrace, launched: Mapping[str, EvaluatedLaunch]) -> AssessedTrace:
    """Return a trace in which processes go by the names that a rubric uses, and which tells what was left out."""
    labels = {process: label for made in launched.values() for process, label in made.labels}
    services = [made.service for made in launched.values() if made.service is not None]
    labels |= {name: labels[first] for service in services for name, first in service.names.items()}
    left_out = tuple(one for made in launched.values() for one in made.left_out)
    unstarted = tuple(one for made in launched.values() for one in made.unstarted)
    notes = tuple(one for made in launched.values() for one in made.notes)
    written = tuple(one for made in launched.values() for one in made.written)
    return replace(
        trace,
        observations=(*written, *(_renamed(one, labels) for one in trace.observations)),
        starts=tuple(replace(start, process=labels.get(start.process, start.process)) for start in trace.starts),
        notes=(*left_out, *(text for text, _ in unstarted), *notes, *trace.notes),
        left_out=left_out,
        unstarted=unstarted,
    )


def _renamed(observation: Observation, labels: Mapping[str, str]) -> Observation:
    if isinstance(observation, Mark) and observation.detail in labels:
        return replace(observation, detail=labels[observation.detail])
    if isinstance(observation, (LogRecord, OutputLine, Fault, Offer)) and observation.process in labels:
        return replace(observation, process=labels[observation.process])
    return observation
