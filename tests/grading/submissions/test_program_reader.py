"""Any Python file is read in bounded work, and none makes the reader or a hint rule raise."""

from __future__ import annotations

import ast
import cProfile
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pytest
from program_shapes import DEPTHS, ENCODINGS, SHAPES
from tiers import each

from grader.grading.judging.diagnosis import hint_for, placed_in
from grader.grading.judging.source import Source, parsed_source, read_source
from grader.grading.judging.syntax import MOST_DEPTH, MOST_NODES, UnfitTree, json_of, measured, tree_of
from grader.grading.submissions import submission_reader
from grader.grading.submissions.answers import LONG_FILE, UNREADABLE
from grader.grading.submissions.contained_reader import Asked, ReaderAnswer
from grader.grading.submissions.contents import read_contents
from grader.grading.submissions.program_reader import Described, load_encodings, program_description
from grader.grading.submissions.sources import Programs, read_programs, read_texts
from grader.runtime.model.limits import MAX_PROGRAM_BYTES
from grader.runtime.model.submission import Beginning, ReadProgram, SourceText
from grader.runtime.model.trace import ClockKind, Fault, FaultKind, Trace

#: Calls of functions, for each file and for each node that is examined: the most that any shape takes are 40 and 1,200.
MOST_CALLS, CALLS_OF_A_NODE = 40_000, 1_500
#: Calls of all hint rules about one fault; the most that any shape takes are a third.
MOST_CALLS_OF_RULES = 6_000_000
Value = TypeVar("Value")


def counted(made: Callable[[], Value]) -> tuple[Value, int]:
    """Return what a function returns, and how many functions it called."""
    profile = cProfile.Profile()
    found = profile.runcall(made)
    return found, sum(entry.callcount for entry in profile.getstats())


def read_here(content: bytes) -> Described:
    """Read a file as the contained process does, in the test's own."""
    return program_description(content, load_encodings([content]))


def dump(tree: ast.AST) -> str:
    """Return a tree with its places as text, whatever the length of its numbers."""
    limit = sys.get_int_max_str_digits()
    sys.set_int_max_str_digits(0)
    try:
        return ast.dump(tree, include_attributes=True)
    finally:
        sys.set_int_max_str_digits(limit)


@pytest.mark.breadth(3, 17)
@pytest.mark.parametrize("shape", each(SHAPES, 5))
def test_no_shape_of_a_program_takes_more_than_its_size_allows(shape: str) -> None:
    """At any depth it is examined, or is one that Python cannot compile, or is said to be too long or too deep."""
    for depth in DEPTHS:
        content = SHAPES[shape](depth).encode()
        found, calls = counted(lambda content=content: read_here(content))  # type: ignore[misc]
        assert calls <= MOST_CALLS + CALLS_OF_A_NODE * found.nodes, depth
        assert found.nodes <= MOST_NODES + 1
        known = found.tree is not None or "error" in found.row
        assert known or (found.row["reaches"][0] == LONG_FILE and found.row["problem"]), depth
        if found.tree is not None:
            tree = tree_of(found.tree)
            assert tree is not None
            assert dump(tree) == dump(ast.parse(content))


@pytest.mark.breadth(4, 17)
@pytest.mark.parametrize("shape", each(SHAPES, 5))
def test_no_shape_of_a_program_makes_a_rule_raise(shape: str, caplog: pytest.LogCaptureFixture) -> None:
    """All hint rules look at the deepest trees that there are, in bounded work."""
    for depth in (95, 180, 3_000):
        found = read_here(SHAPES[shape](depth).encode())
        if found.tree is None or found.text is None:
            continue
        text = SourceText(found.text.decode(), found.tree)
        fault = Fault(0, "a.py", FaultKind.EXCEPTION, "TypeError: x", file="a.py", line=3)
        trace = Trace("alone", ClockKind.VIRTUAL, 10**9, (fault,))
        _, calls = counted(lambda: (hint_for(fault, trace, text), placed_in(("a note",), {"a.py": text})))  # noqa: B023
        assert calls <= MOST_CALLS_OF_RULES
    assert not caplog.records


@pytest.mark.breadth(6, 30)
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_no_encoding_costs_more_than_its_size(encoding: str) -> None:
    """Only those of editors, and some of other systems, are decoded; a program in any other is suspicious."""
    content = f"# -*- coding: {encoding} -*-\n".encode() + b"x = '-abc'\n" * 20_000
    found, calls = counted(lambda: read_here(content))
    assert calls <= MOST_CALLS + CALLS_OF_A_NODE * found.nodes
    if encoding in ("utf-8", "utf-8-unix", "latin-1", "latin-1-dos", "iso-8859-15", "cp1252", "windows-1252"):
        assert UNREADABLE not in found.row["reaches"]
    else:
        assert UNREADABLE in found.row["reaches"]


