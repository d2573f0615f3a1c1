"""How a student's file is started: as a script, as a module of its package, or through what it defines."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from places import ROOT
from staging_programs import play_file


@pytest.fixture
def run(tmp_path: Path) -> Callable[..., Any]:
    """Write files into a submission, run one of them and return what it said."""

    def write_and_run(files: Mapping[str, Any], file: str = "node.py") -> list[str]:
        root = tmp_path / "submission"
        for name, content in files.items():
            path = root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return [line.partition(" ")[2] for line in play_file(root, file)[:-1]]

    def run_one(files: Mapping[str, Any], file: str = "node.py") -> list[str]:
        started, *said = write_and_run(files, file) or [""]
        hides = re.search(r"\['(.*)'\]$", started)
        known = started.startswith("started")
        return [*([f"module_hidden: {hides[1]}"] if hides else []), *([] if known else [started]), *said]

    return run_one


@pytest.fixture
def start(run: Any) -> Callable[..., Any]:
    """Write files into a submission, run one of them and return how it was started and what it said."""
    write_and_run = run.__closure__[0].cell_contents

    def start_one(files: Mapping[str, Any], file: str) -> tuple[str, list[str]]:
        started, *said = write_and_run(files, file)
        return started.removeprefix("started: "), said

    return start_one


MAIN = "def main():\n    say('main ran')\n"
UNCALLED = "main_not_called"
NODE = "import rclpy\nfrom rclpy.node import Node\nclass Blinker(Node):\n    pass\n"


def test_a_guard_is_respected(run: Callable[..., Any]) -> None:
    """The file runs under its own name, as `python3 node.py` would have it, once."""
    assert run({"node.py": f"{MAIN}if __name__ == '__main__':\n    main()\n"}) == ["main ran"]


def test_a_file_without_a_guard_is_run_and_told_so(run: Callable[..., Any]) -> None:
    """Console scripts call main from elsewhere; the note says what `python3` would do."""
    assert run({"node.py": MAIN}) == [UNCALLED, "main ran"]


@pytest.mark.parametrize(
    "guard",
    [
        "if __name__ == 'main':\n    main()\n",
        "if __name__ == '__main__ ':\n    main()\n",
        "if __name__ != '__main__' and False:\n    pass\n",
        "if '__name__' == '__main__':\n    main()\n",
    ],
)
def test_a_misspelt_guard_is_run_and_told_so(run: Callable[..., Any], guard: str) -> None:
    """What was meant is graded; that it does not work alone is said."""
    assert run({"node.py": MAIN + guard}) == [UNCALLED, "main ran"]


@pytest.mark.parametrize(
    "call",
    [
        "main()\n",
        "if __name__ == '__main__':\n    try:\n        main()\n    except KeyboardInterrupt:\n        pass\n",
        "try:\n    if __name__ == '__main__':\n        main()\nfinally:\n    say('finally')\n",
        "if '__main__' == __name__:\n    main()\n",
        "if __name__ in ('__main__', 'node'): main()\n",
        "import sys\nsys.exit(main())\n",
        "start = main\nstart()\nmain if start else main()\n",
    ],
)
def test_main_is_called_once_however_it_is_called(run: Callable[..., Any], call: str) -> None:
    """A second run would publish everything twice."""
    assert run({"node.py": MAIN + call}).count("main ran") == 1


def test_a_main_that_raised_inside_its_guard_is_not_run_again(run: Callable[..., Any]) -> None:
    """The exception is the file's own."""
    said = run(
        {"node.py": "def main():\n    say('main ran')\n    raise OSError('x')\nif __name__ == '__main__': main()\n"}
    )
    assert said == ["main ran", "raised OSError: x"]


def test_a_lone_node_class_is_spun_and_told_so(run: Callable[..., Any]) -> None:
    """Nobody makes the node: the host does, since everything that is graded is there."""
    assert run({"node.py": NODE}) == ["class_not_started: Blinker", "init", "spin Blinker"]


