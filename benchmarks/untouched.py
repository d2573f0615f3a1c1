"""Lists which names of rclpy's public interface no test program uses: classes, functions, methods, parameters.

Usage: python benchmarks/untouched.py [FOLDER...]
       FOLDERs hold the programs (tests, reference_solutions, student_template, examples, benchmarks). A name counts as
       used where it stands as a word, a method after a dot, a parameter before an equals sign, so the list is too
       short rather than too long.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import rclpy

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("tests", "reference_solutions", "student_template", "examples", "benchmarks")
#: Holds names, and no programs.
NO_PROGRAMS = ("test_ros_names_of_rclpy.py",)
#: Wraps C++, and is experimental: not for programs.
PRIVATE = ("impl", "experimental", "_")


def public(prefix: str, owner: object, module: str) -> Iterator[tuple[str, object]]:
    """Yield the public names of a module or class that are defined there, with what they name."""
    for name, value in vars(owner).items():
        where = getattr(inspect.unwrap(getattr(value, "__func__", value)), "__module__", module)
        if not name.startswith("_") and where == module:
            yield f"{prefix}.{name}", value


def interface() -> Iterator[tuple[str, str, str]]:
    """Yield every name with its kind and the pattern that finds it in a program."""
    for found in pkgutil.walk_packages(rclpy.__path__, "rclpy."):
        if any(part.startswith(PRIVATE) for part in found.name.split(".")[1:]):
            continue
        module = importlib.import_module(found.name)
        for name, value in (*public(found.name, module, found.name), *of_package(found.name)):
            if inspect.isclass(value):
                yield "class", name, rf"\b{value.__name__}\b"
                for method, called in public(name, value, found.name):
                    last = method.rpartition(".")[2]
                    yield "method" if callable(called) else "attribute", method, rf"\.{last}\b"
                    yield from parameters(method, called)
                yield from parameters(f"{name}.__init__", vars(value).get("__init__"))
            elif inspect.isfunction(value):
                yield "function", name, rf"\b{value.__name__}\b"
                yield from parameters(name, value)


def of_package(name: str) -> Iterator[tuple[str, object]]:
    """Yield the functions of rclpy itself, once."""
    if name == "rclpy.action":
        yield from public("rclpy", rclpy, "rclpy")


def parameters(owner: str, called: object) -> Iterator[tuple[str, str, str]]:
    """Yield the parameters with a default, which a program may name."""
    if inspect.isfunction(called := inspect.unwrap(getattr(called, "__func__", called))):  # type: ignore[arg-type]
        for name, parameter in inspect.signature(called).parameters.items():
            if parameter.default is not inspect.Parameter.empty and not name.startswith("_"):
                yield "parameter", f"{owner}({name})", rf"\b{name}\s*=[^=]"


def main() -> None:
    """Print the list, and how many names of each kind there are."""
    folders = [Path(name) for name in sys.argv[1:]] or [ROOT / name for name in FOLDERS]
    files = [file for folder in folders for file in folder.rglob("*.py") if file.name not in NO_PROGRAMS]
    texts = "\n".join(file.read_text(encoding="utf-8", errors="replace") for file in files)
    counts: dict[str, list[int]] = {}
    for kind, name, pattern in sorted(set(interface())):
        used = int(re.search(pattern, texts) is not None)
        counts.setdefault(kind, [0, 0])[used] += 1
        if not used:
            print(kind, name)
    for kind, (unused, used) in counts.items():
        print(f"# {kind}: {unused} of {unused + used} are not used")


if __name__ == "__main__":
    main()