def test_a_tree_that_is_told_is_one_that_the_parser_makes(tmp_path: Path) -> None:
    """Of all files of the grader, and of none that were changed on the way."""
    for path in Path(submission_reader.__file__).parent.glob("*.py"):
        tree = ast.parse(path.read_bytes())
        made = tree_of(json_of(tree))
        assert made is not None
        assert dump(made) == dump(tree)
    row = json.loads(json_of(ast.parse("x = f(1, b'2', 3j, ..., 10 ** 99, None)\n")))
    for place in paths(row):
        odd_values: tuple[object, ...] = (None, -1, 10**9, "x", [], [[]], {}, True, 1.5)
        for odd in odd_values:
            changed = json.loads(json.dumps(row))
            here = changed
            for step in place[:-1]:
                here = here[step]
            here[place[-1]] = odd
            made = tree_of(json.dumps(changed).encode())
            assert made is None or isinstance(compile_or_none(made), (type(None), bool))


def paths(row: object, above: tuple[int, ...] = ()) -> list[tuple[int, ...]]:
    """Return the places of all parts of nested lists."""
    found: list[tuple[int, ...]] = []
    for number, part in enumerate(row if isinstance(row, list) else ()):
        found += [(*above, number), *paths(part, (*above, number))]
    return found


def compile_or_none(tree: ast.Module) -> bool | None:
    """Return whether Python takes a tree: of wrong types, it raises TypeError."""
    try:
        compile(tree, "x", "exec")
    except (ValueError, SyntaxError):
        return None
    return True


@pytest.mark.parametrize("told", [b"", b"null", b"5", b"[]", b"[" * 5_000, b"\xff", b'{"a": 1}', b"[1, [2]]"])
def test_what_is_no_tree_is_none(told: bytes) -> None:
    """The process that told it has read what students wrote."""
    assert tree_of(told) is None


def test_trees_beyond_the_limits_are_not_told() -> None:
    """Neither by size nor by depth, and not even by a process that says so."""
    wide = ast.parse("x = [" + "1," * MOST_NODES + "]")
    deep = ast.parse("x = " + "a + " * MOST_DEPTH + "a")
    for tree in (wide, deep):
        assert measured(tree)[0] > MOST_NODES or measured(tree)[1] > MOST_DEPTH
        with pytest.raises(UnfitTree):
            json_of(tree)
        assert parsed_source(ast.unparse(tree)) is None


def test_a_file_that_is_too_deep_is_a_note_and_nothing_else(tmp_path: Path) -> None:
    """What ended the grader: it becomes suspicious, and the program beside it is examined."""
    (tmp_path / "node.py").write_text("import gc\n")
    (tmp_path / "helper.py").write_text(SHAPES["chain of &"](1_500))
    (tmp_path / "odd.py").write_bytes(b"# coding: punycode\n" + b"-" * 900_000)
    (tmp_path / "folded.py").write_text(SHAPES["finally"](19) + "x = 1\n" * 4_000)
    found = read_contents(tmp_path, ["node.py"])
    assert found.programs["node.py"].reaches == ("gc",)
    assert found.programs["helper.py"].reaches == (LONG_FILE,)
    assert found.programs["odd.py"] == ReadProgram(reaches=(UNREADABLE,))
    assert found.programs["folded.py"].reaches == (LONG_FILE,)
    assert [note.partition(";")[0] for note in found.notes] == [
        "folded.py: too long to be examined",
        "helper.py: nested too deeply to be examined",
    ]


