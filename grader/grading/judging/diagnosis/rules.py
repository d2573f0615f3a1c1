"""Hint rules: the cases that a rule may explain, its place among all rules, and a function that finds the hint."""

from __future__ import annotations

import ast
import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import field, replace
from functools import partial
from typing import Any, TypeVar

from grader.grading.judging.diagnosis.wiring import Made, is_log, made_for, number_in_code, value_of
from grader.grading.judging.logs.outputs import student_records
from grader.grading.judging.source import Source, chain, first_line
from grader.grading.judging.values import published, student_endpoints
from grader.grading.model.exercise import Check, Criterion, Location, Outcome, ProblemKind, roles_of, texts_under
from grader.grading.model.report import Verdict
from grader.grading.model.wording import number
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import Fault, FaultKind, Trace

_FRAME = re.compile(r"(?P<file>.*):(?P<line>\d+) in (?P<name>\S+)$")
#: Stands for a missing file; nothing is found in it.
NO_SOURCE = Source("")
_ANYTHING = re.compile("")
#: The checks of a client of an action, by their names in rubrics.
CLIENT_CHECKS = ("sends_goals", "after_goal", "cancels_goal")
#: The place of a rule of a rubric's own, unless it says another: before all rules of the grader, which begin at 1000.
FIRST = 100
#: Largest relative difference of two rates or periods that are taken for the same.
SAME_PACE = 0.03
Given = TypeVar("Given")


@dataclass(frozen=True, slots=True)
class Clue:
    """The very likely cause.

    Attributes:
        location: The line to look at; None keeps the one from the check.
        key: Clues with equal keys have the same cause; by default the rule and the location.
        same_as: Id of an earlier criterion in `Case.lost` with the same cause, which then is all that is said.
    """

    hint: str = ""
    location: Location | None = None
    key: str = ""
    same_as: str = ""


@dataclass(frozen=True, slots=True)
class Case:
    """A verdict that lost points, with everything that may explain it.

    Attributes:
        sources: Wanted file name -> source, for the submitted files of the scenario.
        fault: The fault that the verdict rests on; None for none.
        others: The exercise's other criteria.
        facts: What the check hands to rules, see `Finding.facts`.
        lost: The earlier criteria that were not met, by id.
    """

    criterion: Criterion
    verdict: Verdict
    trace: Trace
    sources: Mapping[str, Source]
    fault: Fault | None = None
    others: tuple[Criterion, ...] = ()
    facts: Any = None
    lost: Mapping[str, Criterion] = field(default_factory=dict)
    #: What rules have computed from it, by the function that did: many rules ask for the same.
    known: dict[object, Any] = field(default_factory=dict, init=False, compare=False, repr=False)

    @property
    def check(self) -> Any:
        """The check that was not met: one of those that the rule lists."""
        return self.criterion.check

    @property
    def process(self) -> str:
        """The one file that the criterion is about; empty if there are several."""
        if self.fault is not None:
            return self.fault.process
        own = texts_under(self.check, roles_of(type(self.check)).process)
        return own[0] if own else (next(iter(self.sources)) if len(self.sources) == 1 else "")

    @property
    def source(self) -> Source:
        """The source of the one file that the criterion is about; an empty one if there is none."""
        return self.sources.get(self.process, NO_SOURCE)

    @property
    def siblings(self) -> tuple[Check, ...]:
        """The checks of the exercise's other criteria."""
        return tuple(criterion.check for criterion in self.others)

    def asked(self, name: str) -> list[Any]:
        """Return the checks of other criteria that have this name in rubrics."""
        return [criterion.check for criterion in self.others if criterion.check_name == name]

    def is_about(self, kind: ProblemKind) -> bool:
        """Return whether the check found a kind of problem."""
        return self.verdict.problem is not None and self.verdict.problem.kind is kind

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics of the problem."""
        return self.verdict.problem.topics if self.verdict.problem is not None else ()

    def found(self, kind: type[Given]) -> Given | None:
        """Return the facts of the check if they are of one kind, such as `RateFacts`; None otherwise."""
        return self.facts if isinstance(self.facts, kind) else None

    @property
    def hears(self) -> tuple[str, ...]:
        """The topics to which a node has to subscribe, as far as the check declares them."""
        return texts_under(self.check, *roles_of(type(self.check)).hears)

    @property
    def speaks(self) -> tuple[str, ...]:
        """The topics on which the check misses messages, as far as it declares them."""
        return texts_under(self.check, *roles_of(type(self.check)).speaks)

    @property
    def logs(self) -> tuple[str, ...]:
        """The topics of which the process has to log what arrives, as far as the check declares them."""
        return texts_under(self.check, *roles_of(type(self.check)).logs)

    @property
    def serves(self) -> tuple[str, ...]:
        """The services that a node has to offer, as far as the check declares them."""
        return texts_under(self.check, *roles_of(type(self.check)).serves)

    @property
    def calls(self) -> tuple[str, ...]:
        """The services that a node has to call, as far as the check declares them."""
        return texts_under(self.check, *roles_of(type(self.check)).calls)

    @property
    def type(self) -> str:
        """The message type that the check asks for; empty if there is none."""
        return "".join(texts_under(self.check, roles_of(type(self.check)).type))


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
        id: Its name, which reports state.
        find: Returns the clue if this mistake is very likely, else None; called only if all other conditions hold.
        checks: Checks that it explains, as classes or by their names in rubrics; any if empty.
        problem: Problem that the check must have found; any or none if None.
        outcome: Outcome that it explains; any if None.
        fault: Whether the verdict must rest on a fault (True) or on none (False); either if None.
        text: Pattern that the text of an exception must have; empty for any.
        priority: Its place among all rules: the one with the lowest number is asked first, and the first clue wins.
        about: The mistake in a sentence, for `grade explain --rules`; may be empty.
        file: Path of the author's file with the rule; empty for a rule of the grader.
        function: What the decorator was above; None for a rule that was made without one.
    """

    id: str
    find: Callable[[Case], Clue | None]
    checks: tuple[type | str, ...] = ()
    problem: ProblemKind | None = None
    outcome: Outcome | None = None
    fault: bool | None = False
    text: str = ""
    priority: int = FIRST
    about: str = ""
    file: str = ""
    function: Callable[..., object] | None = None

    def explains(self, criterion: Criterion) -> bool:
        """Return whether it is about the check of a criterion."""
        kinds = tuple(check for check in self.checks if not isinstance(check, str))
        return not self.checks or isinstance(criterion.check, kinds) or criterion.check_name in self.checks

    def clue(self, case: Case) -> Clue | None:
        """Return the rule's clue for a case; None if it does not apply."""
        return self.find(case) if is_asked(self, case) else None


