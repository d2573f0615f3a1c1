"""Runs a student's file as its author would: as a script, as a module of its package, or through its main function."""

from __future__ import annotations

import ast
import importlib.util
import os
import runpy
import sys
from collections.abc import Callable
from typing import Any

Say = Callable[[str], None]


def run_file(root: str, file: str, say: Say) -> None:
    """Run one file of a submission to its end; raises whatever the file raises.

    Args:
        root: The submission's folder.
        file: The file, relative to it.
        say: Takes a sentence that the report has to mention.
    """
    path = os.path.join(root, file)
    tree = _parse(path)  # a syntax error is raised before anything has run
    package, folder = _package(path, root)
    warn_of_shadows(os.path.dirname(path), say)
    for directory in dict.fromkeys((os.path.dirname(path), folder)):
        sys.path.append(directory)
    sys.argv = [path]
    sys.modules.pop("__main__", None)
    module = os.path.splitext(os.path.basename(path))[0]
    if _imports_relatively(tree):
        namespace = runpy.run_module(f"{package}.{module}", run_name="__main__", alter_sys=True)
    else:
        namespace = _run_as_main(path)
    run_what_nothing_called(namespace, tree, file, say)


def _parse(path: str) -> ast.Module:
    with open(path, "rb") as source:
        text = source.read()
    before, null, _ = text.partition(b"\0")
    if null:  # Python says so as well, but not where
        raise SyntaxError("source code cannot contain null bytes", (path, before.count(b"\n") + 1, None, None))
    return ast.parse(text, path)


def _run_as_main(path: str) -> dict[str, Any]:
    """Run a file as `__main__` and keep its module alive, as the interpreter does."""
    spec = importlib.util.spec_from_loader("__main__", loader=None)
    if spec is None:
        raise ImportError(path)
    module = importlib.util.module_from_spec(spec)
    module.__file__ = path
    module.__spec__ = None
    sys.modules["__main__"] = module
    with open(path, "rb") as source:
        code = compile(source.read(), path, "exec", dont_inherit=True)
    exec(code, module.__dict__)  # noqa: S102 - running the student's file is what the host is for
    return module.__dict__


def _package(path: str, root: str) -> tuple[str, str]:
    """Return the dotted package a file lies in, and the folder that must be on the path for it."""
    folder = os.path.dirname(path)
    names = [os.path.basename(folder)]
    folder = os.path.dirname(folder)
    while folder.startswith(root) and os.path.exists(os.path.join(folder, "__init__.py")):
        names.insert(0, os.path.basename(folder))
        folder = os.path.dirname(folder)
    return ".".join(names), folder


def _imports_relatively(tree: ast.Module) -> bool:
    return any(isinstance(node, ast.ImportFrom) and node.level > 0 for node in ast.walk(tree))


def warn_of_shadows(folder: str, say: Say) -> None:
    """Mention modules of the student's that hide a module that Python or ROS needs."""
    for name in sorted(os.listdir(folder)):
        module, extension = os.path.splitext(name)
        if extension == ".py" and (module in sys.stdlib_module_names or module in ROS_MODULES):
            shadows = f"{name} has the name of a module that Python or ROS needs"
            say(f"{shadows}: `python3` would import it instead; rename it")


def run_what_nothing_called(namespace: dict[str, Any], tree: ast.Module, file: str, say: Say) -> None:
    """Start what a file defines but never starts: its `main`, or its only node class."""
    from . import ros

    if ros.MADE_NODES:
        return
    main = namespace.get("main")
    if callable(main) and not _calls_at_top_level(tree, "main"):
        say(
            f"{file}: nothing calls main(), so `python3 {file}` would do nothing; "
            "add: if __name__ == '__main__': main()"
        )
        main()
        return
    nodes = _node_classes(namespace)
    if "main" not in namespace and len(nodes) == 1:
        say(
            f"{file}: nothing starts {nodes[0].__name__}, so `python3 {file}` would do nothing; "
            "add a main() that calls rclpy.init(), makes the node and spins it"
        )
        spin(nodes[0])


def _calls_at_top_level(tree: ast.Module, name: str) -> bool:
    """Return whether a statement that runs when the file is run as a script calls a name."""
    return any(
        isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == name
        for statement in tree.body
        if not isinstance(statement, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef))
        and not _never_true(statement)
        for node in ast.walk(statement)
    )


def _never_true(statement: ast.stmt) -> bool:
    """Return whether a statement is a guard on `__name__` that does not hold, such as a misspelt one."""
    if not isinstance(statement, ast.If) or not isinstance(statement.test, ast.Compare):
        return False
    names = {node.id for node in ast.walk(statement.test) if isinstance(node, ast.Name)}
    texts = {node.value for node in ast.walk(statement.test) if isinstance(node, ast.Constant)}
    return "__name__" in texts or ("__name__" in names and "__main__" not in texts)


def _node_classes(namespace: dict[str, Any]) -> list[Any]:
    from rclpy.node import Node

    return [
        value
        for value in namespace.values()
        if isinstance(value, type) and issubclass(value, Node) and value.__module__ == "__main__"
    ]


def spin(node_class: Any) -> None:
    """Make a node and spin it."""
    import rclpy

    if not rclpy.ok():
        rclpy.init()
    rclpy.spin(node_class())


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
