"""What the Python of a ROS release knows, and the one that runs here does not, is no fault of a program."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import sys
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import pytest
from decided import grade_until_decided
from places import REPORTED
from tiers import NIGHTLY, each, more

from grader.grading.app.observe import ObserveRequest, observe_programs
from grader.grading.app.request import GradeRequest
from grader.grading.model.exercise import Outcome
from grader.grading.model.report import Report
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.releases import RELEASES
from grader.runtime.model.trace import AssessedTrace, ClockKind, Fault, FaultKind, Start, StartWay
from grader.runtime.recording.codec import trace_to_json
from grader.runtime.recording.packed import pack_trace, trace_from_json, unpack_trace
from grader.runtime.supervisor.newer_python import NEW_NAMES, NEWER, is_newer, newer_name, with_newer
from grader.runtime.supervisor.newer_syntax import needs_newer

HERE = sys.version_info[:2]
JAZZY = RELEASES["jazzy"].python or (0, 0)
older = pytest.mark.skipif(JAZZY <= HERE, reason="the Python of Jazzy or a newer one runs here")

#: Right in Python 3.12, and in no older one.
RIGHT = {
    "the quotation mark of the f-string": "x = f'{a['b']}'\n",
    "an f-string in an f-string": 'x = f"{f"{f"{1}"}"}"\n',
    "a backslash in an expression": "x = f'{\"\\n\".join(a)}'\n",
    "a comment in an expression": "x = f'{a # here\n}'\n",
    "an expression of several lines": "x = f'{\n a +\n b\n}'\n",
    "a quotation mark in a specification": "x = f'{a:>{b['c']}}'\n",
    "a conversion": "x = f'{a['b']!r:>{w}} {a['c'] = }'\n",
    "a triple quotation mark": 'x = f"""a"{b["""c"""]}"d" """\n',
    "a raw one": "x = Rf'\\q{a['b']}'\n",
    "parts of one text": "x = ('a' f'{a['b']}' \"c\")\n",
    "braces that are text": "x = f'{{a}} {b['c']}'\n",
    "a generator in a call": "log(f'at {', '.join(f'{v:.2f}' for v in a)}')\n",
    "what an f-string may hold": (
        "async def f():\n"
        "    x = f'{await g()['a']}{(y := d['b'])}{(lambda q: q['c'])(3)}'\n"
        "    yield f'{(yield)}{'d'}'\n"
    ),
    "an alias": "type X = int\n",
    "an alias with parameters": "type X[T] = list[T]\n",
    "a function with parameters": "def f[T: int](a: T) -> T:\n    return a\n",
    "a class with parameters": "class A[T: (int, str), *Ts, **P](B, metaclass=M):\n    pass\n",
    "Windows' ends of lines": "x = f'{a['b']}'\r\ny = 3\r\n",
    "a mark of the byte order": "\ufefftype X = int\n",
}
#: Wrong in Python 3.12 too, the first ones beside something new: a mistake, or what is newer still.
WRONG = {
    "a missing bracket": "print(f'{a['b']}'\nx = (\n",
    "a missing colon": "def f()\n    x = f'{a['b']}'\n",
    "an indentation": "def f():\n  x = f'{a['b']}'\n y = 3\n",
    "return outside of a function": "return f'{a['b']}'\n",
    "an argument twice": "def f(a, a):\n    x = f'{a['b']}'\n",
    "Python 2": "print f'{a['b']}'\n",
    "an assignment to an f-string": "f'{a['b']}' = 3\n",
    "a loop over nothing with one": "for f'{a['b']}' in x: pass\n",
    "with ... as one": "with x as f'{a['b']}': pass\n",
    "a pattern": "match x:\n    case f'{a['b']}':\n        pass\n",
    "a future import behind a text": "f'{a['b']}'\nfrom __future__ import annotations\n",
    "a parameter twice": "def f[T, T](): pass\n",
    "an alias of an attribute": "type x.y = 3\n",
    "a default before none": "class A[T = int, U]: pass\n",
    "as without brackets": "try:\n    pass\nexcept A, B as e:\n    pass\n",
    "both kinds of except": "try:\n    pass\nexcept* A, B:\n    pass\nexcept C:\n    pass\n",
    "a default of a parameter": "class A[T = int, *Ts = *tuple[int], **P = [int]]:\n    pass\n",
    "exceptions without brackets": "type X = int\ntry:\n    pass\nexcept A, B:\n    pass\n",
    "a t-string": "x = f'{a['b']}' + t'{a}'\n",
    "nothing new": "def f(:\n    pass\n",
    "another language": "int x = 3;\n",
    "no text": "\x01\x02\n",
    "nothing": "\n",
}


