"""How a student's file is started: as a script, as a module of its package, or through what it defines."""

import pytest
from staging_programs import play_file


@pytest.fixture
def run(tmp_path):
    """Write files into a submission, run one of them and return what it said."""

    def write_and_run(files, file="node.py"):
        root = tmp_path / "submission"
        for name, content in files.items():
            path = root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return [line.partition(" ")[2] for line in play_file(root, file)[:-1]]

    return write_and_run


MAIN = "def main():\n    say('main ran')\n"
UNCALLED = "nothing calls main(), so `python3 node.py` would do nothing; add: if __name__ == '__main__': main()"
NODE = "import rclpy\nfrom rclpy.node import Node\nclass Blinker(Node):\n    pass\n"


def test_a_guard_is_respected(run):
    """The file runs under its own name, as `python3 node.py` would have it, once."""
    assert run({"node.py": f"{MAIN}if __name__ == '__main__':\n    main()\n"}) == ["main ran"]


def test_a_file_without_a_guard_is_run_and_told_so(run):
    """Console scripts call main from elsewhere; the note says what `python3` would do."""
    assert run({"node.py": MAIN}) == [f"node.py: {UNCALLED}", "main ran"]


@pytest.mark.parametrize(
    "guard",
    [
        "if __name__ == 'main':\n    main()\n",
        "if __name__ == '__main__ ':\n    main()\n",
        "if __name__ != '__main__' and False:\n    pass\n",
        "if '__name__' == '__main__':\n    main()\n",
    ],
)
def test_a_misspelt_guard_is_run_and_told_so(run, guard):
    """What was meant is graded; that it does not work alone is said."""
    assert run({"node.py": MAIN + guard}) == [f"node.py: {UNCALLED}", "main ran"]


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
def test_main_is_called_once_however_it_is_called(run, call):
    """A second run would publish everything twice."""
    assert run({"node.py": MAIN + call}).count("main ran") == 1


def test_a_main_that_raised_inside_its_guard_is_not_run_again(run):
    """The exception is the file's own."""
    said = run(
        {"node.py": "def main():\n    say('main ran')\n    raise OSError('x')\nif __name__ == '__main__': main()\n"}
    )
    assert said == ["main ran", "raised OSError: x"]


def test_a_lone_node_class_is_spun_and_told_so(run):
    """Nobody makes the node: the host does, since everything that is graded is there."""
    assert run({"node.py": NODE}) == [
        "node.py: nothing starts Blinker, so `python3 node.py` would do nothing; "
        "add a main() that calls rclpy.init(), makes the node and spins it",
        "init",
        "spin Blinker",
    ]


@pytest.mark.parametrize(
    "ending",
    [
        "class Other(Node):\n    pass\n",
        "def main():\n    pass\nmain()\n",
        "blinker = Blinker()\n",
        "main = None\n",
    ],
)
def test_nothing_is_guessed_where_it_is_not_plain(run, ending):
    """Two classes, a main that did nothing, or a node that was made: the file has had its say."""
    assert run({"node.py": NODE + ending}) == []


def test_a_class_of_another_file_is_not_the_files_own(run):
    """An imported node class does not start by itself."""
    assert run({"node.py": "from other import Blinker\n", "other.py": NODE}) == []


def test_helper_modules_are_found_beside_the_file(run):
    """As `python3` finds them, wherever the file lies in the submission."""
    files = {"src/deep/node.py": "import helper\nsay(helper.WORD)\n", "src/deep/helper.py": "WORD = 'found'\n"}
    assert run(files, "src/deep/node.py") == ["found"]


def test_a_package_is_importable_by_its_own_name(run):
    """`ros2 run` has it on the path: absolute and relative imports both work."""
    files = {
        "src/robot/robot/__init__.py": "",
        "src/robot/robot/words.py": "WORD = 'found'\n",
        "src/robot/robot/sub/__init__.py": "",
        "src/robot/robot/absolute.py": "from robot.words import WORD\nsay(WORD)\n",
        "src/robot/robot/relative.py": "from .words import WORD\nfrom . import words\nsay(WORD)\nsay(__name__)\n",
        "src/robot/robot/sub/deep.py": "from ..words import WORD\nsay(WORD)\n",
        "src/robot/robot/uncalled.py": "from .words import WORD\ndef main():\n    say(WORD)\n",
    }
    assert run(files, "src/robot/robot/absolute.py") == ["found"]
    assert run({}, "src/robot/robot/relative.py") == ["found", "__main__"]
    assert run({}, "src/robot/robot/sub/deep.py") == ["found"]
    assert run({}, "src/robot/robot/uncalled.py")[1:] == ["found"]


def test_a_relative_import_at_the_top_of_a_submission_works(run):
    """The folder's own name stands for the package, as if it had been built."""
    files = {"node.py": "from .helper import WORD\nsay(WORD)\n", "helper.py": "WORD = 'found'\n"}
    assert run(files) == ["found"]


def test_any_encoding_that_python_accepts(run):
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
def test_a_file_that_is_not_python_is_not_run_at_all(run, content, kind):
    """Nothing of it has happened when the error is found."""
    (said,) = run({"node.py": content})
    assert said.startswith(f"raised {kind}")


def test_a_null_byte_is_found_where_it_is(tmp_path):
    """The report names the line, which Python does not."""
    (tmp_path / "node.py").write_bytes(b"import os\n\nx = 1 \0\n")
    assert play_file(tmp_path, "node.py")[0] == (
        "0 raised SyntaxError: source code cannot contain null bytes (node.py, line 3)"
    )


def test_a_script_sees_what_scripts_see(run):
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
    assert said == ["1", "node.py", "True", "True", "", "None", "True"]


def test_objects_of_the_file_can_be_pickled(run):
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


def test_future_imports_of_the_host_do_not_leak(run):
    """A student's annotations are evaluated as the file says."""
    assert run({"node.py": "def f(x: 1 + 1): pass\nsay(f.__annotations__)\n"}) == ["{'x': 2}"]


@pytest.mark.parametrize("name", ["random.py", "queue.py", "numpy.py", "rclpy.py", "std_msgs.py"])
def test_a_file_that_hides_a_needed_module_is_mentioned(run, name):
    """The node gets the module it needs, and its author hears why `python3` would fail."""
    said = run(
        {"node.py": "import queue, random\nsay(random.Random and queue.Queue and 'usable')\n", name: "oops = 1\n"}
    )
    assert said == [
        f"{name} has the name of a module that Python or ROS needs: `python3` would import it instead; rename it",
        "usable",
    ]


def test_an_exit_is_the_programs_own(run):
    """With its code, or its message and 1; nothing is started afterwards."""
    assert run({"node.py": f"{MAIN}raise SystemExit(3)\n"}) == ["exit 3"]
    assert run({"node.py": f"{MAIN}import sys\nsys.exit()\n"}) == ["exit 0"]
    assert run({"node.py": f"{MAIN}import sys\nsys.exit('why')\n"}) == ["exit 1"]
