"""Makes imports in the student's program find what they would find without the host.

A student's module may hide a module that Python or ROS needs. The host has already imported many modules, including
rclpy. If a student's file has the name of one, the program starts without these modules, and rclpy is made virtual when
the program imports it: each import finds the same module as without the host, and fails where it would fail.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
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
#: Modules that every interpreter imports before it runs a script.
_AT_START = frozenset({"abc", "codecs", "encodings", "genericpath", "io", "os", "posixpath", "site", "stat"})
#: Modules that the import system needs, or that the host has changed, which a second copy would not reflect.
_KEPT = frozenset({"importlib", "selectors", "signal", "threading"})
#: The parts of rclpy that the host changes.
ROS_PARTS = (
    "rclpy.client",
    "rclpy.clock",
    "rclpy.context",
    "rclpy.duration",
    "rclpy.event_handler",
    "rclpy.executors",
    "rclpy.guard_condition",
    "rclpy.impl.implementation_singleton",
    "rclpy.impl.rcutils_logger",
    "rclpy.logging",
    "rclpy.node",
    "rclpy.parameter",
    "rclpy.publisher",
    "rclpy.qos",
    "rclpy.service",
    "rclpy.subscription",
    "rclpy.task",
    "rclpy.time",
    "rclpy.time_source",
    "rclpy.timer",
    "rclpy.topic_endpoint_info",
    "rclpy.utilities",
)


class Shadows:
    """The student's modules that hide others.

    Args:
        folders: The first folders of sys.path.

    Attributes:
        files: Names of the files and packages that hide a module, sorted.
    """

    def __init__(self, folders: Sequence[str]) -> None:
        found = {(name, module) for folder in folders for name, module in _modules(folder) if _is_needed(module)}
        self._folders = folders
        self.files = sorted(name for name, _ in found)
        self._names = {module for _, module in found}
        self._real: dict[str, ModuleType] = {}

    def fall(self, install: Callable[[], None]) -> None:
        """Remove the hidden modules from sys.modules, and make rclpy virtual when the program has imported it.

        Args:
            install: Makes rclpy virtual.
        """
        hidden = {name for name in sys.modules if name.partition(".")[0] in self._names}
        while more := {name for name in _replaceable() - hidden if _goes_with(name, hidden)}:
            hidden |= more
        self._real = {name: sys.modules.pop(name) for name in hidden}
        sys.meta_path.insert(0, Around("rclpy", lambda: self._installing(install)))

    @contextmanager
    def _installing(self, install: Callable[[], None]) -> Iterator[None]:
        yield
        try:
            for part in ROS_PARTS:
                importlib.import_module(part)
        except Exception:  # the program's own imports fail in the same way
            return
        with self._lifted():
            install()

    @contextmanager
    def _lifted(self) -> Iterator[None]:
        """Make the host's own imports find the real modules during the block."""
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
    """Yield the files and folders that can be imported from a folder, with their module names."""
    with suppress(OSError):
        for name in os.listdir(folder):
            module, extension = os.path.splitext(name)
            if extension == ".py" or os.path.isfile(os.path.join(folder, name, "__init__.py")):
                yield name, module


def _is_needed(module: str) -> bool:
    """Return whether Python or ROS has a module of that name and finds it through sys.path."""
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
    """Return whether a module has imported something from some modules, or is part of one of them."""
    module = sys.modules[name]
    for value in list(vars(module).values()):
        source = value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None)
        if not isinstance(source, str) or source == name or source.startswith(f"{name}."):
            continue
        if {source, source.removeprefix("_")} & names:  # C implementations are in modules such as _heapq
            return True
    return any(name.startswith(f"{other}.") for other in names)


class Around(MetaPathFinder):
    """An importer that does something before and after a module is run, when it is imported for the first time.

    Args:
        name: The module.
        around: Returns a context manager that the module is run in.
    """

    def __init__(self, name: str, around: Callable[[], AbstractContextManager[None]]) -> None:
        self._name = name
        self._around = around

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> ModuleSpec | None:
        """Return the spec of the module, with a loader that enters the context; None for any other module."""
        if fullname != self._name:
            return None
        sys.meta_path.remove(self)
        others = [finder for finder in sys.meta_path if hasattr(finder, "find_spec")]
        spec = next((s for f in others if (s := f.find_spec(fullname, path, target)) is not None), None)
        if spec is not None and spec.loader is not None:
            spec.loader = _Within(spec.loader, self._around)
        return spec


class _Within(Loader):
    """Wraps a loader, and runs the module in a context."""

    def __init__(self, loader: Any, around: Callable[[], AbstractContextManager[None]]) -> None:
        self._loader = loader
        self._around = around

    def __getattr__(self, name: str) -> Any:
        return getattr(self._loader, name)

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        """Let the wrapped loader create the module."""
        made: ModuleType | None = self._loader.create_module(spec)
        return made

    def exec_module(self, module: ModuleType) -> None:
        """Run the module in the context."""
        with self._around():
            self._loader.exec_module(module)