@older
@pytest.mark.parametrize("name", RIGHT)
def test_what_the_newer_version_compiles_is_told_from_a_mistake(name: str) -> None:
    """This one does not."""
    text = RIGHT[name].encode()
    with pytest.raises(SyntaxError):
        compile(text, "file", "exec", dont_inherit=True)
    assert needs_newer(text)


@pytest.mark.parametrize("name", WRONG)
@pytest.mark.filterwarnings("ignore::SyntaxWarning", "ignore::DeprecationWarning")
def test_what_the_newer_version_does_not_compile_stays_a_mistake(name: str) -> None:
    """However much of what is new stands beside it."""
    assert not needs_newer(WRONG[name].encode())


@older
def test_the_encoding_of_a_file_is_its_own() -> None:
    """Not always UTF-8."""
    assert needs_newer("# -*- coding: latin-1 -*-\nx = f'{a['\xe9']}'\n".encode("latin-1"))


@pytest.mark.parametrize(
    "text", [b"x = " + b"(" * 100_000, b"x = " + b"(" * 5_000 + b")" * 5_000, b"x = " + b"f'{" * 500 + b"}'" * 500]
)
def test_a_hostile_file_ends_only_the_process_that_reads_it(text: bytes) -> None:
    """It is none that any Python reads."""
    assert not is_newer(text, "whether")


@older
def test_the_process_that_reads_answers() -> None:
    """Over its own limits."""
    assert is_newer(b"class A[T]: pass\n", "whether")


