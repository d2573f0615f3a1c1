"""Hint rules of project 3: what a client decides by, how often it asks, and what a server answers."""

from __future__ import annotations

import ast
from dataclasses import dataclass

from grader.api import Case, Clue, LogRecord, Outcome, ProblemKind, Response, calls_of, hint_rule
from grader.api.unstable import (
    Function,
    Source,
    Switch,
    argument,
    chain,
    first_line,
    given_leaf,
    is_log,
    last_name,
    literal_text,
    number,
    number_in_code,
    pauses,
    reached,
    roots,
    subtree,
    switches,
    text_comparisons,
    unformatted_fields,
)


@dataclass(frozen=True, slots=True)
class _Reaction:
    """What a client logged between a response and its next request."""

    records: tuple[LogRecord, ...]

    @property
    def warned(self) -> bool:
        return any(r.severity in ("WARN", "ERROR", "FATAL") for r in self.records)

    def lines(self, severity: str) -> set[int]:
        return {r.line for r in self.records if r.severity == severity}


def _after(case: Case, kind: str) -> list[_Reaction]:
    """Return the reactions to the responses of a kind."""
    mine = (e for e in case.check.episodes(case.trace) if e.kind.value == kind)
    return [_Reaction(tuple(o for o in e.sure if isinstance(o, LogRecord))) for e in mine]


@hint_rule("reacts_to_responses", outcome=Outcome.NOT_MET, priority=3140)
def _wrong_level(case: Case) -> Clue | None:
    """One side logs at the level of the other, or at a level that is not shown."""
    check = case.check
    good, low = _after(case, "good"), _after(case, "low")
    if check.side == "above" and good and low and all(a.warned for a in good + low):
        lines = set.intersection(*(a.lines("WARN") for a in good)) - set().union(*(a.lines("WARN") for a in low))
        return _level_clue(case, lines, f"use info above {number(check.threshold)}")
    if check.side == "at_or_below" and good and low and not any(a.warned for a in good + low):
        lines = set.intersection(*(a.lines("INFO") for a in low)) - set().union(*(a.lines("INFO") for a in good))
        return _level_clue(case, lines, "use warning") or _unseen_level(case, "warning")
    return _unseen_level(case, "info") if check.side == "above" and not any(a.warned for a in good) else None


def _level_clue(case: Case, lines: set[int], advice: str) -> Clue | None:
    calls = [c for line in sorted(lines) for c in case.source.on_line(line, ast.Call) if is_log(case.source, c)]
    if len(calls) != 1:
        return None
    hint = f"{case.source.code(calls[0], 60)} has the wrong level, {last_name(calls[0].func)}: {advice}"
    return Clue(hint, case.source.place(calls[0]))


def _unseen_level(case: Case, level: str) -> Clue | None:
    """Return the only log of level DEBUG, which nobody sees."""
    hidden = [c for c in case.source.calls("debug") if is_log(case.source, c)]
    if len(hidden) != 1 or any(case.source.calls("set_level", "set_logger_level")):
        return None
    hint = f"{case.source.code(hidden[0], 60)} is not shown, because the default level is INFO: use {level}"
    return Clue(hint, case.source.place(hidden[0]))


# --- the client: what it compares -------------------------------------------------------------------------------------


@hint_rule("reacts_to_responses", outcome=Outcome.NOT_MET, priority=3141)
def _charge_as_text(case: Case) -> Clue | None:
    """`percent > '20'` compares alphabetically."""
    test = next(iter(text_comparisons(case.source, case.source.all(ast.Compare))), None)
    if test is None:
        return None
    limit = number(case.check.threshold)
    hint = f"{case.source.code(test, 50)} compares strings, not numbers: compare float(...) with {limit}"
    return Clue(hint, case.source.place(test), key="charge")


@hint_rule("reacts_to_responses", outcome=Outcome.NOT_MET, priority=3142)
def _other_limit(case: Case) -> Clue | None:
    """The comparison has another limit, includes the limit itself, or is the wrong way round."""
    source, limit = case.source, case.check.threshold
    here, charges = switches(source, limit), [s for s in switches(source) if s.limit.value > 1]
    if len(here) == 1:
        return _turned(case, here[0]) or (_at_the_limit(source, here[0]) if case.check.side != "above" else None)
    if here or len(charges) != 1:
        return None
    hint = f"{source.code(charges[0].node, 40)} compares with {number(charges[0].limit.value)}: the limit is "
    return Clue(f"{hint}{number(limit)}", source.place(charges[0].limit.origin), key="charge")


