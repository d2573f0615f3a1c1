"""Stands for what ROS has and the grader does not evaluate: what needs it is left out where it is used."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable
from typing import Any

from . import ros_names
from .context import Context, Substitution
from .entities import Action
from .left_out import LeftOutError

_TYPE = re.compile(r"[A-Z]\w*")


class Lacking(Action, Substitution):
    """Something that ROS or another package has and that is not here: what needs it is left out.

    Args:
        code: Why, as for `LeftOutError`.
        name: What it is.
    """

    _why = ("name", "launch")

    def __init__(self, code: str, name: str) -> None:
        super().__init__()
        self._why = (code, name)

    def _needed(self, *_: Any, **__: Any) -> Any:
        raise LeftOutError(*self._why)

    execute = perform = evaluate = _needed
    __str__ = __repr__ = __format__ = __fspath__ = __bytes__ = __bool__ = __int__ = __float__ = __index__ = _needed
    __iter__ = __next__ = __len__ = __contains__ = __getitem__ = __enter__ = __instancecheck__ = __lt__ = __gt__ = (
        _needed
    )
    __add__ = __radd__ = __truediv__ = __rtruediv__ = __mod__ = _needed

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return self

    def __call__(self, *_: Any, **__: Any) -> Any:
        """Return the same: what it makes is not here either."""
        return self


class Unknown(Lacking):
    """A class of ROS that is not evaluated."""

    def __init__(self, *_: Any, condition: Any = None, **__: Any) -> None:
        Action.__init__(self, condition=condition)

    def execute(self, context: Context) -> Iterable[Any]:
        """Leave the action out."""
        raise LeftOutError("action", type(self).__name__)


class _Attribute:
    """What a class of ROS has under a name and is not here, for the class and its objects."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type) -> Lacking:
        return Lacking("name", f"{owner.__name__}.{self._name}")


def like_ros(kind: type, key: str) -> None:
    """Make a class take what that of ROS takes and have what that has, as far as it differs."""
    for name in ros_names.attributes(key):
        if not hasattr(kind, name):
            setattr(kind, name, _Attribute(name))
    signature = ros_names.signature(key) if ros_names.knows_release() else None
    if signature is None:
        return
    build: Any = kind.__init__  # type: ignore[misc]
    if "__init__" not in vars(kind):  # that of its base, without what that one takes
        build = getattr(build, "__wrapped__", build)

    @functools.wraps(build)
    def checked(self: Any, *parts: Any, **more: Any) -> None:
        try:
            bound = signature.bind(*parts, **more)
        except TypeError as error:
            raise TypeError(f"{kind.__name__}.__init__() {error}") from None
        build(self, *bound.args, **bound.kwargs)

    kind.__init__ = checked  # type: ignore[misc]


def stand_in_for(module: str, name: str) -> Any:
    """Return what stands for a name of a module of ROS that is not evaluated."""
    if not _TYPE.fullmatch(name):
        return Lacking("name", f"{module}.{name}")
    if name.endswith(("Error", "Failure", "Exception")):
        return type(name, (Exception,), {"__doc__": "An exception of launch.", "__module__": module})
    kind = type(name, (Unknown,), {"__doc__": "Not evaluated.", "_why": ("name", f"{module}.{name}")})
    like_ros(kind, ros_names.key_of(module, name))
    return kind


def pairs_of(given: Any, what: str) -> list[tuple[Any, Any]]:
    """Return the pairs of names and values that an argument holds; raises what a launch file did wrong."""
    if isinstance(given, Lacking):
        return [(given, given)]
    if not isinstance(given, Iterable):
        raise TypeError(f"{what}: expected pairs of a name and a value, found {type(given).__name__}")
    rows = list(given)
    for row in rows:
        if isinstance(row, str) or not isinstance(row, (tuple, list)) or len(row) != 2:
            raise TypeError(f"{what}: expected pairs of a name and a value, found {row!r}")
    return [(row[0], row[1]) for row in rows]


def items_of(given: Any) -> list[Any]:
    """Return the items of an argument; what is left out stands for its items."""
    return [given] if isinstance(given, Lacking) else list(given or ())