def test_nothing_is_decided_without_the_library(monkeypatch: pytest.MonkeyPatch) -> None:
    """The submission is undecided then, with what to install."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(HarnessError, match="whether Python reads it is not known: libcst is not installed") as raised:
        is_newer(b"x = f'{a['b']}' # no other test reads this\n", "whether Python reads it")
    assert "libcst" in raised.value.hint


# --- the standard library ---


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("ImportError: cannot import name 'batched' from 'itertools' (unknown location)", "itertools.batched"),
        ("ImportError: cannot import name 'override' from 'typing' (typing.py)", "typing.override"),
        ("AttributeError: module 'math' has no attribute 'sumprod'", "math.sumprod"),
        ("AttributeError: 'PosixPath' object has no attribute 'walk'", "PosixPath.walk"),
        ("AttributeError: type object 'PosixPath' has no attribute 'from_uri'", ""),
        ("ImportError: cannot import name 'batches' from 'itertools' (unknown location)", ""),
        ("AttributeError: 'Drive' object has no attribute 'walk'", ""),
        ("NameError: name 'override' is not defined", ""),
        ("ModuleNotFoundError: No module named 'string.templatelib'", ""),
        ("KeyError: 'itertools.batched'", ""),
    ],
)
def test_a_name_that_a_newer_library_has_is_told_from_a_slip(text: str, name: str) -> None:
    """By what Python says of it."""
    assert newer_name(Fault(0, "a.py", FaultKind.EXCEPTION, text, "a.py", 1)) == name


def test_the_list_of_names_is_that_of_this_python() -> None:
    """All of it is here in the newer version, and nothing before."""
    for of, words in NEW_NAMES.items():
        owner = _owner(of)
        for name in words.split():
            after_an_error = (of, name) == ("sys", "last_exc")  # is there after one at a prompt only
            if not after_an_error and not (HERE == (3, 11) and name in _KNOWN.get(of, ())):
                assert hasattr(owner, name) == (HERE >= NEWER), (of, name)


def _owner(of: str) -> object:
    classes = {"PosixPath": Path("/"), "int": 1}
    return classes[of] if of in classes else importlib.import_module(of)


def test_the_list_of_names_is_that_of_typeshed() -> None:
    """For the modules that it lists, whichever version they came with."""
    typeshed = Path(pytest.importorskip("mypy").__file__).parent / "typeshed" / "stdlib"
    parts = {"asyncio": ["locks", "queues", "runners", "taskgroups", "tasks", "timeouts"]}
    for of in set(NEW_NAMES) - {"PosixPath", "int"}:
        file = typeshed / f"{of.replace('.', '/')}.pyi"
        files = [file] if file.is_file() else [file.with_suffix("") / "__init__.pyi"]
        files += [typeshed / of / f"{part}.pyi" for part in parts.get(of, ())]
        found: dict[str, tuple[int, int]] = {}
        for stub in files:
            for name, version in _since(ast.parse(stub.read_text()).body, (3, 0)):
                found[name] = min(version, found.get(name, version))
        new = {name for name, version in found.items() if version == NEWER and name[0] != "_"}
        assert new <= set(NEW_NAMES[of].split())


#: What late releases of Python 3.11 have too; the first ones do not.
_KNOWN = {"enum": ("pickle_by_enum_name", "pickle_by_global_name")}


def _since(body: list[ast.stmt], least: tuple[int, int]) -> Iterator[tuple[str, tuple[int, int]]]:
    """Yield the names of a stub with the version that they came with."""
    for node in body:
        if isinstance(node, ast.If):
            test = node.test
            if "sys.platform" in ast.unparse(test):
                continue
            compares = isinstance(test, ast.Compare) and ast.unparse(test.left) == "sys.version_info"
            version = (
                tuple(ast.literal_eval(test.comparators[0])[:2]) if isinstance(test, ast.Compare) and compares else ()
            )
            newer = bool(version) and isinstance(test, ast.Compare) and isinstance(test.ops[0], ast.GtE)
            bound = max(least, (version[0], version[1])) if version else least
            yield from _since(node.body, bound if newer else least)
            yield from _since(node.orelse, least if newer else bound)
        elif isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            yield node.name, least
        elif isinstance(node, ast.Assign):
            yield from ((target.id, least) for target in node.targets if isinstance(target, ast.Name))
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            yield node.target.id, least
        elif isinstance(node, ast.ImportFrom):
            yield from ((a.asname, least) for a in node.names if a.asname and a.asname == a.name)


# --- traces ---


def failed(text: str, kind: FaultKind = FaultKind.EXCEPTION, hidden: tuple[str, ...] = ()) -> AssessedTrace:
    fault = Fault(5, "a.py", kind, text, "a.py", 3, python=HERE if kind is FaultKind.SYNTAX_ERROR else None)
    start = Start("a.py", "a.py", StartWay.SCRIPT, hidden=hidden)
    return AssessedTrace("alone", ClockKind.VIRTUAL, 10 * NS_PER_S, (fault,), starts=(start,))


@older
def test_a_trace_says_what_is_newer_and_keeps_it(tmp_path: Path) -> None:
    """In a file of evidence too."""
    (tmp_path / "a.py").write_text("x = 1\n\ny = f'{a['b']}'\n")
    (found,) = with_newer(failed("SyntaxError: f-string", FaultKind.SYNTAX_ERROR), str(tmp_path), "jazzy").newer
    here = f"{HERE[0]}.{HERE[1]}"
    assert found.sentence == (
        f"a.py:3: this is valid since Python 3.12; ROS 2 jazzy runs on Python 3.12, the grader here on Python {here}, "
        "which is not the program's fault"
    )
    trace = with_newer(failed("AttributeError: module 'itertools' has no attribute 'batched'"), str(tmp_path), "jazzy")
    assert trace.newer[0].sentence.startswith("a.py:3: itertools.batched came with Python 3.12; ROS 2 jazzy runs")
    assert trace_from_json(trace_to_json(trace)) == trace == unpack_trace(pack_trace(trace, [False]))


@older
@pytest.mark.parametrize(
    ("trace", "distro", "text"),
    [
        (failed("SyntaxError: '(' was never closed", FaultKind.SYNTAX_ERROR), "jazzy", "x = (\n"),
        (failed("SyntaxError: f-string", FaultKind.SYNTAX_ERROR), "humble", "x = f'{a['b']}'\n"),
        (failed("SyntaxError: f-string", FaultKind.SYNTAX_ERROR), "unheard-of", "x = f'{a['b']}'\n"),
        (failed("SyntaxError: invalid", FaultKind.SYNTAX_ERROR), "jazzy", "class A[T = int]: pass\n"),
        (failed("AttributeError: module 'itertools' has no attribute 'batches'"), "jazzy", ""),
        (failed("AttributeError: module 'math' has no attribute 'fma'"), "jazzy", ""),
        (
            failed("AttributeError: module 'random' has no attribute 'binomialvariate'", hidden=("random.py",)),
            "jazzy",
            "",
        ),
    ],
)
def test_what_the_release_lacks_too_is_the_students(
    trace: AssessedTrace, distro: str, text: str, tmp_path: Path
) -> None:
    """Its Python is as old, or no Python reads it, or a file of the submission hides the module."""
    (tmp_path / "a.py").write_text(text)
    assert with_newer(trace, str(tmp_path), distro) == trace


# --- in nodes ---


def graded(folder: Path, name: str, text: str, clock: str) -> Report:
    (folder / name).write_text(text)
    return grade_until_decided(GradeRequest(str(folder), clock=clock))


DRIVES = """
import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node
{imports}