@pytest.mark.parametrize(
    "ending",
    [
        "class Other(Node):\n    pass\n",
        "def main():\n    pass\nmain()\n",
        "blinker = Blinker()\n",
        "main = None\n",
    ],
)
def test_nothing_is_guessed_where_it_is_not_plain(run: Callable[..., Any], ending: str) -> None:
    """Two classes, a main that did nothing, or a node that was made: the file has had its say."""
    assert run({"node.py": NODE + ending}) == []


def test_a_class_that_needs_arguments_is_not_spun(run: Callable[..., Any]) -> None:
    """It is for other modules to use; the note says that nothing starts it."""
    needy = NODE.replace("class Blinker(Node):", "class Blinker(Node):\n    def __init__(self, name): pass\n", 1)
    assert run({"node.py": needy}) == ["class_not_started: Blinker"]


def test_a_class_of_another_file_is_not_the_files_own(run: Callable[..., Any]) -> None:
    """An imported node class does not start by itself."""
    assert run({"node.py": "from other import Blinker\n", "other.py": NODE}) == []


def test_helper_modules_are_found_beside_the_file(run: Callable[..., Any]) -> None:
    """As `python3` finds them, wherever the file lies in the submission."""
    files = {"src/deep/node.py": "import helper\nsay(helper.WORD)\n", "src/deep/helper.py": "WORD = 'found'\n"}
    assert run(files, "src/deep/node.py") == ["found"]


PACKAGE = {
    "src/robot/robot/__init__.py": "",
    "src/robot/robot/words.py": "WORD = 'found'\n",
    "src/robot/robot/sub/__init__.py": "",
}
SETUP = "from setuptools import setup\nname = 'robot'\nsetup(name=name, entry_points={'console_scripts': [%s]})\n"


def setup_py(*scripts: str) -> dict[str, str]:
    """Return a setup.py with some console scripts, as expressions."""
    return {"src/robot/setup.py": SETUP % ", ".join(scripts), "src/robot/package.xml": "<package/>"}


@pytest.mark.parametrize(
    ("code", "started", "said"),
    [
        ("from robot.words import WORD\nsay(WORD)\n", "module, robot.node", ["found"]),
        (
            "from .words import WORD\nfrom . import words\nsay(WORD)\nsay(__name__)\n",
            "module, robot.node",
            ["found", "__main__"],
        ),
        (
            "from .words import WORD\ndef main():\n    say(WORD)\n    say(__name__)\n",
            "main, robot.node, main",
            ["found", "robot.node"],
        ),
        (
            f"from . import words\n{MAIN}if __name__ == '__main__':\n    main()\n",
            "main, robot.node, main",
            ["main ran"],
        ),
        (
            f"from . import words\n{MAIN.replace('main()', 'run()')}main = run\n",
            "main, robot.node, main",
            ["main ran"],
        ),
        (f"{MAIN}if __name__ == '_main_':\n    main()\n", "main, robot.node, main", ["main ran"]),
        (f"{MAIN}main()\n", "module, robot.node", ["main ran"]),
        ("from . import words\nif __name__ == '__main__':\n    say('guarded')\n", "module, robot.node", ["guarded"]),
        (
            f"{MAIN}if __name__ == '__main__':\n    say('its own')\n",
            "module, robot.node",
            ["its own", "main_not_called", "main ran"],
        ),
        (
            "def main(node):\n    say(node)\nif __name__ == '__main__':\n    main('given')\n",
            "module, robot.node",
            ["given"],
        ),
        (
            "import asyncio\nasync def main():\n    say('awaited')\n"
            "if __name__ == '__main__':\n    asyncio.run(main())\n",
            "module, robot.node",
            ["awaited"],
        ),
        ("import robot.words\nsay(robot.words.WORD)\n", "module, robot.node", ["found"]),
    ],
)
def test_a_file_in_a_package_is_run_as_a_part_of_it(
    start: Callable[..., Any], code: str, started: str, said: Sequence[str]
) -> None:
    """Relative imports work, main() is called once whether or not there is a guard, and a script body runs."""
    assert start({**PACKAGE, "src/robot/robot/node.py": code}, "src/robot/robot/node.py") == (started, said)