def is_asked(rule: Rule, case: Case) -> bool:
    """Return whether a rule is asked about a case."""
    return (
        rule.explains(case.criterion)
        and rule.fault in (None, case.fault is not None)
        and rule.outcome in (None, case.verdict.outcome)
        and (rule.problem is None or case.is_about(rule.problem))
    )


#: A decorator that makes a hint rule of a function.
Maker = Callable[[Callable[[Given], Clue | None]], Rule]


def _case(case: Case) -> Case:
    return case


def hint_rule(
    *checks: type | str,
    problem: ProblemKind | None = None,
    outcome: Outcome | None = None,
    fault: bool | None = False,
    priority: int = FIRST,
    given: Callable[[Case], Given | None] = _case,  # type: ignore[assignment]
) -> Maker[Given]:
    """Turn a function into a rule; the arguments are those of `Rule`.

    Args:
        checks: Checks that it explains, by their names in rubrics, or their classes; any if there are none.
        problem: Problem that the check must have found.
        outcome: Outcome that it explains.
        fault: Whether the verdict must rest on a fault, or on none; None for either.
        priority: Its place among all rules; the lowest number is asked first.
        given: Computes the argument of the function from the case. If it returns None, the rule does not apply.

    Raises:
        TypeError: A check is neither a name nor a class.
    """
    if not all(isinstance(check, (type, str)) for check in checks):
        raise TypeError("expected the names of checks, found a function: write @hint_rule() above it")

    def make(find: Callable[[Given], Clue | None]) -> Rule:
        def found(case: Case) -> Clue | None:
            if given not in case.known:
                case.known[given] = given(case)
            known: Given | None = case.known[given]
            return None if known is None else find(known)

        about = (find.__doc__ or "").strip().split("\n")[0]
        id_ = find.__name__.removeprefix("_")
        return Rule(id_, found, checks, problem, outcome, fault, priority=priority, about=about, function=find)

    return make


def crash_rule(text: str = "", *kinds: FaultKind, in_file: bool = True, priority: int = FIRST) -> Maker[Crash]:
    """Turn a function into a rule for faults of some kinds, exceptions if none are given, whose text has a pattern.

    Args:
        text: The pattern, searched in an exception as the last line of its traceback writes it.
        kinds: Kinds of faults.
        in_file: Whether the rule applies only if the fault arose in a file that was handed in.
        priority: Its place among all rules; the lowest number is asked first.
    """
    given = partial(_crash, text, kinds or (FaultKind.EXCEPTION,), in_file)
    make = hint_rule(fault=True, priority=priority, given=given)
    return lambda find: replace(make(find), text=text)


def _crash(text: str, kinds: tuple[FaultKind, ...], in_file: bool, case: Case) -> Crash | None:  # noqa: FBT001
    fault, source = case.fault, case.source
    if fault is None or fault.kind not in kinds:
        return None
    found = fault.said(text) if text else _ANYTHING.match("")
    if fault.file not in ("", source.file):
        source = NO_SOURCE
    return None if found is None or (in_file and source is NO_SOURCE) else Crash(case, fault, source, found)


