"""Notes on self-tests: what they say, and how their mistakes are told."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from grader.course.mutation.explained import Explained, read_explained
from grader.grading.model.rubric_files import notes_on, rubric_of
from grader.grading.rubrics.builtin import builtin_rubrics
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.errors import RubricError

EXERCISE = read_rubric(builtin_rubrics()["velocity_publisher"])
GOOD = """\
schema: grader/selftest-notes/v1
reference: ../right
template: start
template_score: 2.5
survivors:
  - mutants: "*:text:*"
    because: >
      the words
      are free
expected:
  - {mutants: "*:period:*", killed_by: [rate]}
variants:
  - {variants: "*:renamed_nodes", because: the name is asked for}
criteria:
  - {criterion: logging, because: nobody forgets it}
"""


def read(tmp_path: Path, text: str) -> Explained:
    """Return what notes of this text say."""
    path = tmp_path / "a.selftest.yaml"
    path.write_text(text, encoding="utf-8")
    explained = read_explained(path, EXERCISE)
    assert explained is not None
    return explained


def test_notes_lie_beside_their_rubric() -> None:
    """Their name tells them from rubrics, and says which rubric they are about."""
    assert notes_on(Path("x/a.yaml")) == Path("x/a.selftest.yaml")
    assert rubric_of(Path("x/a.selftest.yaml")) == Path("x/a.yaml")
    assert rubric_of(Path("x/a.yaml")) is None


def test_notes_on_a_rubric_in_the_folder_of_its_exercise(tmp_path: Path) -> None:
    """They need no name of their own, unless they have had one; a rubric of that name alone is none of them."""
    rubric, notes = tmp_path / "rubric.yaml", tmp_path / "selftest.yaml"
    assert rubric_of(notes) is None
    rubric.touch()
    assert (notes_on(rubric), rubric_of(notes)) == (notes, rubric)
    earlier = tmp_path / "rubric.selftest.yaml"
    earlier.touch()
    assert (notes_on(rubric), rubric_of(earlier)) == (earlier, rubric)


def test_what_notes_say(tmp_path: Path) -> None:
    """Folders are relative to the file, sentences are one line, and each explanation knows its place."""
    said = read(tmp_path, GOOD)
    assert (said.reference, said.template) == (tmp_path / "../right", tmp_path / "start")
    assert said.template_score == Fraction("2.5")
    (survivor,) = said.survivors
    assert survivor.because == "the words are free"
    assert survivor.where == f"{tmp_path}/a.selftest.yaml:6:5"
    assert survivor.fits("a.py:3:text:b")
    assert not survivor.fits("a.py:3:texts:b")
    assert said.expected[0].criteria == ("rate",)
    assert said.variants[0].because == "the name is asked for"
    assert said.criteria == {"logging": "nobody forgets it"}


def test_without_a_file_nothing_is_said(tmp_path: Path) -> None:
    """A rubric needs no notes."""
    assert read_explained(tmp_path / "none.selftest.yaml", EXERCISE).survivors == ()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "1:1: expected the key `schema`, found none"),
        ("schema: grader/rubric/v1\n", "1:9: expected `grader/selftest-notes/v1`, found `grader/rubric/v1`"),
        (
            GOOD.replace('mutants: "*:text:*"', "mutant: a"),
            "6:5: expected `mutants` or `because` in `survivors`, found `mutant`",
        ),
        (GOOD.replace("because: the name is asked for", "because: ''"), "13:35: "),
        (GOOD.replace("[rate]", "[speed]"), "11:41: expected a criterion of velocity_publisher ("),
        (GOOD.replace("[rate]", "[]"), "11:40: expected a list with at least one entry"),
        (GOOD.replace("2.5", "-1"), "4:17: "),
        (GOOD.replace("criterion: logging", "criterion: log"), "15:17: expected a criterion of velocity_publisher ("),
        (GOOD + "schema: twice\n", "16:1: expected each key once"),
        ("schema: [\n", "2:1: not valid YAML"),
    ],
)
def test_mistakes_are_told_with_their_place(tmp_path: Path, text: str, told: str) -> None:
    """Line and column, as in rubrics."""
    with pytest.raises(RubricError) as error:
        read(tmp_path, text)
    assert f"a.selftest.yaml:{told}" in error.value.message


def test_notes_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    """Another encoding, and a folder."""
    path = tmp_path / "a.selftest.yaml"
    path.write_bytes(b"schema: \xff\n")
    with pytest.raises(RubricError, match="expected UTF-8"):
        read_explained(path, EXERCISE)
    with pytest.raises(RubricError, match="cannot be read"):
        read_explained(tmp_path, EXERCISE)


@pytest.mark.parametrize("rubric", builtin_rubrics().values(), ids=builtin_rubrics())
def test_our_own_notes_can_be_read(rubric: Path) -> None:
    """Each rubric that comes with the grader has notes that name its reference and its template."""
    said = read_explained(notes_on(rubric), read_rubric(rubric))
    assert said.reference is not None
    assert said.template is not None
    assert said.reference.is_dir()
    assert said.template.is_dir()
