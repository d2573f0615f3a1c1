"""Operators that get periods wrong, or keep a node from coming back in time."""

from __future__ import annotations

from collections.abc import Iterator

import libcst as cst

from grader.selftest.mutating.bodies import at_top
from grader.selftest.mutating.program import SLEEPS, Change, Program, argument, expression, into

#: What people make of a period: a slip of ten, milliseconds, the half, the double, a quarter off.
_FACTORS = ("* 10", "/ 10", "* 1000", "/ 2", "* 2", "* 1.25", "* 0.75")


def period(program: Program) -> Iterator[Change]:
    """A period that is wrong by a factor: ten, two, milliseconds for seconds, or a quarter."""
    for given in _periods(program):
        before = program.code(given)
        inside = before if isinstance(given, (cst.Name, cst.Attribute, cst.BaseNumber)) else f"({before})"
        for factor in _FACTORS:
            yield Change(given, into(before, f"{inside} {factor}"), ((given, expression(f"{inside} {factor}")),))


def rate_as_period(program: Program) -> Iterator[Change]:
    """The rate where the period belongs, and the other way round."""
    for given in _periods(program):
        before = program.code(given)
        is_inverse = isinstance(given, cst.BinaryOperation) and isinstance(given.operator, cst.Divide)
        after = (
            program.code(given.right) if is_inverse and isinstance(given, cst.BinaryOperation) else f"1 / ({before})"
        )
        yield Change(given, into(before, after), ((given, expression(after)),))


def sleeping_callback(program: Program) -> Iterator[Change]:
    """A callback that sleeps, and keeps everything else waiting."""
    for function in program.callbacks:
        edits = (*program.importing("import time"), *at_top(function, "time.sleep(2.0)"))
        yield Change(function, f"{function.name.value} sleeps 2 s", edits)


def busy_callback(program: Program) -> Iterator[Change]:
    """A callback that loops for ever."""
    for function in program.callbacks[:1]:
        yield Change(function, f"{function.name.value} loops", at_top(function, "while True:\n    pass\n"))


def _periods(program: Program) -> list[cst.BaseExpression]:
    """Return what timers, rates and sleeps are given, where it is written."""
    given = [arg.value for call in program.calls("create_timer") if (arg := argument(call, "timer_period_sec"))]
    given += [arg.value for call in program.calls("create_rate") if (arg := argument(call, "frequency"))]
    given += [call.args[0].value for call in program.calls(*SLEEPS) if len(call.args) == 1]
    return given
