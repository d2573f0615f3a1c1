"""Causes behind names and modules that are not there."""

from __future__ import annotations

import ast
import re

from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.diagnosis.names import MODULES, PACKAGES, PLAIN_MODULES, ROS_1, ROS_1_CALLS, closest, import_of
from grader.judging.source import Function, Source, chain, covers, last_name, parameters

_MESSAGE_ENDINGS = ("_msgs", "_msg", "_interfaces", "_interface", "_srvs", "_srv", "_actions")


def _ros_1(case: Case) -> Clue | None:
    found = case.said(r"No module named '([\w.]+)'")
    if found is None or found[1].split(".")[0] not in ROS_1:
        return None
    module = found[1].split(".")[0]
    hint = f"{module} belongs to ROS 1; this is ROS 2: use {ROS_1[module]}"
    if module == "rospy" and case.source is not None:
        used = dict.fromkeys(last_name(n) for n in case.source.all(ast.Attribute) if chain(n).startswith("rospy."))
        pairs = [f"rospy.{name} becomes {ROS_1_CALLS[name]}" for name in used if name in ROS_1_CALLS]
        hint += f"; {', '.join(pairs[:3])}" if pairs else ""
    return Clue(hint)


def _missing_module(case: Case) -> Clue | None:
    found = case.said(r"^ModuleNotFoundError: No module named '([\w.]+)'")
    if found is None:
        return None
    wanted = found[1][:80]
    known = [*MODULES, *PACKAGES, *PLAIN_MODULES, "numpy"]
    near = closest(wanted, known, 0.8)
    if near and near.count(".") == wanted.count("."):
        return Clue(f"the module is called {near}, not {wanted}")
    if wanted.startswith("rclpy."):
        return (
            Clue(f"there is no {wanted}; the class Node is in rclpy.node") if wanted.lower() == "rclpy.node" else None
        )
    if wanted.endswith(_MESSAGE_ENDINGS) or _gives_messages(case.source, wanted):
        listed = ", ".join(PACKAGES[:5])
        return Clue(f"the package {wanted} is not here; use messages of the standard packages: {listed}, ...")
    if "." in wanted:
        return None
    return Clue(f"{wanted} is neither in the submission nor installed here: hand it in, or do without it")


def _gives_messages(source: Source | None, module: str) -> bool:
    if source is None:
        return False
    suffixes = tuple(f"{module}.{kind}" for kind in ("msg", "srv", "action"))
    return any(n.module in suffixes for n in source.all(ast.ImportFrom))


def _cannot_import(case: Case) -> Clue | None:
    found = case.said(r"^ImportError: cannot import name '(\w+)' from (partially initialized module )?'([\w.]+)'")
    if found is None:
        return None
    name, module = found[1], found[3]
    if found[2]:
        hint = f"the file that Python takes for {module} is not finished when it is asked: two files import each other"
        return Clue(f"{hint}, or a file of yours has the name of a module")
    near = closest(name, MODULES.get(module, ()), 0.7)
    same = [n for n in MODULES.get(module, ()) if n.lower() == name.lower()]
    if same:
        return Clue(f"upper and lower case matter: from {module} import {same[0]}")
    right = import_of(name)
    if right and not right.startswith(f"from {module} "):
        return Clue(f"{name} is elsewhere: {right}")
    return Clue(f"from {module} import {near}, not {name}") if near else None


def _undefined_name(case: Case) -> Clue | None:
    found = case.said(r"^(?:NameError|UnboundLocalError).*name '(\w+)' is not defined")
    if found is None or case.faulty is None:
        return None
    fault, source = case.faulty
    name, inside = found[1], [f for f in source.functions() if covers(f, fault.line)]
    if name == "self":
        return _no_self(source, inside)
    methods = [f for f in source.functions(name) if source.is_method(f)]
    if methods and inside and len(methods) == len(source.functions(name)):
        return Clue(f"{name} is a method: write self.{name}")
    if import_of(name):
        return Clue(f"the import is missing: {import_of(name)}")
    if inside and source.stores(f"self.{name}"):
        return Clue(f"{name} belongs to the object: write self.{name}")
    near = closest(name, _defined(source), 0.8)
    return Clue(f"{name} is not defined; the file has {near}") if near else None


def _no_self(source: Source, inside: list[Function]) -> Clue | None:
    lacking = next((f for f in reversed(inside) if source.is_method(f) and "self" not in parameters(f)), None)
    if lacking is None:
        return None
    rest = "".join(f", {p}" for p in parameters(lacking))
    return Clue(f"self is missing: def {lacking.name}(self{rest}):", source.place(lacking))


def _defined(source: Source) -> list[str]:
    names = [n.id for n in source.all(ast.Name) if isinstance(n.ctx, ast.Store)]
    names += [f.name for f in source.functions() if not source.is_method(f)]
    names += [c.name for c in source.all(ast.ClassDef)]
    names += [a.arg for a in source.all(ast.arg)]
    return names + [(a.asname or a.name).split(".")[0] for a in source.all(ast.alias)]


def _shadowed(case: Case) -> Clue | None:
    found = case.said(r"partially initialized module '(\w+)' has no attribute")
    if found is None:
        return None
    return Clue(f"a file of yours has the name of the module {found[1]} and is imported in its place: rename the file")


def _hidden_module(case: Case) -> Clue | None:
    """A file of the submission is imported in place of the module that the error names."""
    found = case.said(r"^(?:ImportError|ModuleNotFoundError|AttributeError): .*")
    hidden = [name for start in case.trace.starts if start.process == case.process for name in start.hidden]
    words = re.findall(r"'([\w.]+)'", found[0]) if found is not None else []
    named = {word.partition(".")[0] for word in words}
    name = next((name for name in hidden if name.removesuffix(".py") in named), None)
    if name is None:
        return None
    return Clue(f"{name} has the name of a module and is imported in its place: rename it")


def _no_package(case: Case) -> Clue | None:
    if case.said(r"^ImportError: attempted relative import with no known parent package") is None:
        return None
    source, fault = case.source, case.fault
    written = [n for n in source.all(ast.ImportFrom) if n.level and fault and n.lineno == fault.line] if source else []
    advice = "a relative import works in a package only, and this file is in none"
    if source is None or not written or written[0].level > 1:
        return Clue(f"{advice}: hand in the whole package, with its setup.py and __init__.py")
    names = ", ".join(a.name + (f" as {a.asname}" if a.asname else "") for a in written[0].names)
    plain = f"from {written[0].module} import {names}" if written[0].module else f"import {names}"
    return Clue(f"{advice}: write {plain}, or hand in the whole package, with its setup.py and __init__.py")


IMPORTS = (
    Cause("hidden_module", _hidden_module),
    Cause("no_package", _no_package),
    Cause("ros_1", _ros_1),
    Cause("missing_module", _missing_module),
    Cause("cannot_import", _cannot_import),
    Cause("undefined_name", _undefined_name),
    Cause("shadowed_module", _shadowed),
)
