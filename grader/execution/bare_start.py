"""Builds the command line of a bare process: a file run as a script, as a module, or through its main()."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path, PurePosixPath

from grader.student_host.packages import ENTRY_POINT, layout_of, never_true, package_folders, start_of

#: A larger file is not parsed but run as a script: nobody writes one by hand.
MOST_BYTES = 1 << 20
#: Modules whose functions only prepare the program when a file calls them at the top level.
_SETTING_UP = frozenset({"sys", "os", "warnings", "random", "logging", "np", "numpy", "signal", "math"})
#: A package that every full ROS installation has, but that no wheel provides.
STAND_IN = "example_interfaces"
_MAKE_STAND_IN = f"""
import sys, types
def _interface(name):
    if name.startswith("_"):
        raise AttributeError(name)
    return type(name, (), {{}})
for _name in ("", ".msg", ".srv", ".action"):
    _module = sys.modules["{STAND_IN}" + _name] = types.ModuleType("{STAND_IN}" + _name)
    _module.__path__, _module.__getattr__ = [], _interface
"""
_NODES = frozenset({"Node", "LifecycleNode"})


def bare_arguments(here: Path, root: str, file: str) -> tuple[str, ...]:
    """Return the Python arguments that run a file as its author would.

    A file in a package is started as `ros2 run` starts it. If a file starts nothing by itself, the command calls its
    main() or spins its only node, as in virtual time.

    Args:
        here: The staged submission.
        root: The path at which the process sees the submission.
        file: The file, relative to `root`.
    """
    path = f"{root}/{file}"
    missing = _missing(here)
    beside = str(PurePosixPath(path).parent)
    script = f"runpy.run_path({path!r}, run_name='__main__')"
    tree = _parsed(here / file)
    if tree is None:
        return _by_import(script, [beside], path, missing) if missing else ("-u", path)
    layout = layout_of(str(here), file)
    start = start_of(str(here), file, layout, tree)
    folders = [f for f in dict.fromkeys((start.base, layout.base, *package_folders(str(here)))) if f]
    seen = [root + folder.removeprefix(str(here)) for folder in folders]
    if layout.module and not layout.base:  # its package is the submission's own folder
        seen.append(str(PurePosixPath(root).parent))
    if start.function:
        called = f"importlib.import_module({start.module!r}).{start.function}()"
        return _by_import(f"sys.exit({called})" if start.way == ENTRY_POINT else called, seen, path, missing)
    module = start.module or PurePosixPath(file).stem
    seen = seen if start.module else list(dict.fromkeys([beside, *(seen if layout.package is not None else ())]))
    if run := _help(tree, module):
        return _by_import(run, seen, path, missing)
    if start.module:
        return _by_import(f"runpy.run_module({module!r}, run_name='__main__', alter_sys=True)", seen, path, missing)
    return _by_import(script, seen, path, missing) if missing or len(seen) > 1 else ("-u", path)


def _help(tree: ast.Module, module: str) -> str:
    """Return code that starts a file which starts nothing by itself; empty if that is not needed or not possible."""
    if any(map(_starts, tree.body)):
        return ""
    if any(isinstance(node, ast.FunctionDef) and node.name == "main" for node in tree.body):
        return f"importlib.import_module({module!r}).main()"
    nodes = [node.name for node in tree.body if isinstance(node, ast.ClassDef) and _is_node(node)]
    spin = f"import rclpy; rclpy.init(); rclpy.spin(importlib.import_module({module!r}).{''.join(nodes)}())"
    return spin if len(nodes) == 1 else ""


def _by_import(run: str, folders: Sequence[str], path: str, missing: str) -> tuple[str, ...]:
    beside = str(PurePosixPath(path).parent)
    behind = "" if beside in folders else f"; sys.path.append({beside!r})"
    begin = f"import importlib, runpy, sys; sys.path[:1] = {list(folders)!r}; sys.argv[0] = {path!r}{behind}"
    return ("-u", "-c", f"{missing}{begin}; {run}")


def _missing(here: Path) -> str:
    """Return code that provides example_interfaces if a file names it and it is not installed; usually empty.

    Tutorials import it without using it. In virtual time the host provides a stand-in.
    """
    if find_spec(STAND_IN) is not None or (here / STAND_IN).exists():
        return ""
    named = any(_names_stand_in(path) for path in here.rglob("*.py"))
    return _MAKE_STAND_IN if named else ""


def _names_stand_in(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return STAND_IN.encode() in file.read(MOST_BYTES)
    except OSError:
        return False


def _parsed(path: Path) -> ast.Module | None:
    try:
        content = path.read_bytes()
        return ast.parse(content) if len(content) <= MOST_BYTES else None
    except (OSError, SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def _starts(statement: ast.stmt) -> bool:
    """Return whether a top-level statement may run the program, as opposed to only preparing it."""
    if isinstance(statement, ast.Expr):
        return isinstance(statement.value, ast.Call) and _root(statement.value.func) not in _SETTING_UP
    if isinstance(statement, ast.If) and never_true(statement):
        return any(map(_starts, statement.orelse))
    inner = (part for name in ("body", "orelse", "finalbody") for part in getattr(statement, name, []))
    return not isinstance(statement, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)) and any(map(_starts, inner))


def _root(node: ast.expr) -> str:
    while isinstance(node, (ast.Attribute, ast.Call, ast.Subscript)):
        node = node.func if isinstance(node, ast.Call) else node.value
    return node.id if isinstance(node, ast.Name) else ""


def _is_node(node: ast.ClassDef) -> bool:
    return any(getattr(base, "id", getattr(base, "attr", "")) in _NODES for base in node.bases)