def _turned(case: Case, switch: Switch) -> Clue | None:
    """Return a clue if the client warns above the limit, and not below it."""
    good, low = _after(case, "good"), _after(case, "low")
    if not good or not low or not all(a.warned for a in good) or all(a.warned for a in low):
        return None
    code = case.source.code(switch.node, 40)
    hint = f"the branches of '{code}' are the wrong way round: above {number(case.check.threshold)} the mission starts"
    return Clue(hint, case.source.place(switch.node), key="charge")


def _at_the_limit(source: Source, switch: Switch) -> Clue | None:
    """Return a clue if a comparison takes the limit itself for a number above it."""
    code, limit = source.code(switch.node, 40), number(switch.limit.value)
    if isinstance(switch.op, ast.GtE):
        return Clue(f"{code} is true at exactly {limit}: write > instead of >=", source.place(switch.node))
    if isinstance(switch.op, ast.Lt):
        return Clue(f"{code} is false at exactly {limit}: write <= instead of <", source.place(switch.node))
    return None


@hint_rule("reacts_to_responses", outcome=Outcome.NOT_MET, priority=3143)
def _nothing_compared(case: Case) -> Clue | None:
    """`if percent:` is true for every number but 0."""
    source = case.source
    if switches(source):
        return None
    logged = {test for call in source.all(ast.Call) if is_log(source, call) for test in source.around(call, ast.If)}
    for test in sorted(logged, key=first_line):
        name = test.test
        if not isinstance(name, (ast.Name, ast.Attribute)) or not _is_number(source, name):
            continue
        code = source.code(name, 40)
        hint = f"'if {code}' is true for every number but 0: write if {code} > {number(case.check.threshold)}"
        return Clue(hint, source.place(test), key="charge")
    return None


def _is_number(source: Source, name: ast.Name | ast.Attribute) -> bool:
    """Return whether a variable is assigned the result of float or int."""
    values = (getattr(source.parents.get(n), "value", None) for n in source.stored.get(chain(name), ()))
    return any(isinstance(v, ast.Call) and chain(v.func) in ("float", "int") for v in values)


#: Methods that cut a part out of a text.
_CUTTING = ("split", "rsplit", "partition", "rpartition", "strip", "lstrip", "rstrip", "replace", "removesuffix")
#: So many steps back to the message are followed, of texts of so many characters: a program may name a variable by
#: itself, and make a text longer with each replacement.
MOST_CUTS, LONGEST = 20, 4_000


@hint_rule("reacts_to_responses", outcome=Outcome.NOT_MET, priority=3138)
def _no_number_cut(case: Case) -> Clue | None:
    """What is cut out of the response is not a number: float raises an exception that the program catches."""
    texts = [str(r.value.get("message", "")) for r in case.trace.of(Response)]
    text = next(filter(None, texts), "")
    for call in case.source.calls("float") if text else ():
        part = _cut_out(call.args[0], case.source, text) if call.args else None
        if not isinstance(part, str):
            continue
        try:
            float(part)
        except ValueError:
            code = case.source.code(call, 60)
            hint = f"{code} gets '{part.strip()[:30]}', which is not a number: cut off what is not part of it"
            return Clue(hint, case.source.place(call), key="charge")
    return None


def _cut_out(node: ast.AST | None, source: Source, text: str, left: int = MOST_CUTS) -> object:
    """Return what an expression cuts out of the message of a response; None if that is not plain to see."""
    if isinstance(node, ast.Attribute) and node.attr == "message":
        return text
    if isinstance(node, ast.Name) and left:
        values = [getattr(source.parents.get(n), "value", None) for n in source.stored.get(node.id, ())]
        return _cut_out(values[0], source, text, left - 1) if len(values) == 1 else None
    if isinstance(node, ast.Subscript) and left:
        whole, place = _cut_out(node.value, source, text, left - 1), number_in_code(source, node.slice)
        if isinstance(whole, (list, tuple)) and place is not None and -len(whole) <= place < len(whole):
            return whole[int(place)]
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in _CUTTING and left:
        whole = _cut_out(node.func.value, source, text, left - 1)
        given = [literal_text(one) or "" for one in node.args]
        if isinstance(whole, str) and "" not in given and not node.keywords:
            return _called(whole, node.func.attr, given)
    return None


