"""Hides what the host has imported from a program until it imports that itself, as in plain Python.

A package has each submodule that anybody has imported as an attribute: `import rclpy` alone gives `rclpy.node` where
the host has imported that. So it is remembered which module has imported which. Before the program runs, all of them
are taken out of `sys.modules` and of their packages. What the program imports comes back, with what that has imported.
"""

from __future__ import annotations

import builtins
import importlib.util
import sys
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import FrameType, ModuleType
from typing import Any

#: Never hidden: the program itself, the grader's modules, which programs cannot name, and what replaces clocks: its
#: functions are looked up in sys.modules at each call.
_OWN = ("__main__", "sitecustomize", "_grader_host", "_launcher", "_sandbox", "time_machine", "_time_machine")


class Imports(MetaPathFinder):
    """What has been imported by whom, since it was begun."""

    def __init__(self) -> None:
        self._first = frozenset(sys.modules)  # as far as is known, those of every program
        self._import: Any = builtins.__import__
        self._imported: dict[str, set[str]] = {}  # by each module that was running
        self._modules: dict[str, ModuleType] = {}  # all that were hidden
        self._hidden: set[str] = set()  # those that still are
        self._attributes: dict[str, ModuleType] = {}  # hidden ones, by `package.name`

    def begin(self) -> None:
        """Note imports from now on."""
        builtins.__import__ = self._noted
        sys.meta_path.insert(0, self)

    def end(self) -> None:
        """Note no more, and hide nothing."""
        builtins.__import__ = self._import
        sys.meta_path[:] = [finder for finder in sys.meta_path if finder is not self]

    def hide(self) -> None:
        """Hide all that was imported meanwhile; no more is noted."""
        builtins.__import__ = self._import
        for name, module in list(sys.modules.items()):
            if name in self._first or name.partition(".")[0] in _OWN or module is None:
                continue
            self._modules[name] = sys.modules.pop(name)
            self._hidden.add(name)
        # Some modules of C++ put parts of themselves into sys.modules, without an import.
        for name in self._hidden.difference(*self._imported.values()):
            self._imported.setdefault(name.rpartition(".")[0], set()).add(name)
        for name, module in self._modules.items():
            above, last = self._above(name)
            if above is not None and vars(above).get(last) is module:
                self._attributes[name] = module
                delattr(above, last)

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> ModuleSpec | None:
        """Note who imports a module for the first time; return the spec of a hidden one, which comes back."""
        if fullname not in self._hidden:
            if builtins.__import__ == self._noted:
                self._note(sys._getframe(), fullname)
            return None
        module = self._modules[fullname]
        if self._is_another(fullname, module):
            return None
        self._hidden.discard(fullname)  # Python itself puts it into sys.modules
        for name in self._with_imported(fullname):
            self._show(name)
        return ModuleSpec(fullname, _Known(module), origin=getattr(module, "__file__", None))

    def _is_another(self, name: str, module: ModuleType) -> bool:
        """Return whether a file of the student's has the name of a hidden module, which it then is."""
        if "." in name:
            return False
        found = PathFinder.find_spec(name)
        return found is not None and found.origin != getattr(module.__spec__, "origin", None)

    def _with_imported(self, name: str) -> dict[str, None]:
        """Return a module and all that it has imported, directly or not, with the packages of each."""
        found: dict[str, None] = {}
        waiting = [name]
        while waiting:
            one = waiting.pop()
            if one not in found:
                found[one] = None
                waiting += [*self._imported.get(one, ()), *([one.rpartition(".")[0]] if "." in one else [])]
        return found

    def _show(self, name: str) -> None:
        if name in self._hidden:
            self._hidden.discard(name)
            sys.modules[name] = self._modules[name]
        above, last = self._above(name)
        if above is not None and name in self._attributes:
            vars(above).setdefault(last, self._attributes.pop(name))

    def _above(self, name: str) -> tuple[ModuleType | None, str]:
        """Return the package of a module, and the module's name in it."""
        package, _, last = name.rpartition(".")
        return self._modules.get(package) or sys.modules.get(package), last

    def _noted(
        self, name: str, globals: Any = None, locals: Any = None, fromlist: Any = (), level: int = 0
    ) -> ModuleType:
        found: ModuleType = self._import(name, globals, locals, fromlist, level)
        package = (globals or {}).get("__package__") or ""
        whole = importlib.util.resolve_name(f"{'.' * level}{name}", package) if level else name
        frame = sys._getframe(1)
        self._note(frame, whole)
        names = getattr(sys.modules.get(whole), "__all__", ()) if fromlist and "*" in fromlist else fromlist or ()
        for last in names:
            if f"{whole}.{last}" in sys.modules:
                self._note(frame, f"{whole}.{last}")
        return found

    def _note(self, frame: FrameType | None, name: str) -> None:
        """Note that the module that is running imports another one, itself or by a function that it calls."""
        while frame is not None and frame.f_code.co_name != "<module>":
            frame = frame.f_back
        if frame is not None:
            self._imported.setdefault(frame.f_globals.get("__name__", ""), set()).add(name)


class _Known(Loader):
    """Loads a module that has been run already."""

    def __init__(self, module: ModuleType) -> None:
        self._module = module
        self._spec = module.__spec__

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module."""
        return self._module

    def exec_module(self, module: ModuleType) -> None:
        """Give it back the spec that it had; it has been run."""
        module.__spec__ = self._spec


#: What the host of this process has imported.
IMPORTS = Imports()
