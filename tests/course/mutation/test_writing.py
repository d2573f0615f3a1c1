"""Notes that a self-test writes: what is not explained yet, with a reason for the author to fill in."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from grader.course.mutation.explained import Explained, read_explained
from grader.course.mutation.results import SelftestResult, Trial, TrialResult
from grader.course.mutation.writing import noted, trial_pattern
from grader.grading.model.exercise import Outcome
from grader.grading.rubrics.builtin import builtin_rubrics
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.errors import GraderError

EXERCISE = read_rubric(builtin_rubrics()["velocity_publisher"])
OUTCOMES = {criterion.id: Outcome.MET for criterion in EXERCISE.criteria}
FULL = TrialResult(Fraction(30), Fraction(30), OUTCOMES, {})
LOST = replace(FULL, score=Fraction(20), outcomes={**OUTCOMES, "rate": Outcome.NOT_MET})
OLD = """\
schema: grader/selftest-notes/v1
reference: right

survivors:
    # the end
    - mutants: "*:no node.destroy_node()"
      because: the end of the process takes the node with it  # really

# which should detect which
expected:
  - {mutants: "*:period:*", killed_by: [rate]}
"""


def trial(id_: str, result: TrialResult = FULL) -> Trial:
    """Return a trial of an id, with a change of two lines."""
    return Trial(id_, "a.py", id_.split(":")[2], "a => b", result, diff="@@ -1 +1 @@\n-a\n+b")


def outcome_of(*mutants: Trial, variants: tuple[Trial, ...] = (), whole: bool = False) -> SelftestResult:
    """Return the result of testing a rubric in the current folder."""
    return SelftestResult("mine.yaml", EXERCISE.id, tuple(OUTCOMES), FULL, None, None, mutants, variants, whole=whole)


def read(folder: Path, text: str) -> Explained:
    """Return what notes of this text say."""
    path = folder / "mine.selftest.yaml"
    path.write_text(text, encoding="utf-8")
    return read_explained(path, EXERCISE)


def test_new_notes_name_the_folders_and_hold_what_is_not_explained(tmp_path: Path) -> None:
    """Each entry once, for any line, with its change above it and a reason to fill in, which explains nothing yet."""
    mutants = (trial("a.py:3:text:[x?]*"), trial("a.py:9:text:[x?]*"), trial("a.py:5:period:1", LOST))
    variants = (trial("a.py:loop_for_timer:x", LOST),)
    text, count = noted(
        outcome_of(*mutants, variants=variants, whole=True), None, reference=Path("right"), template=Path("start")
    )
    said = read(tmp_path, text)
    assert (said.reference, said.template) == (tmp_path / "right", tmp_path / "start")
    assert [note.because for note in (*said.survivors, *said.variants)] == ["", ""]
    assert count == 2 + len(said.criteria) == 2 + len(OUTCOMES) - 1
    assert set(said.criteria.values()) == {""}
    assert all(said.survivors[0].fits(mutant.id) for mutant in mutants[:2])
    assert not said.survivors[0].fits("a.py:3:text:x")
    assert said.variants[0].fits(variants[0].id)
    assert text.count("# -a") == 2
    filled = read(tmp_path, text.replace("because:", "because: it does no harm"))
    assert {note.because for note in (*filled.survivors, *filled.variants)} == {"it does no harm"}


def test_notes_that_are_there_are_kept(tmp_path: Path) -> None:
    """Word for word, with their comments; new entries stand at the end of their list."""
    text, count = noted(outcome_of(trial("a.py:3:text:x")), OLD, reference=Path("other"), template=None)
    assert count == 1
    added = [line for line in text.splitlines() if line not in OLD.splitlines()]
    assert added == ["    # @@ -1 +1 @@", "    # -a", "    # +b", '    - mutants: "a.py:*:text:x"', "      because:"]
    said = read(tmp_path, text)
    assert [note.pattern for note in said.survivors] == ["*:no node.destroy_node()", "a.py:*:text:x"]
    assert said.expected[0].criteria == ("rate",)


@pytest.mark.parametrize("old", [OLD.partition("\nsurvivors")[0], OLD.partition("\nsurvivors")[0] + "survivors: []\n"])
def test_a_list_that_is_not_there_is_begun(tmp_path: Path, old: str) -> None:
    """Or one that is empty."""
    text, _ = noted(outcome_of(trial("a.py:3:text:x")), old, reference=None, template=None)
    assert [note.pattern for note in read(tmp_path, text).survivors] == ["a.py:*:text:x"]


def test_a_list_in_one_line_is_refused() -> None:
    """With its place."""
    old = OLD.partition("\nsurvivors")[0] + 'survivors: [{mutants: "*", because: x}]\n'
    with pytest.raises(GraderError, match=r"mine\.selftest\.yaml:3: expected a line for each entry under `survivors`"):
        noted(outcome_of(trial("a.py:3:text:x")), old, reference=None, template=None)


def test_nothing_to_explain_changes_nothing() -> None:
    """The text is the same."""
    assert noted(outcome_of(trial("a.py:5:period:1", LOST)), OLD, reference=None, template=None) == (OLD, 0)


@pytest.mark.parametrize("id_", ["a.py:3:text:[x?]*", "a.py:12:constant:20 -> 19 #2", "a.py:renamed_nodes"])
def test_a_pattern_fits_what_it_was_made_of(tmp_path: Path, id_: str) -> None:
    """Whatever signs it holds."""
    made = Trial(id_, "a.py", "text", "", FULL)
    notes = f"schema: grader/selftest-notes/v1\nsurvivors:\n  - {{mutants: '{trial_pattern(made)}', because: x}}\n"
    assert read(tmp_path, notes).survivors[0].fits(id_)
