"""Operators that log wrongly, or not at all."""

from __future__ import annotations

import re
from collections.abc import Iterator

import libcst as cst

from grader.selftest.mutating.bodies import lines_of, parameters
from grader.selftest.mutating.program import (
    LEVELS,
    Change,
    Program,
    into,
    is_docstring,
    short,
    statement,
    string,
    text_of,
)

_WORD = re.compile(r"(?<![%{\\\w/~.])[A-Za-z]{3,}")
_QUIET, _LOUD = "debug", "error"


def print_instead(program: Program) -> Iterator[Change]:
    """`print` instead of the logger."""
    for call in _logs(program):
        after = cst.Call(cst.Name("print"), [_plain(arg) for arg in call.args[:1]])
        yield Change(call, into(program.code(call), program.code(after)), ((call, after),))


def log_level(program: Program) -> Iterator[Change]:
    """A log that nobody sees because it is for debugging, or one that cries for help."""
    for call in _logs(program):
        for level in (_QUIET, _LOUD):
            if isinstance(call.func, cst.Attribute) and call.func.attr.value != level:
                yield Change(call, into(call.func.attr.value, level), ((call.func.attr, cst.Name(level)),))


def log_every_message(program: Program) -> Iterator[Change]:
    """The report comes with each message, not by the timer."""
    for heard in program.handed_to("create_subscription"):
        for timer in program.handed_to("create_timer"):
            lines = lines_of(heard)
            if lines and parameters(timer) == ["self"] and parameters(heard)[:1] == ["self"]:
                last = lines[-1]
                added = cst.FlattenSentinel([last, statement(f"self.{timer.name.value}()")])
                yield Change(heard, f"{heard.name.value} calls {timer.name.value}", ((last, added),))


def text(program: Program) -> Iterator[Change]:
    """Another text: a word that is misspelt, in a log, an answer or a format."""
    for node in program.all(cst.SimpleString):
        said = text_of(node)
        if said is not None and not is_docstring(program, node) and _is_prose(said) and (word := _WORD.search(said)):
            after = said[: word.start()] + word[0][:-1] + said[word.end() :]
            yield Change(node, into(said, after), ((node, string(after)),))
    for part in program.all(cst.FormattedStringText):
        if word := _WORD.search(part.value):
            after = part.value[: word.start()] + word[0][:-1] + part.value[word.end() :]
            yield Change(part, into(part.value, after), ((part, part.with_changes(value=after)),))


def rounding(program: Program) -> Iterator[Change]:
    """Digits that are lost in a text: `.0f` for `.3f`."""
    for part in program.all(cst.FormattedStringExpression):
        spec = "".join(program.code(piece) for piece in part.format_spec or ())
        if spec.endswith("f") and spec != ".0f":
            after = part.with_changes(format_spec=[cst.FormattedStringText(".0f")])
            yield Change(part, into(program.code(part), program.code(after)), ((part, after),))
    for node in program.all(cst.SimpleString):
        said = text_of(node)
        if said is not None and (match := re.search(r"%\.[1-9]f", said)):
            after_text = said[: match.start()] + "%.0f" + said[match.end() :]
            yield Change(node, into(said, after_text), ((node, string(after_text)),))


def missing_value(program: Program) -> Iterator[Change]:
    """A text that does not say the value."""
    for part in program.all(cst.FormattedStringExpression):
        yield Change(part, f"no {short(program.code(part))}", ((part, cst.FormattedStringText("?")),))


def _logs(program: Program) -> list[cst.Call]:
    """Return the calls of a logger; other things have methods of these names, but not with a text first."""
    found = [call for call in program.calls(*LEVELS) if isinstance(call.func, cst.Attribute) and call.args]
    return [call for call in found if "log" in program.code(call.func).lower()]


def _plain(arg: cst.Arg) -> cst.Arg:
    return arg.with_changes(comma=cst.MaybeSentinel.DEFAULT, keyword=None, equal=cst.MaybeSentinel.DEFAULT)


def _is_prose(said: str) -> bool:
    """Whether a text is for people: names of topics, nodes and files have no blanks."""
    return " " in said.strip()
