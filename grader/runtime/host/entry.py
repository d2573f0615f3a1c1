"""Runs a student's file as a ROS user would, as a script or as a module of its package."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import inspect
import os
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
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
    import_folders,
    layout_of,
    never_true,
    offers_main,
    parse,
    start_of,
)
from .protocol import Note
from .shadows import Shadows

#: Sends a note to the grader.
Notify = Callable[[Note], None]


def path_of(request: Mapping[str, Any]) -> list[str]:
    """Return the first folders of sys.path: the folder of the script, or the folders that contain packages."""
    root, file = request["root"], request["file"]
    layout = _layout_of(request)
    # As Python does: the folder of the script, or for a module of a package the folder that the package is in.
    first = layout.base if layout.module else os.path.dirname(os.path.join(root, file))
    if not layout.module and layout.package is None:
        return [first]
    imported = (os.path.join(root, folder) for folder in request.get("imported", ()))
    packages = import_folders(root, layout.module, layout.base)
    return list(dict.fromkeys(f for f in (first, *packages, *imported) if f))


def _layout_of(request: Mapping[str, Any]) -> PackageLayout:
    return layout_of(request["root"], request["file"], installed=request.get("installed", False))


def shadows_of(request: Mapping[str, Any]) -> Shadows:
    """Find the modules of a submission that hide other modules from the file that a request names."""
    return Shadows(path_of(request))


def command_line(request: Mapping[str, Any]) -> list[str]:
    """Return the arguments of the program; parameter files are written to the folder for temporary files."""
    given = list(request.get("ros_arguments", ()))
    for number, (name, text) in enumerate(request.get("parameter_files", ()), 1):
        # Files, as `ros2 run` has them: rclpy reads parameters from files or from single arguments only.
        folder = os.path.join(os.environ.get("HOME") or tempfile.gettempdir(), f"parameters_{os.getpid()}_{number}")
        os.makedirs(folder, exist_ok=True)
        path = os.path.join(folder, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        given += ["--params-file", path]
    return [*request.get("arguments", ()), *(["--ros-args", *given] if given else [])]


def run_file(request: Mapping[str, Any], notify: Notify, install_ros: Callable[[], None]) -> None:
    """Run one file of a submission to its end; raises whatever the file raises.

    Args:
        request: The submission's folder as `root`; the file, relative to it; the console scripts of its package;
            whether it is `installed` as it is; the folders of installed Python packages as `imported`; and what it is
            started with.
        notify: Called with the way the file is started, before any of its code runs, and with notes for the report.
        install_ros: Called when the program imports rclpy, if a module of the submission hides another one.
    """
    root, file = request["root"], request["file"]
    path = os.path.join(root, file)
    tree = parse(path)  # raises a syntax error before any code has run
    layout = _layout_of(request)
    start = start_of(root, file, layout, offers_main(tree), request.get("executable", ""), request.get("scripts", ()))
    shadows = shadows_of(request)
    # Before any code of the file: how it was started is needed most if it then ends at once.
    notify(Note("started", start.way, start.module, start.function, shadows.files))
    if shadows.files:
        shadows.fall(install_ros)
    # In front, as Python puts the folder of a script there: a file of the student's hides a module of Python.
    sys.path[:0] = [f for f in dict.fromkeys((start.base, *path_of(request))) if f]
    if layout.module:
        _find_neighbours(tree, path, notify)
    sys.argv = [path, *command_line(request)]
    sys.orig_argv = [sys.executable, *sys.argv]
    # Only for these ways: an entry point names the function to call.
    if start.way in (SCRIPT, MODULE):
        run_what_nothing_called(_run_as_main(path, start.module, layout), tree, notify)
        return
    main = sys.modules["__main__"] = ModuleType("__main__")  # the console script that calls the module
    main.__file__ = path
    _make_nameless(path, layout)
    called: Any = importlib.import_module(start.module)
    for name in start.function.split("."):
        called = getattr(called, name)
    result = called()
    # A console script passes the result of the function to `sys.exit`.
    if start.way != MAIN:
        sys.exit(result)


def _run_as_main(path: str, name: str, layout: PackageLayout) -> dict[str, Any]:
    """Run a file as `__main__` and keep its module alive, as the interpreter does.

    Args:
        path: The file.
        name: Its dotted name, if it is run as a module of its package.
        layout: Its place in the package.
    """
    module = ModuleType("__main__")
    module.__file__ = path
    module.__loader__ = SourceFileLoader("__main__", path)
    module.__spec__ = None
    # As in a script: in modules that are imported, it is the dictionary.
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
    # As bytes: Python reads the declared encoding itself.
    with open(path, "rb") as source:
        code = compile(source.read(), path, "exec", dont_inherit=True)
    exec(code, module.__dict__)  # noqa: S102 - running the student's file is what the host is for
    return module.__dict__


def _make_nameless(path: str, layout: PackageLayout) -> None:
    """Create the package if the submission is the package's own folder, which no entry of sys.path contains."""
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