def test_a_file_deep_in_a_package_knows_its_parents(start: Callable[..., Any]) -> None:
    """Packages within packages are parts of one name."""
    files = {**PACKAGE, "src/robot/robot/sub/node.py": "from ..words import WORD\ndef main():\n    say(WORD)\n"}
    assert start(files, "src/robot/robot/sub/node.py") == ("main, robot.sub.node, main", ["found"])


NODES = {
    **PACKAGE,
    "src/robot/robot/node.py": (
        "import sys\nfrom .words import WORD\ndef go():\n    say('go')\n    return 3\n"
        f"{MAIN}if __name__ == '__main__':\n    main()\n"
    ),
}


@pytest.mark.parametrize(
    "scripts",
    [
        ["'node = robot.node:go'"],
        ["'other = robot.other:main'", "'node = robot.node:go'"],
        ["'x = robot.node:main'", "'node = robot.node:go'"],
        ["name + '_node=' + name + '.node:go'"],
        ["f'node = {name}.node:go'"],
        ["'node = {}.node:go'.format(name)", "unknown"],
        ["'node = %s.node:go' % name"],
    ],
)
def test_an_entry_point_of_setup_py_is_called(start: Callable[..., Any], scripts: Sequence[str]) -> None:
    """However setup.py puts the text together, which is never run; the function's result is the exit code."""
    files = {**NODES, **setup_py(*scripts)}
    files["src/robot/setup.py"] += "raise SystemExit('setup.py was run')\n"
    assert start(files, "src/robot/robot/node.py") == ("entry_point, robot.node, go", ["go", "exit 3"])


@pytest.mark.parametrize(
    "files",
    [
        {"src/robot/setup.cfg": "[options.entry_points]\nconsole_scripts =\n  a = robot.a:b\n  node = robot.node:go\n"},
        {"src/robot/setup.py": "import x\nx.setup(entry_points='[console_scripts]\\nnode=robot.node:go')\n"},
        {"src/robot/setup.py": "S = ['node=robot.node:go']\nE = {'console_scripts': S}\nsetup(entry_points=E)\n"},
    ],
)
def test_entry_points_may_stand_elsewhere(start: Callable[..., Any], files: Mapping[str, str]) -> None:
    """In setup.cfg, in one text, in variables."""
    found = start({**NODES, **setup_py(), **files}, "src/robot/robot/node.py")
    assert found == ("entry_point, robot.node, go", ["go", "exit 3"])


@pytest.mark.breadth(5, 18)
@pytest.mark.parametrize(
    "code",
    [
        "nodes = ['other', 'node']\nE = {'console_scripts': [f'{n} = robot.{n}:go' for n in nodes]}",
        "S = {'node': 'go', 'a': 'b'}\nE = dict(console_scripts=[f'{n}=robot.{n}:{f}' for n, f in S.items()])",
        "S = []\nfor n in ('a', 'node'):\n    S.append('='.join([n, f'robot.{n}:go']))\nE = {'console_scripts': S}",
        "S = ['a = robot.a:b']\nS += ['node = robot.node:go']\nE = {}\nE['console_scripts'] = S",
        "a, b = 'node', 'robot'\nmore: list = [f'{a} = {b}.{a}:go']\nE = {'console_scripts': [*more, 'x = y:z']}",
        "K = {'console_scripts': ['node = {p}.{n}:go'.format(p='robot', **{'n': 'node'})]}\nE = {**K, 'x': glob('*')}",
    ],
)
@pytest.mark.parametrize(
    "end",
    [
        "setup(entry_points=E)",
        "A = dict(entry_points=E)\nsetup(**A)",
        "def run(E=E):\n    setup(entry_points=E)\nrun()",
    ],
)
def test_entry_points_may_be_put_together(start: Callable[..., Any], code: str, end: str) -> None:
    """By loops, comprehensions and variables."""
    files = {**NODES, **setup_py(), "src/robot/setup.py": f"from setuptools import setup\n{code}\n{end}\n"}
    found = start(files, "src/robot/robot/node.py")
    assert found == ("entry_point, robot.node, go", ["go", "exit 3"])


