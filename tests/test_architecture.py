"""The rooms of the grader and who may import whom; the facts that keep judging pure and the host apart."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "grader"

#: Room -> rooms it may import. Entries are at the top, the vocabulary at the bottom.
MAY_IMPORT = {
    "entry": {"entry", "reports", "recording", "judging", "reading", "model"},
    "reports": {"reports", "model"},
    "recording": {"recording", "model"},
    "reading": {"reading", "judging", "model"},
    "judging": {"judging", "model"},
    "model": {"model"},
    "host": set(),
}
#: What pure rooms never touch: files, processes, clocks, chance.
IMPURE = {"os", "subprocess", "socket", "time", "datetime", "random", "threading", "pathlib", "tempfile", "rclpy"}
#: The only modules of the grader's own processes that may know rclpy.
KNOWS_ROS = {"recording/observer.py"}
#: What the host may import besides the standard library and its own modules.
HOST_MAY_IMPORT = {"rclpy", "time_machine", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs", "std_srvs"}


def room_of(path, package):
    """Return the room a module lies in; modules at the top are entries."""
    parts = path.relative_to(package).parts
    return parts[0] if len(parts) > 1 else "entry"


def imports_of(path):
    """Yield the absolute module names that a file imports, wherever in it; relative ones begin with a dot."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")


def violations(package):
    """Return every import that points up or sideways, as sentences."""
    found = []
    for path in sorted(package.rglob("*.py")):
        room, name = room_of(path, package), path.relative_to(package).as_posix()
        if name == "__init__.py":
            continue
        for imported in imports_of(path):
            parts = imported.split(".")
            if room == "host" and parts[0] == "grader":
                found.append(f"{name} imports {imported}: the host imports nothing of grader")
            elif parts[0] == "grader" and len(parts) > 1:
                target = parts[1] if (package / parts[1]).is_dir() else "entry"
                if target not in MAY_IMPORT[room]:
                    found.append(f"{name} imports {imported}: {room} may not import {target}")
            elif parts[0] == "rclpy" and room != "host" and name not in KNOWS_ROS:
                found.append(f"{name} imports {imported}: only the observer and the host know rclpy")
    return found


def test_imports_point_down_only():
    """Entries, then reports and recording, then reading, judging and the model: never the other way."""
    assert violations(PACKAGE) == []


def test_a_planted_violation_is_found(tmp_path):
    """The rule can fail."""
    for folder in ("judging", "recording", "host", "model"):
        (tmp_path / folder).mkdir()
    (tmp_path / "judging" / "bad.py").write_text("from grader.recording import worker\n")
    (tmp_path / "host" / "bad.py").write_text("def f():\n    import grader.model.trace\n")
    (tmp_path / "model" / "bad.py").write_text("import rclpy.node\n")
    assert [v.split(":")[0] for v in violations(tmp_path)] == [
        "host/bad.py imports grader.model.trace",
        "judging/bad.py imports grader.recording",
        "model/bad.py imports rclpy.node",
    ]


@pytest.mark.parametrize("room", ["judging", "model"])
def test_judging_is_pure(room):
    """What judges reads neither files nor clocks, starts nothing and rolls no dice."""
    allowed = {"model/submission.py": {"pathlib"}}  # a path is a value there, never followed
    for path in sorted((PACKAGE / room).rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        touched = {imported.split(".")[0] for imported in imports_of(path)} & IMPURE
        assert touched <= allowed.get(name, set()), name


def test_rendering_is_pure():
    """What renders touches nothing either; only delivery and its destinations write files."""
    writers = {"reports/delivery.py", "reports/destination.py", "reports/json_report.py"}
    for path in sorted((PACKAGE / "reports").rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if name not in writers:
            assert not {imported.split(".")[0] for imported in imports_of(path)} & IMPURE, name


def test_the_host_needs_little():
    """The host is the standard library, rclpy and its messages: it runs where nothing else is readable."""
    import sys

    for path in sorted((PACKAGE / "host").rglob("*.py")):
        for imported in imports_of(path):
            top = imported.split(".")[0]
            fine = imported.startswith(".") or top in HOST_MAY_IMPORT or top in sys.stdlib_module_names
            assert fine, f"{path.name} imports {imported}"


def test_every_module_says_what_it_holds():
    """One sentence at the top of every file."""
    for path in sorted(PACKAGE.rglob("*.py")):
        assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))), path
