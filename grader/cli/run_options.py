"""The options of a run on the command line, made from the rows of `grader/grading/model/grading_options.py`."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import click

from grader.cli.completion import complete_exercise
from grader.cli.options import PATH, RUBRIC
from grader.grading.model.grading_options import (
    OBSERVE,
    GradingOptions,
    Option,
    OptionKind,
    option_names,
    percent,
    rows,
)

_Command = Callable[..., int]
_Function = TypeVar("_Function", bound=Callable[..., Any])


def run_options(
    command: str, record: type[GradingOptions] = GradingOptions
) -> Callable[[Callable[..., int]], Callable[..., int]]:
    """Return the decorator that adds the options of a record to a command, which gets them as one, `options`."""

    def decorate(function: _Command) -> _Command:
        @wraps(function)
        def called(*arguments: Any, **given: Any) -> int:
            values = {name: given.pop(name) for name in option_names(command, record)}
            if "exercises" in values:
                values["exercises"] = tuple(dict.fromkeys(values["exercises"]))
            if "student" in values:
                values["student"] = values["student"].strip()
            return function(*arguments, options=record(**values), **given)

        decorated: _Command = called
        for name in reversed(option_names(command, record)):
            decorated = run_option(name, command, record)(decorated)
        return decorated

    return decorate


def run_option(
    name: str, command: str, record: type[GradingOptions] = GradingOptions
) -> Callable[[_Function], _Function]:
    """Return the decorator that adds one option, as this command of the record has it."""
    row, default = next((row, each.default) for each_name, row, each in rows(record) if each_name == name)
    attributes = _attributes(row, command, row.defaults.get(command, default), many=isinstance(default, tuple))
    return click.option(row.flag, name, **attributes)


def _attributes(row: Option, command: str, default: Any, *, many: bool) -> dict[str, Any]:
    """Return what click is told of an option."""
    found: dict[str, Any] = {"help": row.commands[command] or row.help, "multiple": many, **_PARSED.get(row.kind, {})}
    if row.metavar:
        found["metavar"] = row.metavar
    if row.kind is OptionKind.CHOICE:
        found["type"] = click.Choice(row.choices)
    if not many and default is not None:
        found["default"] = percent(default) if row.kind is OptionKind.SHARE else default
        found["show_default"] = row.shows_default
    if row.environment and command in row.reads_environment:
        found |= {"envvar": row.environment, "show_envvar": command != OBSERVE}
    return found


def _parse_recordings(ctx: click.Context, param: click.Parameter, value: Sequence[str]) -> tuple[tuple[str, Path], ...]:
    """Parse the values of `--recording TOPIC=BAG`; a click callback."""
    del ctx, param
    parsed = []
    for text in value:
        name, equals, path = text.partition("=")
        if not (equals and path) or re.fullmatch(r"(/[A-Za-z_]\w*)+|[a-z]\w*/msg/[A-Za-z]\w*", name, re.ASCII) is None:
            wanted = "/scan=BAG or sensor_msgs/msg/LaserScan=BAG"
            raise click.BadParameter(
                f"expected a topic or a message type with a recording such as {wanted}, found {text!r}"
            )
        parsed.append((name, Path(path)))
    return tuple(parsed)


def parse_share(ctx: click.Context, param: click.Parameter, value: str) -> float:
    """Parse the value of `--spot-checks P%` to a share from 0 to 1; a click callback."""
    del ctx, param
    try:
        percent = float(value.removesuffix("%"))
    except ValueError:
        percent = -1.0
    if not 0 <= percent <= 100:  # NaN loses
        raise click.BadParameter(f"expected a share from 0% to 100%, found {value!r}")
    return percent / 100


#: How the text of an option becomes its value.
_PARSED: dict[OptionKind, dict[str, Any]] = {
    OptionKind.EXERCISE: {"shell_complete": complete_exercise},
    OptionKind.FLAG: {"is_flag": True},
    OptionKind.COUNT: {"type": click.IntRange(min=0)},
    OptionKind.SECONDS: {"type": click.FloatRange(min=1)},
    OptionKind.SHARE: {"callback": parse_share},
    OptionKind.PATH: {"type": PATH},
    OptionKind.RUBRIC: {"type": RUBRIC},
    OptionKind.BAG: {"callback": _parse_recordings},
}