@pytest.mark.parametrize(
    "files",
    [
        setup_py(),
        setup_py("'node = robot.other:main'"),
        setup_py("5", "'node'", "'node = robot.node'", "'node = robot.node:'", "x()"),
        {"src/robot/setup.py": "setup(\n"},
        {"src/robot/setup.py": "setup(entry_points={'console_scripts': " + "[" * 150 + "]" * 150 + "})\n"},
        {"src/robot/setup.py": b"\0\xff"},
        {"src/robot/setup.py": "a = [1]\nfor b in a:\n    a.append(a)\n    for c in a:\n        a += a\nsetup(a=a)\n"},
        {"src/robot/setup.py": "a = ['x'] + ['y'] * 3\nsetup(entry_points={'console_scripts': sorted([1, 'a'])})\n"},
        {"src/robot/setup.py": "a = 'x' * 9\n" + "a = a + a\n" * 60 + "setup(entry_points=a)\n"},
        {"src/robot/package.xml": "<package/>", "src/robot/setup.cfg": "[[["},
        {"src/robot/setup.cfg": b"\xff\xfe"},
    ],
)
def test_without_an_entry_point_main_is_called(start: Callable[..., Any], files: Mapping[str, Any]) -> None:
    """A setup.py that names none for the file, or that nobody can read."""
    found = start({**NODES, **files}, "src/robot/robot/node.py")
    assert found == ("main, robot.node, main", ["main ran"])


def test_a_package_without_init_is_what_setup_py_says(start: Callable[..., Any]) -> None:
    """Its author forgot the file, or uses a namespace; `ros2 run` finds it all the same."""
    files = {name: code for name, code in NODES.items() if "__init__" not in name}
    found = start({**files, **setup_py("'node = robot.node:go'")}, "src/robot/robot/node.py")
    assert found == ("entry_point, robot.node, go", ["go", "exit 3"])
    assert start(setup_py(), "src/robot/robot/node.py") == ("main, robot.node, main", ["main ran"])


def test_a_program_of_a_cmake_package_is_a_script(start: Callable[..., Any]) -> None:
    """It is installed as it is, beside others, and sees the Python packages that are built."""
    built = {"robot/package.xml": "", "robot/CMakeLists.txt": "", "robot/robot/__init__.py": ""}
    files = {
        **built,
        "robot/scripts/node.py": f"import helper\nfrom robot.words import WORD\nsay(WORD)\n{MAIN}main()\n",
        "robot/scripts/helper.py": "",
        "robot/robot/words.py": "WORD = 'found'\n",
    }
    assert start(files, "robot/scripts/node.py") == ("script", ["found", "main ran"])
    assert start({**built, "robot/robot/node.py": MAIN}, "robot/robot/node.py") == (
        "main, robot.node, main",
        ["main ran"],
    )


@pytest.mark.parametrize("marker", ["setup.py", "package.xml"])
def test_a_file_beside_setup_py_or_package_xml_is_a_module(start: Callable[..., Any], marker: str) -> None:
    """No package holds it, but `ros2 run` would call its main."""
    assert start({marker: "", "node.py": MAIN}, "node.py") == ("main, node, main", ["main ran"])


def test_packages_of_a_submission_see_each_other(start: Callable[..., Any]) -> None:
    """They are built together."""
    files = {
        **PACKAGE,
        **setup_py(),
        "src/drive/package.xml": "",
        "src/drive/drive/__init__.py": "",
        "src/drive/drive/node.py": "from robot.words import WORD\ndef main():\n    say(WORD)\n",
    }
    assert start(files, "src/drive/drive/node.py") == ("main, drive.node, main", ["found"])