def _called(whole: str, method: str, given: list[str]) -> object:
    """Return what a method of a text returns; None if it does not take these arguments, or the text may become long."""
    if len(whole) * max(map(len, given), default=1) > LONGEST:
        return None
    try:
        return getattr(whole, method)(*given)
    except TypeError:
        return None


#: Functions that make an integer of a number.
_ROUNDING = ("int", "round", "floor", "ceil", "trunc")
#: What of a regular expression reads an integer -> what reads a decimal number as well.
_DIGITS = {r"\d+": r"[\d.]+", "[0-9]+": "[0-9.]+", r"\d*": r"[\d.]*", r"\d{2}": r"[\d.]+"}


@hint_rule("reacts_to_responses", outcome=Outcome.NOT_MET, priority=3144)
def _fraction_dropped(case: Case) -> Clue | None:
    """The number is read without its decimals, so that the limit is taken for reached just above it."""
    warned = [a.warned for a in _after(case, "good")]
    source, limit = case.source, number(case.check.threshold)
    if not any(warned) or all(warned):
        return None
    nodes: list[ast.expr] = [*source.all(ast.Call), *source.all(ast.Subscript), *source.all(ast.Constant)]
    found = [(node, better) for node in nodes if (better := _with_decimals(source, node))]
    if len(found) != 1:
        return None
    hint = f"{source.code(found[0][0], 50)} drops the decimals, so {limit}.1 becomes {limit}: write {found[0][1]}"
    return Clue(hint, source.place(found[0][0]), key="charge")


def _with_decimals(source: Source, node: ast.expr) -> str:
    """Return what reads the decimals too; empty if a node does not drop any."""
    if isinstance(node, ast.Call) and last_name(node.func) in _ROUNDING and len(node.args) == 1:
        inner = node.args[0]
        code = source.code(inner, 40)
        return code if isinstance(inner, ast.Call) and chain(inner.func) == "float" else f"float({code})"
    if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Call):
        call = node.value
        cut = last_name(call.func) in ("split", "partition") and literal_text(argument(call, 0, "sep")) == "."
        return source.code(call.func.value, 40) if cut and isinstance(call.func, ast.Attribute) else ""
    pattern = literal_text(node)
    asked = source.parents.get(node)
    used = isinstance(asked, ast.Call) and source.resolved(asked.func).startswith("re.")
    digits = next((d for d in _DIGITS if pattern is not None and d in pattern), "")
    if pattern is None or not used or not digits or r"\." in pattern or "." in pattern.replace(".*", ""):
        return ""
    return source.code(node, 60).replace(digits, _DIGITS[digits])


# --- the client: how often it asks ------------------------------------------------------------------------------------


@hint_rule("service_calls", outcome=Outcome.NOT_MET, priority=3150)
def _other_count(case: Case) -> Clue | None:
    """The loop that asks turns another number of times."""
    source, wanted = case.source, case.check.calls
    asked = len(calls_of(case.trace, case.check.service, "student"))
    if not (case.is_about(ProblemKind.TOO_FEW) or case.is_about(ProblemKind.TOO_MANY)):
        return None
    for loop in source.all(ast.For):
        times = _turns(source, loop)
        if times is not None and times == asked and _asks(source, loop):
            hint = f"{source.code(loop.iter, 40)} gives {times} questions: write {_range(source, loop, wanted)}"
            return Clue(hint, source.place(loop))
    return None


def _range(source: Source, loop: ast.For, times: int) -> str:
    """Return a range from the same number on that turns so many times."""
    given = loop.iter.args if isinstance(loop.iter, ast.Call) else []
    first = number_in_code(source, given[0]) if len(given) == 2 else None
    return f"range({times})" if first is None else f"range({number(first)}, {number(first + times)})"


def _turns(source: Source, loop: ast.For) -> int | None:
    """Return how often a loop over `range(...)` turns; None if the text does not show it."""
    call = loop.iter
    if not isinstance(call, ast.Call) or chain(call.func) != "range" or not 1 <= len(call.args) <= 3:
        return None
    limits = [number_in_code(source, a) for a in call.args]
    if None in limits or (len(limits) == 3 and limits[2] == 0):
        return None
    return len(range(*(int(limit or 0) for limit in limits)))


