"""Tells what ROS has and the grader does not evaluate from what exists nowhere, which is the launch file's mistake."""

from __future__ import annotations

import os
from inspect import Parameter, Signature

from .ros_classes import CLASSES
from .ros_modules import LATER, MODULES, RELEASE

#: Other names of a class.
_ALIASES = {"PushRosNamespace": "PushROSNamespace", "RosTimer": "ROSTimer", "FindPackage": "FindPackageShare"}


def knows_release() -> bool:
    """Return whether the names of the ROS release are known; one that is newer may have others."""
    return os.environ.get("ROS_DISTRO", RELEASE) == RELEASE


def has(module: str, name: str) -> bool:
    """Return whether a module of ROS has a name, in Jazzy or a later release."""
    return name in MODULES.get(module, "").split() or name in LATER.get(module, "").split()


def key_of(module: str, name: str) -> str:
    """Return the key in `CLASSES` of a class by the module that it is imported from."""
    own = f"{'.'.join(module.split('.')[:2])}.{name}"
    return own if own in CLASSES else _ALIASES.get(name, name)


def attributes(key: str) -> frozenset[str]:
    """Return the public methods and attributes of a class, with those of its bases."""
    found: set[str] = set()
    while key in CLASSES:
        found |= {*CLASSES[key].has.split()}
        key = CLASSES[key].base
    return frozenset(found)


def signature(key: str) -> Signature | None:
    """Return the signature of a class's constructor; None if other packages define it."""
    if key not in CLASSES or CLASSES[key].takes == "**":
        return None
    parameters: list[Parameter] = []
    by_name_alone = False
    for word in CLASSES[key].takes.split():
        name = word.strip("*=")
        if not name:
            by_name_alone = True
        elif word.startswith("*"):
            parameters.append(Parameter(name, Parameter.VAR_KEYWORD if word[1] == "*" else Parameter.VAR_POSITIONAL))
        else:
            kind = Parameter.KEYWORD_ONLY if by_name_alone else Parameter.POSITIONAL_OR_KEYWORD
            parameters.append(Parameter(name, kind, default=None if word.endswith("=") else Parameter.empty))
    return Signature(sorted(parameters, key=lambda one: (one.kind, one.default is None)))
