"""Finds scenarios that need no run, because Python can compile none of their files or there is nothing in them."""

from __future__ import annotations

import ast
import warnings
from pathlib import Path

from grader.core.scenario import is_launch_file
from grader.core.trace import ClockKind, Fault, GraphSnapshot, Mark, Start, StartWay, Trace
from grader.execution.ending import ending, reported_fault
from grader.execution.notes import Places
from grader.execution.plan import Plan
from grader.student_host.packages import PackageLayout, layout_of, parse

#: A larger file is left to the student's process and its limits.
MOST_BYTES = 1 << 20


def trace_without_run(plan: Plan) -> Trace | None:
    """Return what a run of the plan would record of its processes; None if any of them has to be run."""
    places = Places(Path(plan.root))
    starts_ns = dict(plan.starts_ns)
    ends: list[Fault | Mark] = []
    starts: list[Start] = []
    for name, file in plan.processes:
        found, start_ns = _read(Path(plan.root, file)), starts_ns.get(name, 0)
        if isinstance(found, SyntaxError):
            said = {
                "code": "syntax_error",
                "type": type(found).__name__,
                "message": str(found.msg),
                "line": found.lineno,
            }
            ends.append(reported_fault(name, start_ns, {**said, "file": file}, plan.limits, places))
        elif _is_inert(found) and not start_ns and _is_script(plan, name, file):
            starts.append(Start(name, file, StartWay.SCRIPT, arguments=plan.start_of(name).words))
            ends.append(ending(name, 0, {"code": 0}, plan, places, stopped=False))
        else:
            return None
    if not ends:
        return None
    end_ns = plan.wait_at_most_ns if plan.first_message_on else plan.duration_ns
    ends.sort(key=lambda end: end.t_ns)
    graph = GraphSnapshot(ends[-1].t_ns, nodes=(), endpoints=(), services=())
    return Trace(plan.scenario, ClockKind(plan.clock), end_ns, (*ends, graph), starts=tuple(starts))


def is_runnable(path: Path) -> bool:
    """Return whether running a file may do anything, judged by its text; True in doubt."""
    found = _read(path)
    return not (isinstance(found, SyntaxError) or _is_inert(found))


def _read(path: Path) -> ast.Module | SyntaxError | None:
    """Return what a file holds, or why Python cannot compile it; None if only a process should find out."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # as error, a warning about a string would be a syntax error
        try:
            return parse(str(path)) if path.stat().st_size <= MOST_BYTES else None
        except SyntaxError as error:
            return error
        except (OSError, ValueError, RecursionError, MemoryError):
            return None


def _is_inert(tree: ast.Module | None) -> bool:
    """Return whether a file holds only comments, texts and `pass`, so that running it does nothing."""
    return tree is not None and all(
        isinstance(line, ast.Pass) or (isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant))
        for line in tree.body
    )


def _is_script(plan: Plan, name: str, file: str) -> bool:
    """Return whether a file is run as `python3 FILE`, not as part of a package or as a launch file."""
    special = is_launch_file(name) or plan.start_of(name).executable
    return not special and layout_of(plan.root, file) == PackageLayout()
