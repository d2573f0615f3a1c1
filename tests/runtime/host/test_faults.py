"""What a fault says: the exception in one line, the same in every run and on every machine."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from grader.runtime.host import faults


@pytest.fixture
def text_of(tmp_path: Path) -> Callable[..., Any]:
    """Return what is said of an exception in a submission that lies in a temporary folder."""

    def one_line(error: Any) -> str:
        told = faults.Describer(str(tmp_path)).exception(error)
        return f"{told.type}: {told.message}" if told.message else told.type

    return one_line


class Widget:
    """Has a repr that tells its address."""


def test_addresses_of_objects_are_left_out(text_of: Callable[..., Any]) -> None:
    """They differ from run to run."""
    text = text_of(TypeError(f"got {Widget()!r} and {text_of!r}"))
    assert "0x" not in text
    assert "Widget object>" in text


def test_short_hexadecimal_numbers_stay(text_of: Callable[..., Any]) -> None:
    """A bus address or a colour is the student's own word."""
    assert text_of(ValueError("no sensor at 0x40")) == "ValueError: no sensor at 0x40"


def test_files_outside_the_submission_are_named_without_their_folder(text_of: Callable[..., Any]) -> None:
    """Where Python and its packages lie is nobody's business."""
    with pytest.raises(ImportError) as caught:
        from json import no_such_name  # type: ignore[attr-defined]  # noqa: F401
    assert text_of(caught.value) == "ImportError: cannot import name 'no_such_name' from 'json' (__init__.py)"


def test_folders_of_python_are_left_out_whatever_the_file_is(text_of: Callable[..., Any]) -> None:
    """A data file of a package, too, is named alone."""
    assert text_of(OSError(f"cannot read {sys.prefix}/share/foo/table.csv")) == "OSError: cannot read table.csv"


def test_files_of_the_submission_are_relative_to_it(text_of: Callable[..., Any], tmp_path: Path) -> None:
    """As the student knows them, in folders too."""
    text = text_of(FileNotFoundError(2, "No such file or directory", str(tmp_path / "config/speed.yaml")))
    assert text == "FileNotFoundError: [Errno 2] No such file or directory: 'config/speed.yaml'"


def test_the_folder_for_temporary_files_is_named_as_everywhere(
    text_of: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where another folder takes its place."""
    monkeypatch.setenv("TMPDIR", "/dev/shm/grade-student-1")
    error = FileNotFoundError(2, "No such file or directory", "/dev/shm/grade-student-1/a/odom.csv")
    assert text_of(error) == "FileNotFoundError: [Errno 2] No such file or directory: '/tmp/a/odom.csv'"


@pytest.mark.parametrize(
    "text",
    [
        "invalid topic name '/robot one/cmd_vel'",
        "no '/robot1/odom' on '/a/b/c'",
        "expected 5/4 or 3/2 m/s",
        "see https://docs.example.org/a/b.html",
        "'/media/stick/data/log.csv'",
        "../speed.py and ./speed.py",
    ],
)
def test_topics_and_the_students_own_paths_stay(text_of: Callable[..., Any], text: str) -> None:
    """A name on the wire looks like a path, and is none."""
    assert text_of(RuntimeError(text)) == f"RuntimeError: {text}"


def test_an_endless_text_is_cut(text_of: Callable[..., Any]) -> None:
    """Whatever an exception holds, the line stays short, and is found at once."""
    assert text_of(RuntimeError("-/" * 200_000)).startswith("RuntimeError: -/-/")
    assert len(text_of(RuntimeError("/a/b.py " * 200_000))) == 500


@pytest.mark.parametrize("message", ["", "no", "ValueError: no", "ValueError"])
def test_the_name_of_the_class_is_no_part_of_the_message(tmp_path: Path, message: str) -> None:
    """They are sent as two values."""
    told = faults.Describer(str(tmp_path)).exception(ValueError(message))
    assert (told.code, told.type, told.message) == ("exception", "ValueError", message)


def test_a_str_that_raises_leaves_the_class(text_of: Callable[..., Any]) -> None:
    """The student's own `__str__` may raise anything."""

    class BrokenError(Exception):
        def __str__(self) -> str:
            raise ValueError

    assert text_of(BrokenError()).startswith("test_faults.")


def test_only_a_file_that_cannot_be_compiled_has_a_syntax_error(tmp_path: Path) -> None:
    """Anybody may raise one by hand: that is an exception of the line that raises it."""
    good, bad = tmp_path / "good.py", tmp_path / "bad.py"
    good.write_text("x = 1\n")
    bad.write_text("x = (\n")
    told = faults.Describer(str(tmp_path)).exception
    assert told(SyntaxError("x", (str(bad), 1, 5, "x = ("))).code == "syntax_error"
    stranges: list[Any] = [str(good), 7, "\0", str(tmp_path / "none.py")]
    for strange in stranges:
        found = told(SyntaxError("never closed", (strange, 3, 1, "x")))
        assert (found.code, found.type, found.message) == ("exception", "SyntaxError", "never closed")


#: A program, and the exception of its chain that is told: the type and the line.
CHAINS = {
    "finally": ("try:\n    node = int('x')\nfinally:\n    node.destroy()\n", "ValueError", 2),
    "a bare except": ("try:\n    int('x')\nexcept:\n    undefined\n", "ValueError", 2),
    "except Exception": ("try:\n    int('x')\nexcept Exception as error:\n    undefined\n", "ValueError", 2),
    "raised in its place": (
        "try:\n    int('x')\nexcept ValueError as e:\n    raise KeyError() from e\n",
        "ValueError",
        2,
    ),
    "two links": (
        "try:\n    try:\n        int('x')\n    finally:\n        undefined\nfinally:\n    [][0]\n",
        "ValueError",
        3,
    ),
    "an expected one": ("try:\n    int('x')\nexcept ValueError:\n    undefined\n", "NameError", 4),
    "several expected ones": ("try:\n    int('x')\nexcept (ValueError, KeyError):\n    undefined\n", "NameError", 4),
    "an expected one, in a function": (
        "def spare():\n    return undefined\ntry:\n    int('x')\nexcept ValueError:\n    spare()\n",
        "NameError",
        2,
    ),
    "an expected one before a chain": (
        "try:\n    int('x')\nexcept ValueError:\n    try:\n        undefined\n    finally:\n        [][0]\n",
        "NameError",
        5,
    ),
    "hidden by the program": (
        "try:\n    int('x')\nexcept Exception:\n    raise KeyError('speed') from None\n",
        "KeyError",
        4,
    ),
    "of a library": ("import json\njson.loads('{')\n", "json.decoder.JSONDecodeError", 2),
    "after Ctrl-C": ("try:\n    raise KeyboardInterrupt\nfinally:\n    undefined\n", "NameError", 4),
}


@pytest.mark.parametrize(("program", "kind", "line"), CHAINS.values(), ids=list(CHAINS))
def test_the_first_exception_of_a_chain_is_told(tmp_path: Path, program: str, kind: str, line: int) -> None:
    """But not one that the program was ready for."""
    file = tmp_path / "node.py"
    file.write_text(program)
    with pytest.raises((Exception, KeyboardInterrupt)) as caught:
        exec(compile(program, str(file), "exec"), {})
    told = faults.Describer(str(tmp_path)).exception(caught.value)
    assert (told.type, told.file, told.line) == (kind, "node.py", line)
