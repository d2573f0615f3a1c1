"""Lets a bare process see the same machine: Python imports a module of this name before it runs a program."""

import os

_PATH = os.path.join(os.path.dirname(os.path.abspath(__file__)), "__init__.py")
_names = {"__name__": "machine"}
with open(_PATH, "rb") as _source:
    exec(compile(_source.read(), _PATH, "exec"), _names)  # noqa: S102 - as a module, it could hide the student's own
_names["install"]()  # type: ignore[operator]
