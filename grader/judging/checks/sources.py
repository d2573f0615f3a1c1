"""Checks on the text of a student's file: what it has to use, and what it must not."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from grader.core.errors import HarnessError
from grader.core.exercise import Finding, Location
from grader.core.trace import FaultKind, Trace
from grader.judging.code import Code, code_of
from grader.judging.findings import met, not_met
from grader.judging.silence import fault_hint, first_fault
from grader.judging.source import read, subtree
from grader.judging.wording import counted, fault_sentence, listed, quote


@dataclass(frozen=True, slots=True)
class SourceUses:
    """A student's file holds what is named: a class that derives from another, and calls of functions or methods.

    It is read, not run: imports under other names are followed, and whether a line is ever reached is not asked.

    Attributes:
        process: File name of the student process.
        derives_from: Classes of which one has to be a base, e.g. `rclpy.node.Node`; none if left out.
        calls: What has to be called, each of them: a whole name such as `rclpy.spin`, or the name of a method such as
            `create_timer`.
    """

    process: str
    derives_from: tuple[str, ...] = ()
    calls: tuple[str, ...] = ()

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        parts = [f"a class that derives from {' or '.join(self.derives_from)}"] if self.derives_from else []
        return f"in {self.process} {' and '.join([*parts, *(f'a call of {name}' for name in self.calls)])}"

    def judge(self, trace: Trace) -> Finding:  # noqa: ARG002 - as every check
        """Raise: the recording alone does not hold the file."""
        raise HarnessError(f"{self.process}: its text was not kept")

    def judge_sources(self, trace: Trace, sources: Mapping[str, str]) -> Finding:
        """Return full credit if everything is there; the reason names what is not."""
        code = _code(trace, sources, self.process)
        if isinstance(code, Finding):
            return code
        classes = code.deriving(*self.derives_from) if self.derives_from else []
        found = {name: code.calls(name) for name in self.calls}
        evidence: dict[str, Any] = {
            "classes": [c.name for c in classes][:20],
            "calls": {name: [c.lineno for c in calls][:20] for name, calls in found.items()},
        }
        missing = [f"a call of {name}" for name, calls in found.items() if not calls]
        if self.derives_from and not classes:
            missing.insert(0, f"a class that derives from {' or '.join(self.derives_from)}")
        if missing:
            return not_met(f"{self.process}: expected {' and '.join(missing)}, found none", evidence)
        told = [f"class {quote(c.name, 40)} in line {c.lineno}" for c in classes[:1]]
        told += [f"{name} in line {calls[0].lineno}" for name, calls in found.items()]
        return met(f"{self.process}: {', '.join(told) or 'nothing was asked'}", evidence)


@dataclass(frozen=True, slots=True)
class SourceAvoids:
    """A file does not call what is named, anywhere or in callbacks, and writes to no global variable if that is asked.

    It is read, not run: imports under other names are followed. A callback is what is handed to a timer, subscription,
    service, action or future, with every function of the file that it calls.

    Attributes:
        process: File name of the student process.
        calls: What must not be called: a whole name such as `time.sleep`, or the name of a method such as `sleep`.
        where: `anywhere`, or `callbacks` only.
        globals: Whether `global` must not be written either.
    """

    process: str
    calls: tuple[str, ...] = ()
    where: Literal["anywhere", "callbacks"] = "anywhere"
    globals: bool = False

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        parts = [f"no call of {name}" for name in self.calls] + ["no global"] * self.globals
        return f"in {self.process}{' in callbacks' if self.where == 'callbacks' else ''} {' and '.join(parts)}"

    def judge(self, trace: Trace) -> Finding:  # noqa: ARG002 - as every check
        """Raise: the recording alone does not hold the file."""
        raise HarnessError(f"{self.process}: its text was not kept")

    def judge_sources(self, trace: Trace, sources: Mapping[str, str]) -> Finding:
        """Return full credit if nothing of it is there; the reason names the first place."""
        code = _code(trace, sources, self.process)
        if isinstance(code, Finding):
            return code
        found = self._found(code)
        evidence = {"found": [[name, line] for line, name in found][:20]}
        if not found:
            return met(f"{self.process}: {self.expected.partition(' ')[2].partition(' ')[2]}", evidence)
        line, name = found[0]
        inside = " in a callback" if self.where == "callbacks" else ""
        reason = f"{self.process}:{line}: {name}{inside}, expected none; {counted(len(found), 'place')}"
        hint = "a callback must return at once: use a timer instead of waiting" if "sleep" in name and inside else ""
        return replace(not_met(reason, evidence, hint=hint), location=Location(self.process, line))

    def _found(self, code: Code) -> list[tuple[int, str]]:
        inside = {id(n) for f in code.called_back() for n in subtree(f)} if self.where == "callbacks" else None
        calls = [(c, name) for name in self.calls for c in code.calls(name)]
        places: Sequence[tuple[ast.stmt | ast.expr, str]] = calls
        if self.globals:
            places = [*calls, *((g, f"global {', '.join(g.names)[:60]}") for g in code.source.all(ast.Global))]
        return sorted({(n.lineno, name) for n, name in places if inside is None or id(n) in inside})


def _code(trace: Trace, sources: Mapping[str, str], process: str) -> Code | Finding:
    """Return a file with its names resolved, or no credit and why it cannot be read.

    Raises:
        HarnessError: It is not there, or too long to be read.
    """
    if process not in sources:
        raise HarnessError(f"{process}: its text was not kept; there are {listed(sorted(sources)) or 'no texts'}")
    source = read(process, sources[process])
    if source.tree is not None:
        return code_of(source)
    fault = first_fault(trace, process)
    if fault is not None and fault.kind is FaultKind.SYNTAX_ERROR:
        return not_met(f"{fault_sentence(fault)}; the file cannot be read", hint=fault_hint(fault), fault=fault)
    raise HarnessError(f"{process}: cannot be read as Python, or is too long")
