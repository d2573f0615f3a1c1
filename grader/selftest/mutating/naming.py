"""Operators that give topics, services and messages wrong names."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from itertools import combinations

import libcst as cst

from grader.selftest.mutating.program import CREATORS, Change, Edit, Program, argument, called, into, string, text_of

_NAMED = {
    "create_publisher": "topic",
    "create_subscription": "topic",
    "create_service": "srv_name",
    "create_client": "srv_name",
}
#: Message and service types that share the fields people use with others: type -> package, type.
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
#: Types with a stamped relative -> the member that holds what they hold, and their own fields.
_STAMPED: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "Twist": ("twist", ("linear", "angular")),
    "Pose": ("pose", ("position", "orientation")),
}


def topic_typo(program: Program) -> Iterator[Change]:
    """A misspelt topic or service: its last letter is missing."""
    for node, name in names(program):
        yield _renamed(node, name, name[:-1] if len(name) > 2 else f"{name}s")


def topic_namespace(program: Program) -> Iterator[Change]:
    """A topic or service of another tutorial: the right name inside a namespace, as `/turtle1/cmd_vel`."""
    for node, name in names(program):
        yield _renamed(node, name, f"/turtle1/{name.lstrip('/')}")


def topic_private(program: Program) -> Iterator[Change]:
    """A name that is private to the node, `~/cmd_vel`."""
    for node, name in names(program):
        yield _renamed(node, name, f"~/{name.lstrip('/')}")


def topic_swapped(program: Program) -> Iterator[Change]:
    """Two topics mistaken for each other: what is published is listened to, and the other way round."""
    for (one, name), (other, other_name) in combinations(names(program), 2):
        if name != other_name:
            yield Change(one, f"{name} <-> {other_name}", ((one, string(other_name)), (other, string(name))))


def message_type(program: Program) -> Iterator[Change]:
    """Another message or service type with the same fields, imported and used in the whole file."""
    for imported, alias in _imported_types(program, _TWINS):
        package, twin = _TWINS[alias]
        edits: list[Edit] = [(name, cst.Name(twin)) for name in _uses(program, alias) if not _is_import(program, name)]
        line = f"from {package} import {twin}"
        edits += program.importing(line)
        yield Change(imported, into(alias, f"{package}.{twin}"), tuple(edits))


def stamped_type(program: Program) -> Iterator[Change]:
    """The stamped relative of a type, with the fields where that has them: TwistStamped for Twist."""
    for imported, alias in _imported_types(program, _STAMPED):
        member, parts = _STAMPED[alias]
        stamped = f"{alias}Stamped"
        edits: list[Edit] = [
            (name, cst.Name(stamped)) for name in _uses(program, alias) if not _is_import(program, name)
        ]
        fields = [node for node in program.all(cst.Attribute) if node.attr.value in parts]
        edits += [(node.value, cst.Attribute(node.value, cst.Name(member))) for node in fields]
        package = program.code(imported.module) if imported.module is not None else ""
        edits += program.importing(f"from {package} import {stamped}")
        yield Change(imported, into(alias, stamped), tuple(edits))


def message_type_once(program: Program) -> Iterator[Change]:
    """A type that two ends of the same program disagree about: only one publisher or subscription has another one."""
    for call in program.calls(*CREATORS):
        arg = argument(call, CREATORS[called(call)][0])
        if arg is None or not isinstance(arg.value, cst.Name) or arg.value.value not in _TWINS:
            continue
        package, twin = _TWINS[arg.value.value]
        edits = ((arg.value, cst.Name(twin)), *program.importing(f"from {package} import {twin}"))
        yield Change(call, f"{called(call)} {into(arg.value.value, twin)}", edits)


def names(program: Program) -> list[tuple[cst.SimpleString, str]]:
    """Return where topics and services are named, each place once."""
    found: dict[cst.SimpleString, str] = {}
    for call in program.calls(*_NAMED):
        arg = argument(call, _NAMED[called(call)])
        node = program.constant(arg.value) if arg is not None else None
        name = text_of(node)
        if isinstance(node, cst.SimpleString) and name:
            found[node] = name
    return list(found.items())


def _renamed(node: cst.SimpleString, name: str, other: str) -> Change:
    return Change(node, into(name, other), ((node, string(other)),))


def _imported_types(program: Program, known: Collection[str]) -> Iterator[tuple[cst.ImportFrom, str]]:
    for imported in program.all(cst.ImportFrom):
        if not isinstance(imported.names, cst.ImportStar):
            for alias in imported.names:
                if alias.asname is None and isinstance(alias.name, cst.Name) and alias.name.value in known:
                    yield imported, alias.name.value


def _uses(program: Program, name: str) -> list[cst.Name]:
    return [node for node in program.all(cst.Name) if node.value == name and not _is_attribute(program, node)]


def _is_attribute(program: Program, node: cst.Name) -> bool:
    above = next(program.above(node), None)
    return isinstance(above, cst.Attribute) and above.attr is node


def _is_import(program: Program, node: cst.CSTNode) -> bool:
    return any(isinstance(above, (cst.Import, cst.ImportFrom)) for above in program.above(node))