def _asks(source: Source, loop: ast.AST) -> bool:
    return any(isinstance(n, ast.Call) and last_name(n.func) in ("call_async", "call") for n in reached(source, [loop]))


@hint_rule("service_calls", problem=ProblemKind.WRONG_RATE, priority=3151)
def _other_pause(case: Case) -> Clue | None:
    """The pause of the loop that asks is another one, or is missing."""
    source = case.source
    wanted = number((case.check.period or 0) / 1e9)
    loops = [loop for loop in source.loops() if _asks(source, loop)]
    if not loops:
        return None
    sleeps = [n for n in reached(source, loops[:1]) if isinstance(n, ast.Call) and last_name(n.func) == "sleep"]
    always = [n for n in sleeps if not _at_times(source, n, loops[0])]
    asked = [call.request.t_ns for call in calls_of(case.trace, case.check.service, "student")]
    hasty = len(asked) > 1 and 2 * (asked[1] - asked[0]) < (case.check.period or 0)
    if not always and hasty:
        return Clue(f"this loop asks again at once: add time.sleep({wanted}) at its end", source.place(loops[0]))
    given = [(n, number_in_code(source, argument(n, 0, "secs"))) for n in always]
    other = [(n, seconds) for n, seconds in given if seconds is not None and number(seconds) != wanted]
    if len(other) != 1:
        return None
    hint = f"{source.code(other[0][0], 40)} pauses for {number(other[0][1])} s: write time.sleep({wanted})"
    return Clue(hint, source.place(other[0][0]))


def _at_times(source: Source, node: ast.AST, loop: ast.AST) -> bool:
    """Return whether a node of a loop runs under a condition or after an exception only."""
    inside = set(subtree(loop))
    return any(isinstance(n, (ast.If, ast.ExceptHandler)) and n in inside for n in source.around(node, ast.AST))


# --- the client: what it takes for an answer --------------------------------------------------------------------------


@hint_rule("no_go_without_answer", outcome=Outcome.NOT_MET, priority=3155)
def _success_ignored(case: Case) -> Clue | None:
    """The file never asks for `success`."""
    source = case.source
    reads = [n for n in source.all(ast.Attribute) if n.attr == "message" and isinstance(n.ctx, ast.Load)]
    asked = any(n.attr == "success" for n in source.all(ast.Attribute))
    if asked or not reads or _went_on_after(case) != "failed":
        return None
    owner = source.code(reads[0].value, 40)
    return Clue(f"{owner}.success is never looked at: read {owner}.message only if it is true", source.place(reads[0]))


def _went_on_after(case: Case) -> str:
    """Return the kind of the useless response after which the client was seen to continue; empty if unknown."""
    moment_s = case.verdict.evidence.get("first_wrong_s")
    episodes = case.check.episodes(case.trace)
    if not isinstance(moment_s, (int, float)):
        return ""
    found = [e for e in episodes if e.start_ns <= moment_s * 1e9 + 1 and moment_s * 1e9 <= e.stop_ns]
    return str(found[-1].kind.value) if found else ""


# --- the server -------------------------------------------------------------------------------------------------------


def _answering(case: Case) -> tuple[Source, Function] | None:
    """Return the callback of the server, with its file."""
    for source in case.sources.values():
        for call in source.calls("create_service"):
            found = roots(source, argument(call, 2, "callback"))
            if len(found) == 1 and isinstance(found[0], Function):
                return source, found[0]
    return None


@hint_rule("service_sequence", problem=ProblemKind.WRONG_VALUE, priority=3160)
def _counted_wrongly(case: Case) -> Clue | None:
    """The number changes by another step, after the answer, from another start, or is reset to another number."""
    known, check = _answering(case), case.check
    if known is None:
        return None
    source, function = known
    inside = list(reached(source, [function]))
    changes = [n for n in inside if isinstance(n, ast.AugAssign) and isinstance(n.op, (ast.Sub, ast.Add))]
    if len(changes) != 1:
        return _signed(source, inside)
    change, target = changes[0], chain(changes[0].target)
    amount = number_in_code(source, change.value)
    step = None if amount is None else (-amount if isinstance(change.op, ast.Sub) else amount)
    sign = "-=" if check.step < 0 else "+="
    if step is not None and step != check.step:
        hint = f"{source.code(change)} changes it by {number(step)}: write {target} {sign} {number(abs(check.step))}"
        return Clue(hint, source.place(change), key="sequence")
    answers = [a for a in given_leaf(source, check.field) if a in inside]
    if answers and source.function_of(answers[0]) is function and first_line(change) > first_line(answers[0]):
        hint = f"{source.code(change)} comes after {source.code(answers[0], 40)}: change the number first, then answer"
        return Clue(hint, source.place(change), key="sequence")
    return _starts_or_restarts(case, source, target, inside)