def _find_neighbours(tree: ast.Module, path: str, notify: Notify) -> None:
    """Let a file in a package import modules in its folder by their plain names, which `ros2 run` would not find."""
    folder = os.path.dirname(path)
    if folder in sys.path:
        return
    for name in sorted(_plain_imports(tree)):
        beside = os.path.isfile(os.path.join(folder, f"{name}.py"))
        if beside and name not in sys.modules and PathFinder.find_spec(name) is None:
            notify(Note("neighbour_imported", module=name))
    # At the end: packages that are installed come first, as they would under `ros2 run`.
    sys.path.append(folder)


def _plain_imports(tree: ast.Module) -> set[str]:
    names = {a.name for node in ast.walk(tree) if isinstance(node, ast.Import) for a in node.names}
    names |= {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.level == 0 and n.module}
    return {name.partition(".")[0] for name in names}


def run_what_nothing_called(namespace: dict[str, Any], tree: ast.Module, notify: Notify) -> None:
    """Start what a file defines but never starts: its `main`, or its only node class."""
    lifetimes = sys.modules.get(f"{__package__}.lifetimes")
    # A file that has made a node has been started, however it did that.
    if lifetimes is None or lifetimes.MADE_NODES:
        return
    # `main` before a class: it says how its author means the node to be run.
    main = namespace.get("main")
    if callable(main) and not _calls_at_top_level(tree.body, "main"):
        notify(Note("main_not_called"))
        main()
        return
    nodes = _node_classes(namespace)
    # With two, nobody knows which; and where there is a `main`, it was called above or by the file.
    if "main" not in namespace and len(nodes) == 1:
        notify(Note("class_not_started", class_name=nodes[0].__name__))
        if _needs_nothing(nodes[0]):
            spin(nodes[0])


def _calls_at_top_level(statements: Sequence[ast.stmt], name: str) -> bool:
    """Return whether a statement calls a name when the file runs as a script."""
    return calls([statement for statement in statements if not never_true(statement)], name)


def _node_classes(namespace: dict[str, Any]) -> list[Any]:
    node = getattr(sys.modules.get("rclpy.node"), "Node", None)
    return [
        value
        for value in namespace.values()
        if isinstance(value, type)
        and node is not None
        and issubclass(value, node)
        # Not what was imported: a base class in a helper module is there to be derived from.
        and value.__module__ == namespace["__name__"]
    ]


def _needs_nothing(node_class: Any) -> bool:
    """Return whether a class can be called without arguments; one that cannot is for other modules to use."""
    try:
        inspect.signature(node_class).bind()
    except TypeError:
        return False
    return True


def spin(node_class: Any) -> None:
    """Create a node and spin it."""
    import rclpy

    if not rclpy.ok():
        rclpy.init()
    rclpy.spin(node_class())
