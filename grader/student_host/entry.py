"""Runs a student's file as a ROS user would: as a script, or as a module of its package."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import os
import sys
from collections.abc import Callable, Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import ModuleType
from typing import Any

from .packages import (
    MAIN,
    MODULE,
    NAMELESS,
    SCRIPT,
    PackageLayout,
    calls,
    layout_of,
    never_true,
    package_folders,
    start_of,
)
from .shadows import Shadows

#: Takes a code and what belongs to it: `started`, and what the report has to mention.
Say = Callable[[dict[str, Any]], None]


def path_of(root: str, file: str) -> list[str]:
    """Return the folders that come first on the path: the script's own, or those that hold packages."""
    layout = layout_of(root, file)
    if not layout.module:
        built = package_folders(root) if layout.package is not None else []
        return list(dict.fromkeys((os.path.dirname(os.path.join(root, file)), *built)))
    return list(dict.fromkeys(f for f in (layout.base, *package_folders(root)) if f))


def shadows_of(root: str, file: str) -> Shadows:
    """Return which modules of a submission hide others from one of its files."""
    return Shadows(path_of(root, file))


def run_file(root: str, file: str, say: Say, install_ros: Callable[[], None]) -> None:
    """Run one file of a submission to its end; raises whatever the file raises.

    Args:
        root: The submission's folder.
        file: The file, relative to it.
        say: Hears how the file is started, before anything of it runs, and what the report has to mention.
        install_ros: Called when the program has imported rclpy, if a module of the submission hides another.
    """
    path = os.path.join(root, file)
    tree = _parse(path)  # a syntax error is raised before anything has run
    layout = layout_of(root, file)
    start = start_of(root, file, layout, tree)
    shadows = shadows_of(root, file)
    how = {"way": start.way, "module": start.module, "function": start.function}
    say({"code": "started", **how, "hidden": shadows.files})
    if shadows.files:
        shadows.fall(install_ros)
    sys.path[:0] = [f for f in dict.fromkeys((start.base, *path_of(root, file))) if f]
    if layout.module:
        _find_neighbours(tree, path, say)
    sys.argv = [path]
    if start.way in (SCRIPT, MODULE):
        run_what_nothing_called(_run_as_main(path, start.module, layout), tree, say)
        return
    main = sys.modules["__main__"] = ModuleType("__main__")  # the console script that calls the module
    main.__file__ = path
    _make_nameless(path, layout)
    called: Any = importlib.import_module(start.module)
    for name in start.function.split("."):
        called = getattr(called, name)
    result = called()
    if start.way != MAIN:
        sys.exit(result)


def _parse(path: str) -> ast.Module:
    with open(path, "rb") as source:
        text = source.read()
    before, null, _ = text.partition(b"\0")
    if null:  # Python says so as well, but not where
        raise SyntaxError("source code cannot contain null bytes", (path, before.count(b"\n") + 1, None, None))
    return ast.parse(text, path)


def _run_as_main(path: str, name: str, layout: PackageLayout) -> dict[str, Any]:
    """Run a file as `__main__` and keep its module alive, as the interpreter does.

    Args:
        path: The file.
        name: Its dotted name, if it is run as a module of its package.
        layout: Where it lies.
    """
    module = ModuleType("__main__")
    module.__file__ = path
    module.__loader__ = SourceFileLoader("__main__", path)
    module.__spec__ = None
    module.__dict__["__builtins__"] = sys.modules["builtins"]
    module.__dict__["__cached__"] = None
    sys.modules["__main__"] = module
    package = name.rpartition(".")[0]
    if name:
        _make_nameless(path, layout)
        if package:
            importlib.import_module(package)
        module.__package__ = package
        module.__spec__ = ModuleSpec(name, module.__loader__, origin=path)
    with open(path, "rb") as source:
        code = compile(source.read(), path, "exec", dont_inherit=True)
    exec(code, module.__dict__)  # noqa: S102 - running the student's file is what the host is for
    return module.__dict__


def _make_nameless(path: str, layout: PackageLayout) -> None:
    """Make the package whose own folder is all that was handed in: no folder on the path holds it."""
    parts = layout.module.split(".")
    if layout.base or parts[0] != NAMELESS:
        return
    folder = path
    for _ in parts[1:]:
        folder = os.path.dirname(folder)
    init = os.path.join(folder, "__init__.py")
    spec = importlib.util.spec_from_file_location(NAMELESS, init, submodule_search_locations=[folder])
    if spec is not None and spec.loader is not None:
        package = sys.modules[NAMELESS] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(package)


def _find_neighbours(tree: ast.Module, path: str, say: Say) -> None:
    """Let a file in a package import what lies beside it by its plain name, which `ros2 run` would not find."""
    folder = os.path.dirname(path)
    if folder in sys.path:
        return
    for name in sorted(_plain_imports(tree)):
        beside = os.path.isfile(os.path.join(folder, f"{name}.py"))
        if beside and name not in sys.modules and PathFinder.find_spec(name) is None:
            say({"code": "neighbour_imported", "module": name})
    sys.path.append(folder)


def _plain_imports(tree: ast.Module) -> set[str]:
    names = {a.name for node in ast.walk(tree) if isinstance(node, ast.Import) for a in node.names}
    names |= {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.level == 0 and n.module}
    return {name.partition(".")[0] for name in names}


def run_what_nothing_called(namespace: dict[str, Any], tree: ast.Module, say: Say) -> None:
    """Start what a file defines but never starts: its `main`, or its only node class."""
    ros = sys.modules.get(f"{__package__}.ros")
    if ros is None or ros.MADE_NODES:
        return
    main = namespace.get("main")
    if callable(main) and not _calls_at_top_level(tree.body, "main"):
        say({"code": "main_not_called"})
        main()
        return
    nodes = _node_classes(namespace)
    if "main" not in namespace and len(nodes) == 1:
        say({"code": "class_not_started", "class": nodes[0].__name__})
        spin(nodes[0])


def _calls_at_top_level(statements: Sequence[ast.stmt], name: str) -> bool:
    """Return whether a statement that runs when the file is run as a script calls a name."""
    return calls([statement for statement in statements if not never_true(statement)], name)


def _node_classes(namespace: dict[str, Any]) -> list[Any]:
    node = getattr(sys.modules.get("rclpy.node"), "Node", None)
    return [
        value
        for value in namespace.values()
        if isinstance(value, type)
        and node is not None
        and issubclass(value, node)
        and value.__module__ == namespace["__name__"]
    ]


def spin(node_class: Any) -> None:
    """Make a node and spin it."""
    import rclpy

    if not rclpy.ok():
        rclpy.init()
    rclpy.spin(node_class())