def _signed(source: Source, inside: list[ast.AST]) -> Clue | None:
    """`self.charge =- 0.5` assigns the same number each time."""
    for node in inside:
        value = node.value if isinstance(node, ast.Assign) else None
        if not isinstance(node, ast.Assign) or not isinstance(value, ast.UnaryOp):
            continue
        code, target = source.code(node), source.code(node.targets[0])
        given, sign = source.code(value.operand, 30), "-" if isinstance(value.op, ast.USub) else "+"
        if f"={sign}" in code:
            hint = f"{code} assigns {sign}{given} each time: write {target} {sign}= {given}"
            return Clue(hint, source.place(node), key="sequence")
    return None


def _starts_or_restarts(case: Case, source: Source, target: str, inside: list[ast.AST]) -> Clue | None:
    check, stores = case.check, [source.parents.get(n) for n in source.stored.get(target, ())]
    plain = [s for s in stores if isinstance(s, ast.Assign)]
    early = [s for s in plain if s not in inside]
    first = number_in_code(source, early[0].value) if len(early) == 1 else None
    if first is not None and first != check.first - check.step:
        hint = f"{source.code(early[0])}: the number begins with {number(check.first - check.step)}"
        return Clue(hint, source.place(early[0]), key="sequence")
    again = [s for s in plain if s in inside]
    if check.reset_to is None or len(again) != 1:
        return None
    worth = number_in_code(source, again[0].value)
    if worth is not None and worth != check.reset_to:
        return Clue(f"{source.code(again[0])}: it goes back to {number(check.reset_to)}", source.place(again[0]))
    return _reset_at(case, source, again[0])


def _reset_at(case: Case, source: Source, again: ast.Assign) -> Clue | None:
    """Return a clue if the condition of the reset has another limit, or includes the limit itself."""
    test = next(source.around(again, ast.If), None)
    inside = set(subtree(test.test)) if test is not None else set()
    found = [s for s in switches(source) if s.node in inside]
    floor = case.check.floor
    if test is None or len(found) != 1 or floor is None:
        return None
    code = source.code(found[0].node, 40)
    if found[0].limit.value != floor:
        return Clue(f"{code}: it goes back below {number(floor)}, not before", source.place(test))
    if isinstance(found[0].op, (ast.LtE, ast.GtE)):
        strict = "<" if isinstance(found[0].op, ast.LtE) else ">"
        return Clue(f"{code} is true at {number(floor)} itself: write {strict}", source.place(test))
    return None


@hint_rule("service_response", outcome=Outcome.NOT_MET, priority=3161)
def _answer_line(case: Case) -> Clue | None:
    """The field is set in one place, to another text than the task asks for."""
    known, path = _answering(case), case.verdict.evidence.get("field")
    rule = case.check.fields.get(path) if isinstance(path, str) else None
    example = getattr(rule, "example", "") or ""
    if known is None or not example:
        return None
    source, function = known
    places = [a for a in given_leaf(source, str(path)) if source.function_of(a) is function]
    if len(places) != 1:
        return None
    value = getattr(places[0], "value", None)
    if value is not None and unformatted_fields(literal_text(value) or ""):
        hint = f"the f before the string is missing: f{source.code(value, 60)}"
        return Clue(hint, source.place(places[0]), key="unformatted")
    return Clue(f"{source.code(places[0], 60)} does not give such a text as '{example}'", source.place(places[0]))


@hint_rule("service_answers_all", outcome=Outcome.NOT_MET, priority=3162)
def _answers_late(case: Case) -> Clue | None:
    """The callback of the service sleeps."""
    for source in case.sources.values():
        pause = next((p for p in pauses(source) if p.spun is None), None)
        if pause is not None and any(source.calls("create_service")):
            code, name = source.code(pause.call, 40), source.function_name(pause.call)
            hint = f"{code} in {name} lets every client wait: remove it, and return the response at once"
            return Clue(hint, source.place(pause.call), key="answers_late")
    return None
