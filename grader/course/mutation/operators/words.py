"""Operators on names, logs and periods."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from itertools import combinations

import libcst as cst

from grader.course.mutation.operators.flow import at_top, parameter_names, statements_of
from grader.course.mutation.operators.program import (
    CREATORS,
    LEVELS,
    Edit,
    Mutation,
    ParsedProgram,
    called,
    in_one_line,
    into,
    is_docstring,
    passed_argument,
    plain_string,
    string,
)

_WORD = re.compile(r"(?<![%{\\\w/~.])[A-Za-z]{3,}")
_QUIET, _LOUD = "debug", "error"


def print_instead(program: ParsedProgram) -> Iterator[Mutation]:
    """`print` instead of the logger."""
    default = cst.MaybeSentinel.DEFAULT
    for call in _logs(program):
        said = [arg.with_changes(comma=default, keyword=None, equal=default) for arg in call.args[:1]]
        yield program.replacing(call, cst.Call(cst.Name("print"), said))


def log_level(program: ParsedProgram) -> Iterator[Mutation]:
    """A log that nobody sees because it is for debugging, or one that cries for help."""
    for call in _logs(program):
        for level in (_QUIET, _LOUD):
            if isinstance(call.func, cst.Attribute) and call.func.attr.value != level:
                yield program.replacing(call.func.attr, level, at=call)


def log_every_message(program: ParsedProgram) -> Iterator[Mutation]:
    """A report with each message instead of by a timer."""
    for callback in program.handed_to("create_subscription"):
        for timer in program.handed_to("create_timer"):
            lines = statements_of(callback)
            if lines and parameter_names(timer) == ["self"] and parameter_names(callback)[:1] == ["self"]:
                last = lines[-1]
                added = cst.FlattenSentinel([last, cst.parse_statement(f"self.{timer.name.value}()")])
                yield Mutation(callback, f"{callback.name.value} calls {timer.name.value}", ((last, added),))


def text(program: ParsedProgram) -> Iterator[Mutation]:
    """A misspelt word in a log, an answer or a format."""
    for node in program.all(cst.SimpleString):
        old = plain_string(node)
        # names of topics, nodes and files have no spaces
        prose = old is not None and " " in old.strip() and not is_docstring(program, node)
        if old is not None and prose and (after := _misspelt(old)):
            yield Mutation(node, into(old, after), ((node, string(after)),))
    for part in program.all(cst.FormattedStringText):
        if after := _misspelt(part.value):
            yield Mutation(part, into(part.value, after), ((part, part.with_changes(value=after)),))


def _misspelt(old: str) -> str:
    """Return a text without the last letter of its first word; empty if it has no word."""
    word = _WORD.search(old)
    return old[: word.end() - 1] + old[word.end() :] if word else ""


def rounding(program: ParsedProgram) -> Iterator[Mutation]:
    """Too few digits in a text: `.0f` for `.3f`."""
    for part in program.all(cst.FormattedStringExpression):
        spec = program.specification(part)
        if spec.endswith("f") and spec != ".0f":
            yield program.replacing(part, part.with_changes(format_spec=[cst.FormattedStringText(".0f")]))
    for node in program.all(cst.SimpleString):
        old = plain_string(node)
        if old is not None and (match := re.search(r"%\.[1-9]f", old)):
            after = old[: match.start()] + "%.0f" + old[match.end() :]
            yield Mutation(node, into(old, after), ((node, string(after)),))


def missing_value(program: ParsedProgram) -> Iterator[Mutation]:
    """A text without the value."""
    for part in program.all(cst.FormattedStringExpression):
        yield Mutation(part, f"no {in_one_line(program.code(part))}", ((part, cst.FormattedStringText("?")),))


def _logs(program: ParsedProgram) -> list[cst.Call]:
    """Return the calls of a logger: methods with these names whose first argument is a text."""
    found = [call for call in program.calls(*LEVELS) if isinstance(call.func, cst.Attribute) and call.args]
    return [call for call in found if "log" in program.code(call.func).lower()]


_NAMED = {
    "create_publisher": "topic",
    "create_subscription": "topic",
    "create_service": "srv_name",
    "create_client": "srv_name",
}
#: Types that share their commonly used fields with another type: type -> package, type.
_TWINS: Mapping[str, tuple[str, str]] = {
    "Twist": ("geometry_msgs.msg", "Accel"),
    "Vector3": ("geometry_msgs.msg", "Point"),
    "Point": ("geometry_msgs.msg", "Vector3"),
    "PoseStamped": ("geometry_msgs.msg", "PoseWithCovarianceStamped"),
    "Odometry": ("geometry_msgs.msg", "PoseWithCovarianceStamped"),
    "Float32": ("std_msgs.msg", "Float64"),
    "Float64": ("std_msgs.msg", "Float32"),
    "Int8": ("std_msgs.msg", "Int16"),
    "Int16": ("std_msgs.msg", "Int32"),
    "Int32": ("std_msgs.msg", "Int64"),
    "Int64": ("std_msgs.msg", "Int32"),
    "UInt8": ("std_msgs.msg", "UInt16"),
    "Temperature": ("sensor_msgs.msg", "RelativeHumidity"),
    "Trigger": ("std_srvs.srv", "SetBool"),
    "SetBool": ("std_srvs.srv", "Trigger"),
}
#: Types with a stamped variant -> the member of the variant that holds them, and their fields.
_STAMPED: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "Twist": ("twist", ("linear", "angular")),
    "Pose": ("pose", ("position", "orientation")),
}


def topic_typo(program: ParsedProgram) -> Iterator[Mutation]:
    """A misspelt topic or service: its last letter is missing."""
    return _renamed(program, lambda name: name[:-1] if len(name) > 2 else f"{name}s")


def topic_namespace(program: ParsedProgram) -> Iterator[Mutation]:
    """A topic or service from another tutorial: the right name in a namespace, such as `/turtle1/cmd_vel`."""
    return _renamed(program, lambda name: f"/turtle1/{name.lstrip('/')}")


def topic_private(program: ParsedProgram) -> Iterator[Mutation]:
    """A private name, `~/cmd_vel`."""
    return _renamed(program, lambda name: f"~/{name.lstrip('/')}")


def topic_swapped(program: ParsedProgram) -> Iterator[Mutation]:
    """Two topics swapped: the node subscribes to the topic that it should publish, and the other way round."""
    for (one, name), (other, other_name) in combinations(name_places(program), 2):
        if name != other_name:
            yield Mutation(one, f"{name} <-> {other_name}", ((one, string(other_name)), (other, string(name))))


def message_type(program: ParsedProgram) -> Iterator[Mutation]:
    """Another message or service type with the same fields, imported and used in the whole file."""
    for imported, alias in _imported_types(program, _TWINS):
        package, twin = _TWINS[alias]
        edits = (*_renamed_uses(program, alias, twin), *program.importing(f"from {package} import {twin}"))
        yield Mutation(imported, into(alias, f"{package}.{twin}"), edits)


def stamped_type(program: ParsedProgram) -> Iterator[Mutation]:
    """The stamped variant of a type, with adapted fields: TwistStamped for Twist."""
    for imported, alias in _imported_types(program, _STAMPED):
        member, parts = _STAMPED[alias]
        stamped = f"{alias}Stamped"
        fields = [node.value for node in program.all(cst.Attribute) if node.attr.value in parts]
        package = program.code(imported.module) if imported.module is not None else ""
        edits = (
            *_renamed_uses(program, alias, stamped),
            *((holder, cst.Attribute(holder, cst.Name(member))) for holder in fields),
            *program.importing(f"from {package} import {stamped}"),
        )
        yield Mutation(imported, into(alias, stamped), edits)


def message_type_once(program: ParsedProgram) -> Iterator[Mutation]:
    """A wrong type at only one publisher or subscription of a topic."""
    for call in program.calls(*CREATORS):
        given = passed_argument(call, CREATORS[called(call)][0])
        if isinstance(given, cst.Name) and given.value in _TWINS:
            package, twin = _TWINS[given.value]
            edits = ((given, cst.Name(twin)), *program.importing(f"from {package} import {twin}"))
            yield Mutation(call, f"{called(call)} {into(given.value, twin)}", edits)


def name_places(program: ParsedProgram) -> list[tuple[cst.SimpleString, str]]:
    """Return the places that name topics and services, without duplicates."""
    found: dict[cst.SimpleString, str] = {}
    for call in program.calls(*_NAMED):
        node = program.constant(passed_argument(call, _NAMED[called(call)]))
        name = plain_string(node)
        if isinstance(node, cst.SimpleString) and name:
            found[node] = name
    return list(found.items())


def _renamed(program: ParsedProgram, rename: Callable[[str], str]) -> Iterator[Mutation]:
    for node, name in name_places(program):
        yield Mutation(node, into(name, rename(name)), ((node, string(rename(name))),))


def _imported_types(program: ParsedProgram, known: Collection[str]) -> Iterator[tuple[cst.ImportFrom, str]]:
    for imported in program.all(cst.ImportFrom):
        if not isinstance(imported.names, cst.ImportStar):
            for alias in imported.names:
                if alias.asname is None and isinstance(alias.name, cst.Name) and alias.name.value in known:
                    yield imported, alias.name.value


def _renamed_uses(program: ParsedProgram, name: str, other: str) -> list[Edit]:
    """Return the edits that put another name wherever a name is used; attributes and imports keep theirs."""
    uses = [node for node in program.all(cst.Name) if node.value == name and not _is_attribute(program, node)]
    return [(node, cst.Name(other)) for node in uses if not _is_import(program, node)]


def _is_attribute(program: ParsedProgram, node: cst.Name) -> bool:
    above = next(program.above(node), None)
    return isinstance(above, cst.Attribute) and above.attr is node


def _is_import(program: ParsedProgram, node: cst.CSTNode) -> bool:
    return any(isinstance(above, (cst.Import, cst.ImportFrom)) for above in program.above(node))


#: Typical wrong factors of a period: ten, milliseconds, half, double, a quarter off.
_FACTORS = ("* 10", "/ 10", "* 1000", "/ 2", "* 2", "* 1.25", "* 0.75")


def period(program: ParsedProgram) -> Iterator[Mutation]:
    """A period that is wrong by a factor: ten, two, milliseconds for seconds, or a quarter."""
    for given in _periods(program):
        before = program.code(given)
        inside = before if isinstance(given, (cst.Name, cst.Attribute, cst.BaseNumber)) else f"({before})"
        for factor in _FACTORS:
            yield program.replacing(given, f"{inside} {factor}")


def rate_as_period(program: ParsedProgram) -> Iterator[Mutation]:
    """The rate instead of the period, or the other way round."""
    for given in _periods(program):
        if isinstance(given, cst.BinaryOperation) and isinstance(given.operator, cst.Divide):
            yield program.replacing(given, given.right)
        else:
            yield program.replacing(given, f"1 / ({program.code(given)})")


def sleeping_callback(program: ParsedProgram) -> Iterator[Mutation]:
    """A callback that sleeps and blocks everything else."""
    for function in program.callbacks:
        edits = (*program.importing("import time"), *at_top(function, "time.sleep(2.0)"))
        yield Mutation(function, f"{function.name.value} sleeps 2 s", edits)


def busy_callback(program: ParsedProgram) -> Iterator[Mutation]:
    """A callback with an infinite loop."""
    for function in program.callbacks[:1]:
        yield Mutation(function, f"{function.name.value} loops", at_top(function, "while True:\n    pass\n"))


def _periods(program: ParsedProgram) -> list[cst.BaseExpression]:
    """Return the expressions that define the periods of timers, rates and sleeps."""
    given = [*program.arguments("timer_period_sec", "create_timer"), *program.arguments("frequency", "create_rate")]
    slept = [call.args[0].value for call in program.calls("sleep") if len(call.args) == 1]
    return [*(period for _, period in given), *slept]
