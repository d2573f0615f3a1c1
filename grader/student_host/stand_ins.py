"""Stands in for example_interfaces where it is not installed: its names can be imported, using one fails.

Tutorials import it without using it, and every full ROS installation has it, but no wheel holds it.
"""

from __future__ import annotations

import sys
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

PACKAGE = "example_interfaces"
_NUMBERS = ("Int8", "Int16", "Int32", "Int64", "UInt8", "UInt16", "UInt32", "UInt64", "Float32", "Float64")
#: Module -> what it holds, as release 0.12 (Jazzy) has it: https://github.com/ros2/example_interfaces
INTERFACES = {
    "msg": (
        *_NUMBERS,
        *(f"{name}MultiArray" for name in (*_NUMBERS, "Byte")),
        *("Bool", "Byte", "Char", "Empty", "MultiArrayDimension", "MultiArrayLayout", "String", "WString"),
    ),
    "srv": ("AddTwoInts", "SetBool", "Trigger"),
    "action": ("Fibonacci",),
}


class _Missing(type):
    """What an interface that is not there is made of: every use fails as the import would have."""

    _TYPE_SUPPORT = None  # rclpy looks at it, finds nothing, and asks for the import below

    @classmethod
    def __import_type_support__(cls) -> None:
        raise _missing()

    def __getattr__(cls, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        raise _missing()

    def __call__(cls, *args: Any, **kwargs: Any) -> Any:
        raise _missing()


def _missing() -> ModuleNotFoundError:
    return ModuleNotFoundError(f"No module named '{PACKAGE}'", name=PACKAGE)


class StandIns(MetaPathFinder, Loader):
    """An importer that comes last: whatever is installed, or lies in the submission, goes before it."""

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        """Return how to make a module of the package, or None for any other."""
        package, _, rest = fullname.partition(".")
        if package != PACKAGE or (rest and rest not in INTERFACES):
            return None
        return ModuleSpec(fullname, self, is_package=not rest)

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        """Leave the making to the interpreter."""
        return None

    def exec_module(self, module: ModuleType) -> None:
        """Fill a module with its names."""
        for interface in INTERFACES.get(module.__name__.partition(".")[2], ()):
            setattr(module, interface, _Missing(interface, (), {"__module__": module.__name__}))


def install_stand_ins() -> None:
    """Let what is not installed be imported."""
    sys.meta_path.append(StandIns())