@pytest.mark.parametrize("own_init", [{}, {"b_second/my_pkg/__init__.py": ""}], ids=["without init", "with init"])
def test_the_package_of_the_file_that_is_named_runs(start: Callable[..., Any], own_init: Mapping[str, str]) -> None:
    """Not another one of its name, which Python would prefer for its `__init__.py`."""
    files = {"a_first/my_pkg/__init__.py": "", "a_first/my_pkg/talker.py": "here = 'first'\n", "a_first/setup.py": ""}
    files |= {"b_second/my_pkg/talker.py": "here = 'second'\n", "b_second/setup.py": "", "tools/setup.py": ""}
    files |= {"tools/tools/__init__.py": "", "tools/tools/more.py": "x = 1\n", **own_init}
    files["b_second/my_pkg/main.py"] = "from my_pkg.talker import here\nfrom tools.more import x\nsay(f'{here} {x}')\n"
    assert "second 1" in str(start(files, "b_second/my_pkg/main.py"))


def test_a_package_whose_own_folder_was_handed_in_has_no_name(start: Callable[..., Any]) -> None:
    """Its files know each other by relative imports."""
    files = {
        "__init__.py": "say('package')\n",
        "node.py": "from .words import WORD\ndef main():\n    say(WORD)\n",
        "words.py": "WORD = 'found'\n",
        "plain.py": "from . import words\nsay(words.WORD)\n",
    }
    assert start(files, "node.py") == ("main, submission.node, main", ["package", "found"])
    assert start(files, "plain.py") == ("module, submission.plain", ["package", "found"])


def test_a_plain_import_of_a_neighbour_is_mentioned(start: Callable[..., Any]) -> None:
    """`python3` finds it, so its author does too; `ros2 run` does not."""
    files = {**PACKAGE, "src/robot/robot/node.py": "import words\nimport os\ndef main():\n    say(words.WORD)\n"}
    found = start(files, "src/robot/robot/node.py")
    assert found == ("main, robot.node, main", ["neighbour_imported: words", "found"])


def test_a_package_with_the_name_of_a_module_is_found(start: Callable[..., Any]) -> None:
    """What was built comes first on the path."""
    files = {"src/random/random/__init__.py": "", "src/random/package.xml": "", "src/random/random/node.py": MAIN}
    found = start(files, "src/random/random/node.py")
    assert found == ("main, random.node, main, ['random']", ["main ran"])


def test_an_entry_point_that_is_not_there_fails(start: Callable[..., Any]) -> None:
    """As `ros2 run` does."""
    files = {**PACKAGE, **setup_py("'node = robot.node:missing'"), "src/robot/robot/node.py": MAIN}
    (said,) = start(files, "src/robot/robot/node.py")[1]
    assert said == "raised AttributeError: module 'robot.node' has no attribute 'missing'"


@pytest.mark.parametrize("ending", [MAIN, f"{MAIN}main()\n", "say('ran')\n"])
def test_a_relative_import_in_a_loose_file_fails(run: Callable[..., Any], ending: str) -> None:
    """As with `python3`: there is no package."""
    files = {"node.py": f"from .helper import WORD\n{ending}", "helper.py": "WORD = 'found'\n"}
    assert run(files) == ["raised ImportError: attempted relative import with no known parent package"]


PROBE = (
    "import inspect, os, sys\n"
    "def main():\n"
    "    say(sys.modules['__main__'].__name__)\n"
    "    say(inspect.getmodule(inspect.currentframe()).__name__)\n"
    "    say([os.path.basename(p) for p in sys.argv])\n"
)


@pytest.mark.parametrize("folder", ["", "robot/"])
def test_there_is_always_a_main_module(run: Callable[..., Any], folder: str) -> None:
    """The logger of rclpy looks it up, whoever calls main()."""
    files = {f"{folder}__init__.py": "", f"{folder}node.py": PROBE} if folder else {"node.py": PROBE}
    said = run(files, f"{folder}node.py")
    assert said[-3:] == ["__main__", "robot.node" if folder else "__main__", "['node.py']"]


