"""Commands in reports: a shell reads them as they were meant."""

from __future__ import annotations

import shlex
import subprocess
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.grading.reporting.escape import shell_line, shell_quoted

WORDS = st.lists(st.text(alphabet=st.characters(blacklist_categories=["Cs"], min_codepoint=1), max_size=20), min_size=1)


def test_plain_words_stay_plain() -> None:
    """The usual command is what a person would type."""
    assert shell_line(["grade", "./ada", "--seed", "7"]) == "grade ./ada --seed 7"


@given(WORDS)
def test_the_line_is_one_printable_line(words: Sequence[str]) -> None:
    """No name can break the line or steer the terminal that it is pasted into."""
    assert shell_line(words).isprintable()


@given(st.lists(st.text(alphabet=st.characters(min_codepoint=32, max_codepoint=126), max_size=20), min_size=1))
def test_printable_words_are_read_back(words: Sequence[str]) -> None:
    """Whatever a printable path holds, it comes out as it went in."""
    assert shlex.split(shell_line(words)) == words


@pytest.mark.parametrize("word", ["a\nb", "it's\t\\", "\x1b[2J", "\u202efdp", "bad \udcff byte", "", "~ada", "$(id)"])
def test_bash_reads_unprintable_words_back(word: str) -> None:
    """Bytes that are no UTF-8 included."""
    script = f"printf %s {shell_quoted(word)}"
    done = subprocess.run(["bash", "-c", script], capture_output=True, check=True, env={"LC_ALL": "C.UTF-8"})
    assert done.stdout == word.encode("utf-8", "surrogateescape")
