"""Lets a bare process see the same machine: Python imports a module of this name before it runs a program."""

import os
import sys

_FOLDER = os.path.dirname(os.path.abspath(__file__))
_PATH = os.path.join(_FOLDER, "__init__.py")
_names = {"__name__": "machine", "__file__": _PATH}
with open(_PATH, "rb") as _source:
    exec(compile(_source.read(), _PATH, "exec"), _names)  # noqa: S102 - as a module, it could hide the student's own
_names["install"](bare=True)  # type: ignore[operator]
# The way to this folder is not for the program to see.
sys.path[:] = [path for path in sys.path if path != _FOLDER]
_others = [path for path in os.environ.pop("PYTHONPATH", "").split(os.pathsep) if path not in ("", _FOLDER)]
if _others:
    os.environ["PYTHONPATH"] = os.pathsep.join(_others)