def test_any_encoding_that_python_accepts(run: Callable[..., Any]) -> None:
    """A coding line, a byte order mark, CRLF, tabs, no newline at the end."""
    latin = "# -*- coding: latin-1 -*-\nsay('Grüße')\n".encode("latin-1")
    assert run({"node.py": latin}) == ["Grüße"]
    assert run({"node.py": b"\xef\xbb\xbf" + "say('Grüße')".encode()}) == ["Grüße"]
    assert run({"node.py": b"if True:\r\n\tsay('tab')\r\n"}) == ["tab"]
    assert run({"node.py": b"#!/usr/bin/env python3\n# coding: cp1252\nsay('\x80')"}) == ["€"]


@pytest.mark.parametrize(
    ("content", "kind"),
    [
        (b"def main(:\n", "SyntaxError"),
        (b"if True:\n\tpass\n        pass\n", "TabError"),
        (b"if True:\npass\n", "IndentationError"),
        ("say('ü')".encode("latin-1"), "SyntaxError"),
        (b"# coding: no-such-coding\n", "SyntaxError"),
        (b"say('a')\0", "SyntaxError"),
        (b"return 1\n", "SyntaxError"),
    ],
)
def test_a_file_that_is_not_python_is_not_run_at_all(run: Callable[..., Any], content: bytes, kind: str) -> None:
    """Nothing of it has happened when the error is found."""
    (said,) = run({"node.py": content})
    assert said.startswith(f"raised {kind}")


def test_a_null_byte_is_found_where_it_is(tmp_path: Path) -> None:
    """The report names the line, which Python does not."""
    (tmp_path / "node.py").write_bytes(b"import os\n\nx = 1 \0\n")
    assert play_file(tmp_path, "node.py")[0] == (
        "0 raised SyntaxError: source code cannot contain null bytes (node.py, line 3)"
    )


def test_a_script_sees_what_scripts_see(run: Callable[..., Any]) -> None:
    """Its own path as the only argument, its own file, itself as `__main__`, no parent package."""
    said = run(
        {
            "node.py": (
                "import os, sys\nsay(len(sys.argv))\nsay(os.path.basename(sys.argv[0]))\n"
                "say(os.path.samefile(sys.argv[0], __file__))\nsay(sys.modules['__main__'].__dict__ is globals())\n"
                "say(__package__)\nsay(__spec__)\nsay(__builtins__ is not None)\n"
            )
        }
    )
    assert said == ["1", "node.py", "True", "True", "None", "None", "True"]


def test_objects_of_the_file_can_be_pickled(run: Callable[..., Any]) -> None:
    """`__main__` stays the module they were made in; multiprocessing and dataclasses look it up."""
    said = run(
        {
            "node.py": (
                "import pickle\nfrom dataclasses import dataclass\n@dataclass\nclass State:\n    x: 'float' = 0.5\n"
                "say(pickle.loads(pickle.dumps(State())) == State())\n"
            )
        }
    )
    assert said == ["True"]


def test_future_imports_of_the_host_do_not_leak(run: Callable[..., Any]) -> None:
    """A student's annotations are evaluated as the file says."""
    assert run({"node.py": "def f(x: 1 + 1): pass\nsay(f.__annotations__)\n"}) == ["{'x': 2}"]


def test_a_script_is_what_python3_makes_of_it(run: Callable[..., Any], tmp_path: Path) -> None:
    """Path, arguments and the names of its module."""
    code = (
        "import os, sys\nhere = os.path.dirname(os.path.abspath(__file__))\n"
        "told = [sys.path[0] == here, sys.path.count(here), __name__, __package__, __spec__, __doc__,\n"
        "        type(__loader__).__name__, [os.path.basename(a) for a in sys.argv],\n"
        "        sorted(n for n in globals() if n not in ('here', 'told', 'os', 'sys', '__annotations__'))]\n"
        "globals().get('say', print)(told)\n"
    )
    assert run({"deep/node.py": code.replace("globals().get('say', print)", "say")}, "deep/node.py")
    (tmp_path / "node.py").write_text(code)
    real = subprocess.run([sys.executable, tmp_path / "node.py"], check=True, capture_output=True, text=True)
    assert run({"node.py": code.replace("globals().get('say', print)", "say")}) == [real.stdout.strip()]