class Drive(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.speeds = {{'x': 0.5, 'z': 0.1}}
        self.out = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.05, self.tick)

    def tick(self):
        message = Twist()
        message.linear.x, message.angular.z = self.speeds['x'], self.speeds['z']
        self.out.publish(message)
        {logs}


rclpy.init()
rclpy.spin(Drive())
"""


@older
@pytest.mark.ros
@pytest.mark.parametrize("clock", ["auto", *more(["wall"], NIGHTLY)])
@pytest.mark.parametrize(
    ("imports", "logs"),
    each(
        [
            ("", "self.get_logger().info(f'driving at {self.speeds['x']} m/s')"),
            ("type Speed = float", "self.get_logger().info('driving')"),
            ("from typing import override", "self.get_logger().info('driving')"),
        ],
        3,
    ),
    ids=["f-string", "type", "library"],
)
def test_a_program_for_the_python_of_the_release_is_undecided(
    imports: str, logs: str, clock: str, tmp_path: Path
) -> None:
    """Each criterion, with the reason and what to do; on another exercise nothing changes."""
    report = graded(tmp_path, "velocity_publisher.py", DRIVES.format(imports=imports, logs=logs), clock)
    verdicts = report.exercises[0].verdicts
    assert {v.outcome for v in verdicts} == {Outcome.UNDECIDED}
    assert not report.final
    assert "ROS 2 jazzy runs on Python 3.12" in verdicts[0].reason
    assert verdicts[0].hint.startswith("grade again on Python 3.12")


@older
@pytest.mark.ros
def test_a_mistake_beside_it_costs_the_points(tmp_path: Path) -> None:
    """And keeps its hint."""
    text = DRIVES.format(imports="", logs="self.get_logger().info(f'driving at {self.speeds['x']} m/s'")
    report = graded(tmp_path, "velocity_publisher.py", text, "auto")
    assert {v.score for v in report.exercises[0].verdicts} == {Fraction(0)}
    assert {v.outcome for v in report.exercises[0].verdicts} <= {Outcome.NOT_MET, Outcome.BLOCKED}


@older
@pytest.mark.ros
@pytest.mark.long
@pytest.mark.parametrize("clock", ["virtual", *more(["wall"], NIGHTLY)])
def test_observe_says_it_too(clock: str) -> None:
    """As a note beside the fault."""
    summary = observe_programs(ObserveRequest((REPORTED / "pep701.py",), NS_PER_S, clock=clock), lambda _: None)
    assert any("ROS 2 jazzy runs on Python 3.12" in note for note in summary.notes), summary.notes
