"""The rules of diagnosis: which cases a rule may explain, as data, and a function that finds hint and place."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

from grader.core.dataclass import dataclass
from grader.core.exercise import Check, Criterion, Location, Outcome, ProblemKind
from grader.core.report import Verdict
from grader.core.trace import Fault, FaultKind, Trace
from grader.judging.checks.fan import ThresholdResponse
from grader.judging.checks.rate import TopicRate
from grader.judging.checks.received import LogsReceived
from grader.judging.checks.together import AnswersTogether
from grader.judging.checks.topics import Publishes, Subscribes
from grader.judging.diagnosis.wiring import made_for
from grader.judging.source import Source, first_line
from grader.judging.values import published, student_endpoints

_FRAME = re.compile(r"(?P<file>.*):(?P<line>\d+) in (?P<name>\S+)$")
#: Stands for a missing file; nothing is found in it.
NO_SOURCE = Source("")
_ANYTHING = re.compile("")
Given = TypeVar("Given")


@dataclass(frozen=True, slots=True)
class Clue:
    """The very likely cause.

    Attributes:
        location: The line to look at; None keeps the one from the check.
        key: Clues with equal keys have the same cause; by default the rule and the location.
    """

    hint: str
    location: Location | None = None
    key: str = ""


@dataclass(frozen=True, slots=True)
class Case:
    """A verdict that lost points, with everything that may explain it.

    Attributes:
        sources: Wanted file name -> source, for the submitted files of the scenario.
        siblings: The checks of the exercise's other criteria.
    """

    criterion: Criterion
    verdict: Verdict
    trace: Trace
    sources: Mapping[str, Source]
    fault: Fault | None = None
    siblings: tuple[Check, ...] = ()

    @property
    def check(self) -> Any:
        """The check that was not met: one of those that the rule lists."""
        return self.criterion.check

    @property
    def process(self) -> str:
        """The one file that the criterion is about; empty if there are several."""
        named = str(getattr(self.check, "process", ""))
        if self.fault is not None:
            return self.fault.process
        return named or (next(iter(self.sources)) if len(self.sources) == 1 else "")

    @property
    def source(self) -> Source:
        """The source of the one file that the criterion is about; an empty one if there is none."""
        return self.sources.get(self.process, NO_SOURCE)

    def is_about(self, kind: ProblemKind) -> bool:
        """Return whether the check found a kind of problem."""
        return self.verdict.problem is not None and self.verdict.problem.kind is kind

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics of the problem."""
        return self.verdict.problem.topics if self.verdict.problem is not None else ()

    def evidence(self, key: str) -> object:
        """Return a value from the verdict's evidence, None if the key does not exist."""
        return self.verdict.evidence.get(key)


@dataclass(frozen=True, slots=True)
class Crash:
    """A fault that a verdict rests on, prepared for a rule.

    Attributes:
        source: The file in which it arose; an empty one if it was not submitted.
        found: The match of the rule's pattern in its text.
    """

    case: Case
    fault: Fault
    source: Source
    found: re.Match[str]

    @property
    def line(self) -> int:
        """The line at which it arose."""
        return self.fault.line

    def said(self, pattern: str) -> re.Match[str] | None:
        """Return the match of a pattern in an exception's text."""
        return self.fault.said(pattern) if self.fault.kind is FaultKind.EXCEPTION else None

    def frames(self) -> list[tuple[int, str]]:
        """Return line and function of the fault's frames in its own file, outermost first."""
        matches = (_FRAME.match(frame) for frame in self.fault.frames)
        return [(int(m["line"]), m["name"]) for m in matches if m and m["file"] == self.fault.file]


@dataclass(frozen=True, slots=True)
class Rule:
    """A common mistake.

    Attributes:
        find: Returns the clue if this mistake is very likely, else None; called only if all other conditions hold.
        problem: Problem that the check must have found; any or none if None.
        outcome: Outcome that it explains; any if None.
        fault: Whether the verdict must rest on a fault (True) or on none (False); either if None.
        text: Pattern that the text of an exception must have; empty for any.
    """

    id: str
    find: Callable[[Case], Clue | None]
    checks: tuple[type, ...] = ()
    problem: ProblemKind | None = None
    outcome: Outcome | None = None
    fault: bool | None = False
    text: str = ""

    def clue(self, case: Case) -> Clue | None:
        """Return the rule's clue for a case; None if it does not apply."""
        applies = (
            (not self.checks or isinstance(case.check, self.checks))
            and self.fault in (None, case.fault is not None)
            and self.outcome in (None, case.verdict.outcome)
            and (self.problem is None or case.is_about(self.problem))
        )
        return self.find(case) if applies else None