def clue_flaw(clue: object, case: Case) -> str:
    """Describe what is wrong with what an author's rule returned for a case; empty if it can be reported."""
    if not isinstance(clue, Clue):
        return f"expected a Clue or None, found a {type(clue).__name__}"
    texts = {"hint": clue.hint, "key": clue.key, "same_as": clue.same_as}
    wrong = next((name for name, text in texts.items() if not isinstance(text, str)), "")
    if wrong:
        return f"expected a clue with a string as {wrong}, found a {type(texts[wrong]).__name__}"
    place = clue.location
    if not isinstance(place, (Location, type(None))):
        return f"expected a clue with a Location, found a {type(place).__name__}"
    if place is not None and (not place.file or place.line < 1):
        return f"expected a clue with a file and a line from 1 on, found `{place.file}:{place.line}`"
    if clue.same_as and clue.same_as not in case.lost:
        return f"expected the id of an earlier criterion that was not met, found `{clue.same_as}`"
    return "" if clue.hint or clue.same_as else "expected a clue with a hint, found an empty one"


def log_call(case: Case) -> ast.Call | None:
    """Return the call that wrote most of the log records; the only one in the file if none wrote any; else None."""
    source = case.source
    lines = Counter(r.line for r in student_records(case.trace, case.process) if r.file == source.file and r.line)
    for row, _ in lines.most_common():
        call = next((c for c in source.on_line(row, ast.Call) if is_log(source, c)), None)
        if call is not None:
            return call
    logs = [n for n in source.all(ast.Call) if is_log(source, n)]
    return logs[0] if len(logs) == 1 else None


def same_pace(one: float, other: float) -> bool:
    """Return whether two rates or two periods, in the text or measured, are taken for the same."""
    return math.isclose(one, other, rel_tol=SAME_PACE)


def rounded_down(source: Source, timer: Made, period_s: float) -> Clue | None:
    """Return a clue if an integer division, or `int`, makes 0 of a period."""
    value = value_of(source, timer.period)
    for node in ast.walk(value) if value is not None else ():
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.FloorDiv):
            ends = [number_in_code(source, side) for side in (node.left, node.right)]
            right, why = f"{source.code(node.left, 30)} / {source.code(node.right, 30)}", "// rounds down"
            period = ends[0] / ends[1] if ends[0] is not None and ends[1] else 0.0
        elif isinstance(node, ast.Call) and chain(node.func) in ("int", "round") and len(node.args) == 1:
            right, why = source.code(node.args[0], 40), f"{chain(node.func)} makes an integer of it"
            period = number_in_code(source, node.args[0]) or 0.0
        else:
            continue
        better = right if same_pace(period, period_s) else number(period_s)
        return Clue(f"{source.code(node, 40)} is 0, because {why}: write {better}", source.place(node))
    return None


def lines_of(node: ast.AST, *others: ast.AST) -> str:
    """Return `line 7`, or `lines 7 and 9`, for text."""
    numbers = sorted({first_line(n) for n in (node, *others)})
    if len(numbers) == 1:
        return f"line {numbers[0]}"
    return f"lines {', '.join(map(str, numbers[:-1]))} and {numbers[-1]}"


def rules_in_order(rules: Iterable[Rule]) -> tuple[Rule, ...]:
    """Return rules in the order in which they are asked; of equal priorities, the first stays first."""
    return tuple(sorted(rules, key=lambda rule: rule.priority))


def silent_topic(case: Case) -> str:
    """Return the topic on which expected messages are missing; empty if that is not the problem."""
    return next((t for t in case.speaks if not any(case.type in ("", m.type) for m in published(case.trace, t))), "")


def unheard_topic(case: Case) -> str:
    """Return the topic without a matching subscription; empty if that is not the problem.

    A check that expects messages too says so only where those that answer the topic are missing.
    """
    topic = next(iter(case.hears), "")
    if case.speaks and silent_topic(case) in ("", topic):
        return ""
    there = [e for e in student_endpoints(case.trace, "subscription", topic) if case.type in ("", e.type)]
    return "" if there else topic


def asked_topics(case: Case) -> set[str]:
    """Return the topics that a check names, or that its problem is about."""
    return {*case.topics, *texts_under(case.check, *roles_of(type(case.check)).topics)}


def heard_topics(case: Case) -> set[str]:
    """Return the topics to which nodes of the student subscribe."""
    return {end.topic for end in student_endpoints(case.trace, "subscription")}


def is_told(case: Case) -> bool:
    """Return whether a check is about a topic of the grader's that no node hears: what a simulation makes of it all."""
    return any(case.trace.deliveries(topic) for topic in asked_topics(case) - heard_topics(case))


def file_for(case: Case, kind: str, topic: str) -> Source:
    """Return the file that should create an endpoint: the only file, or the only one without the topic's other end."""
    if case.process in case.sources:
        return case.source
    other = "subscription" if kind == "publisher" else "publisher"
    files = list(case.sources.values())
    chosen = files if len(files) == 1 else [s for s in files if made_for(s, other, topic) is None]
    return chosen[0] if len(chosen) == 1 else NO_SOURCE