@pytest.mark.parametrize("name", ["random.py", "queue.py", "numpy.py", "rclpy.py", "std_msgs.py"])
def test_a_file_that_hides_a_needed_module_is_imported_and_mentioned(run: Callable[..., Any], name: str) -> None:
    """The folder of a script comes first on the path; the note explains what follows."""
    module = name.removesuffix(".py")
    said = run({"node.py": f"import {module}\nsay({module}.WORD)\n", name: "WORD = 'hides'\n"})
    assert said == [f"module_hidden: {name}", "hides"]


@pytest.mark.parametrize(
    ("hidden", "user"),
    [("random", "tempfile"), ("queue", "concurrent.futures.thread"), ("heapq", "queue"), ("string", "string")],
)
def test_what_needs_a_hidden_module_gets_the_students(
    run: Callable[..., Any], tmp_path: Path, hidden: str, user: str
) -> None:
    """Also where the host had imported it before: the program sees what `python3` would make it see."""
    code = f"try:\n    import {user}\n    said = 'fine'\nexcept Exception as error:\n    said = repr(error)[:40]\n"
    (tmp_path / "node.py").write_text(code + "print(said)\n")
    (tmp_path / f"{hidden}.py").write_text("oops = 1\n")
    real = subprocess.run([sys.executable, "-B", tmp_path / "node.py"], check=True, capture_output=True, text=True)
    said = run({"node.py": f"{code}say(said)\n", f"{hidden}.py": "oops = 1\n"})
    assert said == [f"module_hidden: {hidden}.py", real.stdout.strip()]


@pytest.mark.parametrize("name", ["time.py", "sys.py", "os.py", "_thread.py", "helper.py", "link.py", "clock.py"])
def test_what_hides_nothing_is_not_mentioned(run: Callable[..., Any], name: str) -> None:
    """Modules that are a part of the interpreter are found first; those of the host are nobody's."""
    module = name.removesuffix(".py")
    said = run({"node.py": f"import {module}\nsay(hasattr({module}, 'WORD'))\n", name: "WORD = 1\n"})
    assert said == [str(name in ("helper.py", "link.py", "clock.py"))]


def test_the_host_imports_no_part_of_rclpy_by_surprise() -> None:
    """Beside hidden modules, the parts that it changes are imported as the program would import them."""
    trees = [ast.parse(path.read_text(encoding="utf-8")) for path in (ROOT / "grader/runtime/host").glob("*.py")]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    names = {a.name for n in nodes if isinstance(n, ast.Import) for a in n.names}
    names |= {n.module for n in nodes if isinstance(n, ast.ImportFrom) and n.level == 0 and n.module}
    parts = {name for name in names if name.startswith("rclpy.") and name != "rclpy.impl"}
    shadows = ast.parse((ROOT / "grader/runtime/host/shadows.py").read_text(encoding="utf-8"))
    known = {node.value for node in ast.walk(shadows) if isinstance(node, ast.Constant)}
    assert parts
    assert parts <= known


def test_an_exit_is_the_programs_own(run: Callable[..., Any]) -> None:
    """With its code, or its message and 1; nothing is started afterwards."""
    assert run({"node.py": f"{MAIN}raise SystemExit(3)\n"}) == ["exit 3"]
    assert run({"node.py": f"{MAIN}import sys\nsys.exit()\n"}) == ["exit 0"]
    assert run({"node.py": f"{MAIN}import sys\nsys.exit('why')\n"}) == ["exit 1"]