Maker = Callable[[Callable[[Given], Clue | None]], Rule]


def _case(case: Case) -> Case:
    return case


def rule(
    *checks: type,
    problem: ProblemKind | None = None,
    outcome: Outcome | None = None,
    fault: bool | None = False,
    given: Callable[[Case], Given | None] = _case,  # type: ignore[assignment]
) -> Maker[Given]:
    """Turn a function into a rule; the arguments are those of `Rule`.

    Args:
        checks: Checks that it explains; any if there are none.
        problem: Problem that the check must have found.
        outcome: Outcome that it explains.
        fault: Whether the verdict must rest on a fault, or on none; None for either.
        given: Computes the argument of the function from the case. If it returns None, the rule does not apply.
    """

    def make(find: Callable[[Given], Clue | None]) -> Rule:
        def found(case: Case) -> Clue | None:
            known = given(case)
            return None if known is None else find(known)

        return Rule(find.__name__.removeprefix("_"), found, checks, problem, outcome, fault)

    return make


def crash_rule(text: str = "", *kinds: FaultKind, in_file: bool = True) -> Maker[Crash]:
    """Turn a function into a rule for faults of some kinds, exceptions if none are given, whose text has a pattern."""
    make = rule(fault=True, given=partial(_crash, text, kinds or (FaultKind.EXCEPTION,), in_file))
    return lambda find: replace(make(find), text=text)


def _crash(text: str, kinds: tuple[FaultKind, ...], in_file: bool, case: Case) -> Crash | None:  # noqa: FBT001
    fault, source = case.fault, case.source
    if fault is None or fault.kind not in kinds:
        return None
    found = fault.said(text) if text else _ANYTHING.match("")
    if fault.file not in ("", source.file):
        source = NO_SOURCE
    return None if found is None or (in_file and source is NO_SOURCE) else Crash(case, fault, source, found)


def lines_of(node: ast.AST, *others: ast.AST) -> str:
    """Return `line 7`, or `lines 7 and 9`, for text."""
    numbers = sorted({first_line(n) for n in (node, *others)})
    if len(numbers) == 1:
        return f"line {numbers[0]}"
    return f"lines {', '.join(map(str, numbers[:-1]))} and {numbers[-1]}"


def silent_topic(case: Case) -> str:
    """Return the topic on which expected messages are missing; empty if that is not the problem."""
    check = case.check
    if isinstance(check, (Publishes, TopicRate)):
        asked = [check.topic]
    elif isinstance(check, ThresholdResponse):
        asked = [check.output]
    else:
        asked = [check.input, check.output] if isinstance(check, AnswersTogether) else []
    type_ = check.type if isinstance(check, Publishes) else None
    silent = (t for t in asked if not any(type_ in (None, m.type) for m in published(case.trace, t)))
    return next(silent, "")


def unheard_topic(case: Case) -> str:
    """Return the topic without a matching subscription; empty if that is not the problem."""
    check = case.check
    if isinstance(check, ThresholdResponse):
        topic = check.input if silent_topic(case) else ""
    elif isinstance(check, AnswersTogether):
        topic = check.input if silent_topic(case) == check.output else ""
    else:
        topic = check.topic if isinstance(check, (Subscribes, LogsReceived)) else ""
    type_ = check.type if isinstance(check, Subscribes) else None
    there = [e for e in student_endpoints(case.trace, "subscription", topic) if type_ in (None, e.type)]
    return "" if there else topic


def file_for(case: Case, kind: str, topic: str) -> Source:
    """Return the file that should create an endpoint: the only file, or the only one without the topic's other end."""
    if case.process in case.sources:
        return case.source
    other = "subscription" if kind == "publisher" else "publisher"
    files = list(case.sources.values())
    chosen = files if len(files) == 1 else [s for s in files if made_for(s, other, topic) is None]
    return chosen[0] if len(chosen) == 1 else NO_SOURCE
