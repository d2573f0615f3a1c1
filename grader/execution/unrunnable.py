"""Finds scenarios that need no run, because Python can compile none of their files."""

from __future__ import annotations

import warnings
from pathlib import Path

from grader.core.trace import ClockKind, GraphSnapshot, Trace
from grader.execution.ending import reported_fault
from grader.execution.notes import Places
from grader.execution.plan import Plan
from grader.student_host.packages import parse

#: A larger file is left to the student's process and its limits.
MOST_BYTES = 1 << 20


def trace_without_run(plan: Plan) -> Trace | None:
    """Return what a run of the plan would record of its processes; None if any file can be compiled."""
    places = Places(Path(plan.root))
    starts_ns = dict(plan.starts_ns)
    faults = []
    for name, file in plan.processes:
        error = compile_error(Path(plan.root, file))
        if error is None:
            return None
        report = {"code": "syntax_error", "type": type(error).__name__, "message": str(error.msg), "line": error.lineno}
        faults.append(reported_fault(name, starts_ns.get(name, 0), {**report, "file": file}, plan.limits, places))
    if not faults:
        return None
    end_ns = plan.wait_at_most_ns if plan.first_message_on else plan.duration_ns
    faults.sort(key=lambda fault: fault.t_ns)
    graph = GraphSnapshot(faults[-1].t_ns, nodes=(), endpoints=(), services=())
    return Trace(plan.scenario, ClockKind(plan.clock), end_ns, (*faults, graph))


def compile_error(path: Path) -> SyntaxError | None:
    """Return why Python cannot compile a file; None if it can, or if only a process should find out."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # as error, a warning about a string would be a syntax error
        try:
            if path.stat().st_size <= MOST_BYTES:
                parse(str(path))
        except SyntaxError as error:
            return error
        except (OSError, ValueError, RecursionError, MemoryError):
            pass
    return None
