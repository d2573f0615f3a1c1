"""How a file is started without the host: as its author would."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from grader.execution import bare_start
from grader.execution.bare_start import bare_arguments

NODE = "from rclpy.node import Node\nclass Talker(Node): pass\n"
SCRIPTS = {
    "a guard": "def main(): pass\nif __name__ == '__main__':\n    main()",
    "a call": "def main(): pass\nmain()",
    "another function": "def main(): pass\ndef run(): main()\nif __name__ == '__main__':\n    run()",
    "no main": "x = 1\nfor n in range(3):\n    print(n)",
    "two nodes": NODE + "class Other(Node): pass\n",
    "no Python": "def f(:",
}
HELPED = {
    "nothing calls main": "import sys\nsys.path.insert(0, 'x')\ndef main(): print('main')",
    "a misspelt guard": "def main(): print('main')\nif __name__ == 'main':\n    main()",
}


@pytest.mark.parametrize("text", SCRIPTS.values(), ids=SCRIPTS)
def test_a_file_that_starts_something_is_a_script(tmp_path: Path, text: str) -> None:
    """`python3 FILE`, and nothing else on the command line."""
    (tmp_path / "a.py").write_text(text)
    assert bare_arguments(tmp_path, "/s", "a.py") == ("-u", "/s/a.py")


def ran(root: Path, file: str) -> str:
    """Run a file as it would be started in a place of its own; return what it printed."""
    command = [sys.executable, *bare_arguments(root, str(root), file)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd="/").stdout.strip()


@pytest.mark.parametrize("text", HELPED.values(), ids=HELPED)
def test_a_file_that_starts_nothing_is_helped_to_its_main(tmp_path: Path, text: str) -> None:
    """As in virtual time."""
    (tmp_path / "a.py").write_text(text)
    assert ran(tmp_path, "a.py") == "main"


def test_the_only_node_is_spun(tmp_path: Path) -> None:
    """Where there is no main()."""
    (tmp_path / "a.py").write_text(NODE)
    assert "rclpy.spin(importlib.import_module('a').Talker())" in bare_arguments(tmp_path, "/s", "a.py")[2]


def test_a_file_in_a_package_is_run_as_its_module(tmp_path: Path) -> None:
    """Relative imports work, and its folder is the first place that modules are looked for in."""
    package = tmp_path / "src" / "robot"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "part.py").write_text("WORD = 'part'\n")
    (package / "a.py").write_text("from .part import WORD\ndef main(): print(WORD, __name__)\n")
    (package / "b.py").write_text("from .part import WORD\nprint(WORD, __name__)\n")
    assert ran(tmp_path, "src/robot/a.py") == "part robot.a"
    assert ran(tmp_path, "src/robot/b.py") == "part __main__"


def test_interfaces_that_are_not_installed_can_be_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tutorials import them without using them; the host stands in for them as well."""
    monkeypatch.setattr(bare_start, "find_spec", lambda name: None)
    (tmp_path / "a.py").write_text("from example_interfaces.srv import AddTwoInts\nprint(AddTwoInts.__name__)\n")
    assert ran(tmp_path, "a.py") == "AddTwoInts"
