"""Finds out how a ROS user would start a file: with `python3 FILE`, or with `ros2 run` if it belongs to a package.

No student code is imported or run, and no project file read: the grader tells which console scripts there are.
"""

from __future__ import annotations

import ast
import os
from collections.abc import Iterator, Sequence
from typing import NamedTuple

#: A folder with one of these files is a ROS package.
MARKERS = ("setup.py", "package.xml")
#: A package with this file, and without setup.py, installs its programs as scripts.
CMAKE = "CMakeLists.txt"
#: The name given to a package if the submission is the package's own folder.
NAMELESS = "submission"
#: The most folders of a submission that are searched for packages.
FOLDERS = 500

#: A folder with one of these files was made by a tool: a virtual environment, or the output of `colcon build`. Folders
#: with these names hold what is not the student's own either. Submissions are copied without them
#: (`grader/grading/submissions/collected.py`), but not every folder that is searched is such a copy.
GENERATED = ("pyvenv.cfg", "COLCON_IGNORE")
SKIPPED = frozenset({"__pycache__", "__MACOSX", "venv", "node_modules"})

SCRIPT, MODULE, MAIN, ENTRY_POINT = "script", "module", "main", "entry_point"


class PackageLayout(NamedTuple):
    """The place of a file in its package.

    Attributes:
        module: Its dotted name in its package; empty for a file outside of packages or in a CMake package.
        base: Absolute path of the folder that the dotted name is relative to; empty if that is above the submission.
        package: Relative folder of the ROS package, which has setup.py or package.xml; None without one.
    """

    module: str = ""
    base: str = ""
    package: str | None = None


class StartMethod(NamedTuple):
    """How a file is started.

    Attributes:
        way: `script` for `python3 FILE`, `module` for `python3 -m MODULE`, `main` to import the module and call its
            main(), `entry_point` to call the function that setup.py names.
        module: Dotted name; empty for a script.
        function: The function to call; empty if there is none.
        base: As in `PackageLayout`.
    """

    way: str
    module: str = ""
    function: str = ""
    base: str = ""


def parse(path: str) -> ast.Module:
    """Parse a file as the interpreter would; raises what it cannot compile as an error with a line."""
    with open(path, "rb") as source:
        return parsed(source.read(), path)


def parsed(text: bytes, path: str = "file") -> ast.Module:
    """Parse the text of a file, as `parse` does."""
    before, null, _ = text.partition(b"\0")
    if null:  # Python's own error has no line number
        raise SyntaxError("source code cannot contain null bytes", (path, before.count(b"\n") + 1, None, None))
    return ast.parse(text, path)


def layout_of(root: str, file: str, *, installed: bool = False) -> PackageLayout:
    """Find the package of a file: by an `__init__.py` in its folder, or a setup.py or package.xml above.

    Args:
        root: The submission's folder.
        file: The file, relative to `root`.
        installed: Whether it is installed as it is and run as a script, wherever it is in its package.
    """
    folder = os.path.dirname(file)
    above = [folder]
    while above[-1]:
        above.append(os.path.dirname(above[-1]))
    package = next((f for f in above if any(_is_file(root, f, marker) for marker in MARKERS)), None)
    inside = [f for f in above if _is_file(root, f, "__init__.py")]
    chain = above[: next((n for n, f in enumerate(above) if f not in inside), len(above))]
    stem = os.path.splitext(os.path.basename(file))[0]
    if not chain and package is None:
        return PackageLayout()
    if installed and package is not None:
        return PackageLayout(package=package)
    if not chain and package is not None and _is_file(root, package, CMAKE) and not _is_file(root, package, "setup.py"):
        return PackageLayout(package=package)
    if not chain and package is not None:
        below = os.path.relpath(folder, package) if folder != package else ""
        names, base = [part for part in below.split("/") if part], os.path.join(root, package)
    else:
        names = [os.path.basename(f) or NAMELESS for f in reversed(chain)]
        base = "" if chain[-1] == "" else os.path.join(root, os.path.dirname(chain[-1]))
    names.append(stem)
    return (
        PackageLayout()
        if any("." in name for name in names)
        else PackageLayout(".".join(names), base.rstrip("/"), package)
    )


def _is_file(root: str, folder: str, name: str) -> bool:
    return os.path.isfile(os.path.join(root, folder, name))


def package_folders(root: str) -> list[str]:
    """Return the folders of all ROS packages in a submission, which can import each other once they are built."""
    found = []
    for number, (folder, _, files) in enumerate(walk_folders(root)):
        if number >= FOLDERS:
            break
        found += [folder] if any(marker in files for marker in MARKERS) else []
    return found


def import_folders(root: str, module: str, base: str) -> list[str]:
    """Return the folders of packages that a module of one can import from, with a module of its own package first.

    Of two packages with one name colcon builds one, and the one is meant whose file is named. Python would prefer
    another one that has an `__init__.py`, wherever that is in its path.

    Args:
        root: The submission's folder.
        module: The dotted name of the module that is run; empty for a script.
        base: The folder that this name is relative to; empty if that is above the submission.
    """
    top = module.partition(".")[0]
    folders = package_folders(root)
    if not top or not base:
        return folders
    others = (f"{top}.py", os.path.join(top, "__init__.py"))
    return [f for f in folders if f == base or not any(os.path.isfile(os.path.join(f, other)) for other in others)]


