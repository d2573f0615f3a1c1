"""Faults as a student's process reports them: untrusted values, taken over field by field."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from grader.model.trace import Fault, FaultKind

KINDS = {kind.value: kind for kind in FaultKind}
TEXT_CHARACTERS, PLACE_CHARACTERS, FRAMES = 500, 300, 20


def reported_fault(process: str, t_ns: int, data: Mapping[str, Any]) -> Fault:
    """Return the fault that a report describes."""
    frames, line = data.get("frames"), data.get("line")
    return Fault(
        t_ns=t_ns,
        process=process,
        kind=KINDS.get(str(data.get("kind")), FaultKind.EXCEPTION),
        text=str(data.get("text", ""))[:TEXT_CHARACTERS],
        file=str(data.get("file", ""))[:PLACE_CHARACTERS],
        line=line if type(line) is int and line > 0 else 0,
        frames=tuple(str(f)[:PLACE_CHARACTERS] for f in frames[:FRAMES]) if isinstance(frames, list) else (),
    )


def ending_fault(process: str, t_ns: int, report: Mapping[str, Any]) -> Fault:
    """Return the fault of a process that says how it ended."""
    if isinstance(report.get("fault"), dict):
        return reported_fault(process, t_ns, report["fault"])
    code = report.get("code")
    return Fault(t_ns, process, FaultKind.EXITED, f"exited with code {code if type(code) is int else '?'}")
