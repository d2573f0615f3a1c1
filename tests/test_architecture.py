"""What keeps judging pure and the host apart; `lint-imports` checks which package imports which (pyproject.toml)."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "grader"

#: What pure packages never touch: files, processes, clocks, chance.
IMPURE = {"os", "subprocess", "socket", "time", "datetime", "random", "threading", "pathlib", "tempfile", "rclpy"}
#: Modules in pure packages that are not pure: a path is a value in some, others deliver what has been rendered or read
#: what a platform says in the environment.
EXCUSED = {
    "model/submission.py": {"pathlib"},
    "reports/delivery.py": IMPURE,
    "reports/destination.py": IMPURE,
    "reports/formats.py": {"os"},
    "reports/surroundings.py": {"os", "pathlib", "datetime"},
    "reports/github.py": {"pathlib"},
    "reports/junit.py": {"pathlib"},
    "reports/json_report.py": {"pathlib"},
}
#: What the host may import besides the standard library and its own modules.
HOST_MAY_IMPORT = {"rclpy", "time_machine", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs", "std_srvs"}


def imports_of(path):
    """Yield the absolute module names that a file imports, wherever in it; relative ones begin with a dot."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")


#: Packages that are pure.
PURE = ("model", "judging", "reports", "selftest/mutating")


def impurities(package):
    """Return every import in a pure package of what touches the world, as sentences."""
    paths = sorted(path for pure in PURE for path in (package / pure).rglob("*.py"))
    found = []
    for path in paths:
        name = path.relative_to(package).as_posix()
        touched = {imported.split(".")[0] for imported in imports_of(path)} & IMPURE
        found += [f"{name} imports {module}" for module in sorted(touched - EXCUSED.get(name, set()))]
    return found


def test_judging_and_rendering_are_pure():
    """They read neither files nor clocks, start nothing and roll no dice; delivery alone writes files."""
    assert impurities(PACKAGE) == []


def test_a_planted_impurity_is_found(tmp_path):
    """Also inside a function, and under another name."""
    planted = {
        "judging/checks/bad.py": "def f():\n    from time import sleep as rest\n",
        "model/bad.py": "import os.path as p, random\n",
        "reports/bad.py": "import datetime\n",
        "reports/delivery.py": "import tempfile\n",
    }
    for name, source in planted.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(source)
    assert impurities(tmp_path) == [
        "judging/checks/bad.py imports time",
        "model/bad.py imports os",
        "model/bad.py imports random",
        "reports/bad.py imports datetime",
    ]


def host_needs(package):
    """Return what the host imports beyond the standard library, ROS and itself, as sentences."""
    return [
        f"{path.name} imports {imported}"
        for path in sorted((package / "host").rglob("*.py"))
        for imported in imports_of(path)
        if not imported.startswith(".") or imported.startswith("..")
        if imported.split(".")[0] not in HOST_MAY_IMPORT | sys.stdlib_module_names
    ]


def test_the_host_needs_little():
    """The host is the standard library, rclpy and its messages: it runs where nothing else is readable."""
    assert host_needs(PACKAGE) == []


def test_a_planted_need_is_found(tmp_path):
    """Other libraries, the rest of the grader, and what lies above the host's folder."""
    (tmp_path / "host").mkdir()
    source = "import os, numpy\nimport rclpy.node\nfrom . import fine\nfrom .fine import a\n"
    (tmp_path / "host" / "bad.py").write_text(source + "from ..model import trace\nimport grader\n")
    assert host_needs(tmp_path) == ["bad.py imports numpy", "bad.py imports ..model", "bad.py imports grader"]


def test_every_module_says_what_it_holds():
    """One sentence at the top of every file."""
    for path in sorted(PACKAGE.rglob("*.py")):
        assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))), path


#: Places on one person's machine; what students hand in may name any.
AT_HOME = re.compile(r"(?<![\w.}])(/home/(?!log\b)\w|/root/|/Users/\w|[A-Z]:\\\\)")


def names_a_home(text):
    """Return whether a text names a place that only one machine has."""
    return AT_HOME.search(text) is not None


def test_no_file_names_a_place_on_one_machine():
    """What is in the repository works anywhere, or it is not told where."""
    listed = subprocess.run(
        ["git", "ls-files", "*.py", "*.md", "*.toml", "*.yaml", "*.yml", "*.xml"],
        cwd=PACKAGE.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    if listed.returncode != 0:
        pytest.skip("this is no checkout")
    names = [name for name in listed.stdout.splitlines() if not name.startswith("tests/submissions/")]
    texts = {name: (PACKAGE.parent / name) for name in names if name != "tests/test_architecture.py"}
    assert [n for n, p in texts.items() if p.exists() and names_a_home(p.read_text(encoding="utf-8"))] == []


@pytest.mark.parametrize("place", ["/home/ada/x", "see /root/x", "'/Users/ada'", r"C:\\x"])
def test_a_place_on_one_machine_is_recognised(place):
    """The rule can fail."""
    assert names_a_home(place)


@pytest.mark.parametrize(
    "place", ["/tmp/home/log", "~/x", "https://a.b/home/x", "$HOME/x", "a/root/b", "/proc/{pid}/root/tmp"]
)
def test_places_that_every_machine_has_are_none(place):
    """Neither are paths inside a sandbox."""
    assert not names_a_home(place)
