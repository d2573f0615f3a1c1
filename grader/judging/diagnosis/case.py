"""The vocabulary of diagnosis: a lost point to explain, a cause that may explain it, and the clue it gives."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from grader.core.exercise import Check, Criterion, Location, ProblemKind
from grader.core.report import Verdict
from grader.core.trace import Fault, FaultKind, Trace
from grader.judging.source import Source, first_line

_FRAME = re.compile(r"(?P<file>.*):(?P<line>\d+) in (?P<name>\S+)$")


@dataclass(frozen=True, slots=True)
class Clue:
    """What is very likely the cause.

    Attributes:
        hint: One thing to do, in terms of the student's own code.
        location: The line to look at; None leaves the one that the check gave.
        key: What makes it the same cause as another clue; by default the cause and the location.
    """

    hint: str
    location: Location | None = None
    key: str = ""


@dataclass(frozen=True, slots=True)
class Case:
    """One verdict that lost points, with all that may explain it.

    Attributes:
        criterion: What was asked.
        verdict: What it came to.
        trace: What was recorded.
        sources: Wanted file name -> source, for the files of the scenario that were handed in.
        fault: The fault that the verdict rests on, if it rests on one.
        siblings: The checks of the exercise's other criteria.
    """

    criterion: Criterion
    verdict: Verdict
    trace: Trace
    sources: Mapping[str, Source]
    fault: Fault | None = None
    siblings: tuple[Check, ...] = ()

    @property
    def process(self) -> str:
        """The one file that the question is about; empty if it is about several."""
        named = str(getattr(self.criterion.check, "process", ""))
        if self.fault is not None:
            return self.fault.process
        return named or (next(iter(self.sources)) if len(self.sources) == 1 else "")

    @property
    def source(self) -> Source | None:
        """The source of the one file that the question is about."""
        return self.sources.get(self.process)

    @property
    def faulty(self) -> tuple[Fault, Source] | None:
        """The fault and the file it arose in, if that is a graded one."""
        if self.fault is None or self.source is None:
            return None
        return (self.fault, self.source) if self.fault.file in ("", self.source.file) else None

    def is_about(self, kind: ProblemKind) -> bool:
        """Return whether the check found a problem of a kind."""
        return self.verdict.problem is not None and self.verdict.problem.kind is kind

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics that the problem is about."""
        return self.verdict.problem.topics if self.verdict.problem is not None else ()

    def said(self, pattern: str) -> re.Match[str] | None:
        """Return how an exception's text matches a pattern."""
        fault = self.fault
        return fault.said(pattern) if fault is not None and fault.kind is FaultKind.EXCEPTION else None

    def evidence(self, key: str) -> object:
        """Return a piece of the verdict's evidence, None if there is none of that name."""
        return self.verdict.evidence.get(key)


@dataclass(frozen=True, slots=True)
class Cause:
    """A mistake that people make.

    Attributes:
        id: Unique, for evidence and tests.
        applies: Returns the clue if this is very likely what happened, else None.
    """

    id: str
    applies: Callable[[Case], Clue | None]


def frames(fault: Fault) -> list[tuple[int, str]]:
    """Return line and function of the fault's frames in its own file, outermost first."""
    matches = (_FRAME.match(frame) for frame in fault.frames)
    return [(int(m["line"]), m["name"]) for m in matches if m and m["file"] == fault.file]


def lines_of(node: ast.AST, *others: ast.AST) -> str:
    """Return `line 7`, or `lines 7 and 9`, for text."""
    numbers = sorted({first_line(n) for n in (node, *others)})
    if len(numbers) == 1:
        return f"line {numbers[0]}"
    return f"lines {', '.join(map(str, numbers[:-1]))} and {numbers[-1]}"
