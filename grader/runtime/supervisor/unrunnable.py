"""Finds scenarios that need no run: Python can compile none of their files, they are empty, or given too much."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from grader.runtime.host.packages import PackageLayout, layout_of
from grader.runtime.host.protocol import Exited, FaultReport
from grader.runtime.model.scenario import is_launch_file
from grader.runtime.model.submission import ReadProgram
from grader.runtime.model.trace import AssessedTrace, ClockKind, Fault, FaultKind, GraphSnapshot, Mark, Start, StartWay
from grader.runtime.plan import Plan
from grader.runtime.worker.ending import ending, reported_fault
from grader.runtime.worker.notes import Places

#: A file of which nothing is known: only a process finds out.
_UNKNOWN = ReadProgram()


def trace_without_run(plan: Plan, programs: Mapping[str, ReadProgram]) -> AssessedTrace | None:
    """Return what a run of the plan would record of its processes; None if any of them has to be run.

    Args:
        plan: The plan.
        programs: What a contained process found in the Python files, by path.
    """
    places = Places(Path(plan.root))
    starts_ns = dict(plan.starts_ns)
    long = [(name, problem) for name, _ in plan.processes if (problem := plan.start_of(name).problem)]
    if long:
        faults = tuple(Fault(starts_ns.get(name, 0), name, FaultKind.KILLED, problem) for name, problem in long)
        return AssessedTrace(plan.scenario, ClockKind(plan.clock), plan.duration_ns, faults)
    ends: list[Fault | Mark] = []
    starts: list[Start] = []
    for name, file in plan.processes:
        found, start_ns = programs.get(file, _UNKNOWN), starts_ns.get(name, 0)
        if found.error is not None:
            error = found.error
            told = FaultReport("syntax_error", error.type, error.message, file=file, line=error.line or 0)
            ends.append(reported_fault(name, start_ns, told, plan.limits, places))
        elif found.inert and not start_ns and _is_script(plan, name, file):
            starts.append(Start(name, file, StartWay.SCRIPT, arguments=plan.start_of(name).words))
            ends.append(ending(name, 0, Exited(code=0), plan, places, stopped=False))
        else:
            return None
    if not ends:
        return None
    end_ns = plan.wait_at_most_ns if plan.first_message_on else plan.duration_ns
    ends.sort(key=lambda end: end.t_ns)
    graph = GraphSnapshot(ends[-1].t_ns, nodes=(), endpoints=(), services=())
    return AssessedTrace(plan.scenario, ClockKind(plan.clock), end_ns, (*ends, graph), starts=tuple(starts))


def _is_script(plan: Plan, name: str, file: str) -> bool:
    """Return whether a file is run as `python3 FILE`, not as part of a package or as a launch file."""
    special = is_launch_file(name) or plan.start_of(name).executable
    return not special and layout_of(plan.root, file) == PackageLayout()
