"""How a file is started without the host: as its author would."""

from __future__ import annotations

import ast
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from grader.runtime.plan import PlannedStart
from grader.runtime.programs.beginning import beginning_of
from grader.runtime.programs.inert import read_inert
from grader.runtime.worker import bare_start

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


def bare_arguments(root: Path, seen: str, file: str, given: PlannedStart | None = None) -> tuple[str, ...]:
    """How a file is started of which the contained process has read what it begins."""
    tree = read_inert((root / file).read_bytes())
    begins = beginning_of(tree) if isinstance(tree, ast.Module) else None
    return bare_start.bare_arguments(root, seen, file, begins, given)


@pytest.mark.parametrize("text", SCRIPTS.values(), ids=SCRIPTS)
def test_a_file_that_starts_something_is_a_script(tmp_path: Path, text: str) -> None:
    """`python3 FILE`, and nothing else on the command line."""
    (tmp_path / "a.py").write_text(text)
    assert bare_arguments(tmp_path, "/s", "a.py") == ("-u", "/s/a.py")


def ran(root: Path, file: str, given: PlannedStart | None = None) -> str:
    """Run a file as it would be started in a place of its own; return what it printed."""
    command = [sys.executable, *bare_arguments(root, str(root), file, given)]
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


GIVEN = PlannedStart(
    "a.py",
    arguments=("hello",),
    ros_arguments=("-r", "__node:=lidar", "-p", 'word:="5"'),
    parameter_files=(("own.yaml", "/**: {ros__parameters: {rate: 2.0}}"),),
)
SAYS = "import sys\nprint(sys.argv[1:-1], open(sys.argv[-1]).read())\n"


@pytest.mark.parametrize("text", [SAYS, f"def main():\n    {SAYS.replace(chr(10), chr(10) + '    ')}"])
def test_a_program_gets_its_arguments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    """In the order of `ros2 run`; parameter files are written where the program can read them."""
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "a.py").write_text(text)
    given = ["hello", "--ros-args", "-r", "__node:=lidar", "-p", 'word:="5"', "--params-file"]
    assert ran(tmp_path, "a.py", GIVEN) == f"{given} {GIVEN.parameter_files[0][1]}"
    without = ran(tmp_path, "a.py", replace(GIVEN, ros_arguments=()))
    assert without == f"{['hello', '--ros-args', '--params-file']} {GIVEN.parameter_files[0][1]}"


@pytest.mark.parametrize(
    ("name", "copied"),
    [
        *((name, name) for name in ("own.yaml", "2-wheels.sim.yml")),
        *(
            (name, "parameters.yaml")
            for name in ("", "..", "../x.yaml", "{a: 1.5}", "a\nb.yaml", "ä.yaml", "no_ending")
        ),
        ("x" * 300 + ".yaml", "parameters.yaml"),
    ],
)
def test_a_parameter_file_keeps_a_plain_name(name: str, copied: str) -> None:
    """No other name comes to a path: those of launch files are the student's, and may be anything."""
    assert PlannedStart("a.py", parameter_files=((name, "text"),)).copied_files == ((copied, "text"),)


def test_arguments_keep_a_script_a_script(tmp_path: Path) -> None:
    """Without parameter files nothing has to be written."""
    (tmp_path / "a.py").write_text(SAYS)
    plain = replace(GIVEN, parameter_files=())
    expected = ("-u", "/s/a.py", "hello", "--ros-args", "-r", "__node:=lidar", "-p", 'word:="5"')
    assert bare_arguments(tmp_path, "/s", "a.py", plain) == expected
