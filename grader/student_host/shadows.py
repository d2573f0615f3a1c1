"""Lets a student's modules hide those that Python and ROS need, as they do when ROS users start the file.

The host has imported many modules by then, and rclpy with them. Where a student's file has the name of one, the program
begins without these modules, and rclpy is imported, and made virtual, when the program imports it: so each import finds
what it would find anywhere, and fails where it would fail.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import BuiltinImporter, FrozenImporter, ModuleSpec
from types import ModuleType
from typing import Any

#: Modules of ROS that a student's file name may hide.
ROS_MODULES = frozenset(
    {
        "rclpy",
        "std_msgs",
        "geometry_msgs",
        "nav_msgs",
        "sensor_msgs",
        "std_srvs",
        "example_interfaces",
        "numpy",
        "yaml",
        "rcl_interfaces",
        "builtin_interfaces",
        "rosidl_parser",
        "rosgraph_msgs",
        "em",
        "lark",
    }
)
#: What every interpreter has imported before it comes to a script.
_AT_START = frozenset({"abc", "codecs", "encodings", "genericpath", "io", "os", "posixpath", "site", "stat"})
#: What imports rest on, or what the host has changed: a second copy would know nothing of that.
_KEPT = frozenset({"importlib", "selectors", "signal", "threading"})
#: The parts of rclpy that the host changes.
ROS_PARTS = (
    "rclpy.client",
    "rclpy.clock",
    "rclpy.context",
    "rclpy.duration",
    "rclpy.executors",
    "rclpy.impl.implementation_singleton",
    "rclpy.impl.rcutils_logger",
    "rclpy.logging",
    "rclpy.node",
    "rclpy.publisher",
    "rclpy.qos",
    "rclpy.service",
    "rclpy.subscription",
    "rclpy.task",
    "rclpy.time",
    "rclpy.time_source",
    "rclpy.utilities",
)


class Shadows:
    """The modules of a student's that hide others.

    Args:
        folders: The folders that come first on the path.

    Attributes:
        files: Their names, sorted.
    """

    def __init__(self, folders: Sequence[str]) -> None:
        found = {(name, module) for folder in folders for name, module in _modules(folder) if _is_needed(module)}
        self._folders = folders
        self.files = sorted(name for name, _ in found)
        self._names = {module for _, module in found}
        self._real: dict[str, ModuleType] = {}

    def fall(self, install: Callable[[], None]) -> None:
        """Forget the hidden modules, and have ROS installed when the program has imported it.

        Args:
            install: Makes rclpy virtual.
        """
        hidden = {name for name in sys.modules if name.partition(".")[0] in self._names}
        while more := {name for name in _replaceable() - hidden if _goes_with(name, hidden)}:
            hidden |= more
        self._real = {name: sys.modules.pop(name) for name in hidden}
        sys.meta_path.insert(0, _After("rclpy", lambda: self._install(install)))

    def _install(self, install: Callable[[], None]) -> None:
        try:
            for part in ROS_PARTS:
                importlib.import_module(part)
        except Exception:  # the program's own imports fail at the same place, and say so
            return
        with self._lifted():
            install()

    @contextmanager
    def _lifted(self) -> Iterator[None]:
        """Let the host's own imports find the real modules."""
        path, seen = sys.path[:], {name: sys.modules[name] for name in self._real if name in sys.modules}
        before = set(sys.modules)
        sys.modules.update(self._real)
        sys.path[:] = [folder for folder in path if folder not in self._folders]
        try:
            yield
        finally:
            sys.path[:] = path
            for name in self._real:
                sys.modules.pop(name, None)
            for name in set(sys.modules) - before:
                if name.partition(".")[0] in self._names:
                    del sys.modules[name]
            sys.modules.update(seen)


def _modules(folder: str) -> Iterator[tuple[str, str]]:
    """Yield the files and folders that can be imported from a folder, and their names as modules."""
    with suppress(OSError):
        for name in os.listdir(folder):
            module, extension = os.path.splitext(name)
            if extension == ".py" or os.path.isfile(os.path.join(folder, name, "__init__.py")):
                yield name, module


def _is_needed(module: str) -> bool:
    """Return whether Python or ROS has a module of that name, and would search the path for it."""
    known = module in sys.stdlib_module_names or module in ROS_MODULES
    first = BuiltinImporter.find_spec(module) or FrozenImporter.find_spec(module)
    return known and module not in _AT_START and first is None


def _replaceable() -> set[str]:
    return {
        name
        for name, module in sys.modules.items()
        if name.partition(".")[0] in sys.stdlib_module_names
        and name.partition(".")[0] not in _AT_START | _KEPT
        and isinstance(getattr(module, "__file__", None), str)
    }


def _goes_with(name: str, names: set[str]) -> bool:
    """Return whether a module has imported something from others, or lies in one of these packages."""
    module = sys.modules[name]
    for value in list(vars(module).values()):
        source = value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None)
        if not isinstance(source, str) or source == name or source.startswith(f"{name}."):
            continue
        if {source, source.removeprefix("_")} & names:  # what is written in C comes from a module such as _heapq
            return True
    return any(name.startswith(f"{other}.") for other in names)


class _After(MetaPathFinder):
    """Does something as soon as a module that is not the student's has been imported for the first time."""

    def __init__(self, name: str, do: Callable[[], None]) -> None:
        self._name = name
        self._do = do

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> ModuleSpec | None:
        """Return how to import the module, with what is done afterwards; None for any other."""
        if fullname != self._name:
            return None
        sys.meta_path.remove(self)
        others = [finder for finder in sys.meta_path if hasattr(finder, "find_spec")]
        spec = next((s for f in others if (s := f.find_spec(fullname, path, target)) is not None), None)
        if spec is not None and spec.loader is not None:
            spec.loader = _Doing(spec.loader, self._do)
        return spec


class _Doing(Loader):
    """Loads a module as another loader does, and then does something."""

    def __init__(self, loader: Any, do: Callable[[], None]) -> None:
        self._loader = loader
        self._do = do

    def __getattr__(self, name: str) -> Any:
        return getattr(self._loader, name)

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        """Leave the making to the other loader."""
        made: ModuleType | None = self._loader.create_module(spec)
        return made

    def exec_module(self, module: ModuleType) -> None:
        """Run the module."""
        self._loader.exec_module(module)
        self._do()