def test_all_programs_of_a_submission_are_counted_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The programs that are probably run come first, whatever lies before them."""
    for name in ("a.py", "b.py", "node.py"):
        (tmp_path / name).write_text("x = [" + "1, " * 900 + "]\n")
    (tmp_path / "zz.py").write_bytes(b"#" * (1 << 20))
    monkeypatch.setattr(submission_reader, "MOST_NODES", 1_500)
    programs, asked = Programs(tmp_path, ["node.py"]), Asked()
    programs.ask(asked)
    rows = list(
        submission_reader._programs(
            asked.programs,
            [memoryview(c) for c in asked._contents],
            set(asked.likely),
            load_encodings(()),
            decoded=False,
        )
    )
    assert [(row["path"], row.get("problem", "")) for row, _, _ in rows] == [
        ("node.py", ""),
        ("a.py", ""),
        ("b.py", "costly"),
        ("zz.py", "costly"),
    ]


def test_more_bytes_than_are_read_are_suspicious(tmp_path: Path) -> None:
    """The process never gets them."""
    for number in range(6):
        (tmp_path / f"{number}.py").write_bytes(b"#" * (1 << 20))
    programs, asked = Programs(tmp_path, ["5.py"]), Asked()
    programs.ask(asked)
    assert [path for path, _ in asked.programs] == ["5.py", "0.py", "1.py", "2.py"]
    assert len(asked.input()) < MAX_PROGRAM_BYTES + 1_000
    found, notes = programs.told(ReaderAnswer(b""))
    assert {program.reaches for program in found.values()} == {(LONG_FILE,)}
    assert len(notes) == 2


@pytest.mark.parametrize(
    "told",
    [
        b"",
        b"null\n",
        b'{"path": "other.py"}\n',
        b'{"path": "node.py", "text": 99}\nshort',
        b'{"path": "node.py", "text": -1}\n',
        b'{"path": "node.py", "text": true}\n',
    ],
)
def test_what_the_process_says_of_programs_is_checked(tmp_path: Path, told: bytes) -> None:
    """Whatever it is, the program counts as one that was not examined."""
    (tmp_path / "node.py").write_text("x = 1\n")
    found, notes = read_programs(tmp_path, (), lambda _: told)
    assert found == {"node.py": ReadProgram(reaches=(LONG_FILE,))}
    assert notes[0].startswith("node.py: not examined")


def test_what_a_program_begins_is_told(tmp_path: Path) -> None:
    """Of a file that Python can parse, however deep or long; nothing else parses it to start it."""
    (tmp_path / "node.py").write_text("from rclpy.node import Node\nclass Talker(Node): pass\n")
    (tmp_path / "deep.py").write_text("def main(): pass\nx = 1\nx" + " + 1" * 300 + "\nmain()\n")
    (tmp_path / "broken.py").write_text("def main(:\n")
    found, _ = read_programs(tmp_path)
    assert {path: program.begins for path, program in found.items()} == {
        "node.py": Beginning(node="Talker"),
        "deep.py": Beginning(starts=True, main=True),
        "broken.py": None,
    }


@pytest.mark.parametrize("told", [None, [], [True, True, True], [1, 0, 1, ""], [True, True, True, 4], {"node": "A"}])
def test_odd_words_on_what_a_program_begins_are_dropped(tmp_path: Path, told: object) -> None:
    """As if Python could not parse it."""
    (tmp_path / "node.py").write_text("x = 1\n")
    row = {"path": "node.py", "reaches": [], "begins": told}
    found, _ = read_programs(tmp_path, (), lambda _: json.dumps(row).encode() + b"\n")
    assert found["node.py"].begins is None
    row["begins"] = [True, False, True, "A(); import os"]
    found, _ = read_programs(tmp_path, (), lambda _: json.dumps(row).encode() + b"\n")
    assert found["node.py"].begins == Beginning(starts=True, offers_main=True)


def test_odd_values_are_dropped(tmp_path: Path) -> None:
    """Of a program that was read."""
    (tmp_path / "node.py").write_text("x = 1\n")
    row = {
        "path": "node.py",
        "reaches": [1, "gc", "x" * 999],
        "inert": 1,
        "error": ["A B", 1, 2],
        "problem": [],
        "text": 1,
    }
    found, notes = read_programs(tmp_path, (), lambda _: json.dumps(row).encode() + b"\n\xff")
    assert found == {"node.py": ReadProgram(reaches=("gc", "x" * 200))}
    assert notes == ()


def test_texts_that_are_kept_get_trees_only_if_they_are_looked_at() -> None:
    """In whatever encoding they once were."""
    asked = []

    def tell(given: bytes) -> bytes:
        asked.append(given)
        content = texts["a.py"].encode()
        tree = json_of(ast.parse(texts["a.py"]))
        row = {"path": "a.py", "reaches": [], "text": len(content), "tree": len(tree)}
        return json.dumps(row).encode() + b"\n" + content + tree

    texts = {"a.py": "# coding: latin-1\nx = 'ü'\n"}
    found = read_texts(texts, tell)
    assert found == texts
    assert asked == []
    source = read_source("a.py", found["a.py"])
    assert [node.value for node in source.all(ast.Constant)] == ["ü"]
    read_source("a.py", found["a.py"])
    assert len(asked) == 1


def test_a_tree_that_was_made_elsewhere_is_never_parsed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not even where there is none."""

    def refuse(*_: object) -> None:
        pytest.fail("a text was parsed")

    monkeypatch.setattr(ast, "parse", refuse)
    assert read_source("a.py", SourceText("x = 1\n")) == Source("a.py", ("x = 1", ""))