def walk_folders(root: str) -> Iterator[tuple[str, list[str], list[str]]]:
    """Yield the folders of a submission as `os.walk` does, in order, without those that a tool has made."""
    for folder, folders, files in os.walk(root):
        if folder != root and any(marker in files for marker in GENERATED):
            folders.clear()
            continue
        folders[:] = sorted(name for name in folders if name not in SKIPPED and not name.startswith("."))
        yield folder, folders, files


def start_of(  # noqa: PLR0913  what is known of a file
    root: str,
    file: str,
    layout: PackageLayout,
    offers_main: bool,
    executable: str = "",
    scripts: Sequence[Sequence[str]] = (),
) -> StartMethod:
    """Decide how a file is started.

    Args:
        root: The submission's folder.
        file: The file, relative to `root`.
        layout: Its place in the package.
        offers_main: What `offers_main` says of it.
        executable: Name of the console script to prefer; empty for one with the name of the file.
        scripts: Name, module and function of each console script of its package.
    """
    if not layout.module:
        return StartMethod(SCRIPT)
    if layout.package is not None:
        found = _entry_point(root, file, layout, executable, scripts)
        if found is not None:
            return found
    way = MAIN if offers_main else MODULE
    return StartMethod(way, layout.module, "main" if way == MAIN else "", layout.base)


def _entry_point(
    root: str, file: str, layout: PackageLayout, executable: str, scripts: Sequence[Sequence[str]]
) -> StartMethod | None:
    """Return the console script that runs a file, preferring the named one, or else one with the name of the file."""
    folder = os.path.join(root, layout.package or "")
    has_init = _is_file(root, os.path.dirname(file), "__init__.py")
    found = []
    for name, module, function in scripts:
        path = f"/{module.replace('.', '/')}.py"
        base = os.path.join(root, file).removesuffix(path)
        inside = base == folder.rstrip("/") or base.startswith(os.path.join(folder, ""))
        # without an __init__.py the package name comes from setup.py; with one, the names must agree
        if module == layout.module or (not has_init and base + path == os.path.join(root, file) and inside):
            base = layout.base if module == layout.module else base
            found.append(
                (name == (executable or module.rpartition(".")[2]), StartMethod(ENTRY_POINT, module, function, base))
            )
    return max(found, key=lambda pair: pair[0], default=(False, None))[1]


def offers_main(tree: ast.Module) -> bool:
    """Return whether a module can be started by `main()`: it needs no arguments, and nothing else starts the module."""
    main = next((s for s in _top_level(tree.body) if _defines_main(s)), None)
    if main is None or (isinstance(main, ast.FunctionDef) and _must_be_given(main.args)):
        return False
    guards = [s for s in _top_level(tree.body) if is_guard(s)]
    guarded = {*guards}
    others = [s for s in tree.body if not never_true(s) and guarded.isdisjoint(ast.walk(s))]
    return not calls(others, "main") and (not guards or calls(guards, "main"))


def _top_level(statements: Sequence[ast.stmt]) -> Iterator[ast.stmt]:
    """Yield the statements that may run when a module is imported, including those in `if` and `try`."""
    waiting = [*reversed(statements)]
    while waiting:  # a long `elif` is as deep as it is long
        statement = waiting.pop()
        yield statement
        if isinstance(statement, (ast.If, ast.Try)):
            inner = (*statement.body, *statement.orelse, *getattr(statement, "finalbody", ()))
            waiting += reversed(inner)


def _defines_main(statement: ast.stmt) -> bool:
    if isinstance(statement, ast.ImportFrom):
        return any((alias.asname or alias.name) == "main" for alias in statement.names)
    if isinstance(statement, ast.Assign):
        made = isinstance(statement.value, (ast.Name, ast.Lambda))
        return made and any(isinstance(target, ast.Name) and target.id == "main" for target in statement.targets)
    return isinstance(statement, ast.FunctionDef) and statement.name == "main"


def _must_be_given(arguments: ast.arguments) -> bool:
    positional = len(arguments.posonlyargs) + len(arguments.args) - len(arguments.defaults)
    return positional > 0 or any(default is None for default in arguments.kw_defaults)


def is_guard(statement: ast.stmt) -> bool:
    """Return whether a statement is `if __name__ == "__main__":`, with the operands in either order."""
    if not isinstance(statement, ast.If) or not isinstance(statement.test, ast.Compare):
        return False
    test = statement.test
    names = {node.id for node in ast.walk(test) if isinstance(node, ast.Name)}
    texts = {node.value for node in ast.walk(test) if isinstance(node, ast.Constant)}
    return "__name__" in names and "__main__" in texts and not isinstance(test.ops[0], ast.NotEq)


def never_true(statement: ast.stmt) -> bool:
    """Return whether a statement is a guard on `__name__` that is never true, such as a misspelt one."""
    if not isinstance(statement, ast.If) or not isinstance(statement.test, ast.Compare):
        return False
    names = {node.id for node in ast.walk(statement.test) if isinstance(node, ast.Name)}
    texts = {node.value for node in ast.walk(statement.test) if isinstance(node, ast.Constant)}
    return "__name__" in texts or ("__name__" in names and "__main__" not in texts)


def calls(statements: Sequence[ast.stmt], name: str) -> bool:
    """Return whether some statements call a name when they run, outside of functions and classes."""
    return any(
        isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == name
        for statement in statements
        if not isinstance(statement, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef))
        for node in ast.walk(statement)
    )
