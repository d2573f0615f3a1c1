"""The test submissions and what they are worth belong together: each folder has its entry, each entry its folder."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from archive import exercises_by_id
from sample_folders import GROUPS, SHAPES, collection_of, collections, expected, expected_in, folder_of

from grader.grading.model.exercise import Outcome
from grader.grading.rubrics.builtin import builtin_rubrics

NOT_PYTHON = {
    "broken/syntax_error",
    "broken/mixed_tabs",
    "broken/python2_print",
    "broken/null_bytes",
    "broken/notebook_magic",
}
MISSPELT = {"broken/misspelt_file", "broken/controller_missing", "broken/notebook_file"}
#: Right programs that import a ROS package which the wheels lack.
LACKING = {"broken/ros_package_missing"}

#: By exercise: the files that students write, the ids of the criteria, and the name of its folder.
FILES = {id_: set(exercise.files) for id_, exercise in exercises_by_id().items()}
CRITERIA = {id_: {criterion.id for criterion in exercise.criteria} for id_, exercise in exercises_by_id().items()}
HOMES = {id_: path.parent.name for id_, path in builtin_rubrics().items()}


def test_every_folder_is_listed() -> None:
    """No submission is forgotten, none is expected that is not there, and no name is taken twice."""
    folders = [f"{path.parent.name}/{path.name}" for c in collections() for g in GROUPS for path in (c / g).glob("*/")]
    assert sorted(folders) == sorted(expected())
    assert sum(len(expected_in(collection)) for collection in collections()) == len(expected())


def test_entries_are_well_formed() -> None:
    """Ids and outcomes are those of the exercises; undecided is only what this installation lacks."""
    wrong = {name: found for name, entry in expected().items() if (found := list(faults_of(name, entry)))}
    assert wrong == {}


def faults_of(name: str, entry: dict[str, Any]) -> Iterator[str]:
    """Yield what is wrong with an entry."""
    if set(entry) != {"about", "graded", "expected"}:
        yield f"keys: {sorted(entry)}"
        return
    outcomes = entry["expected"]
    if unknown := set(outcomes) - set().union(*(CRITERIA[e] for e in entry["graded"])):
        yield f"no criteria of {entry['graded']}: {sorted(unknown)}"
    allowed = {Outcome.UNDECIDED} if name in LACKING else {Outcome.PARTLY, Outcome.NOT_MET, Outcome.BLOCKED}
    if other := set(outcomes.values()) - {o.value for o in allowed}:
        yield f"outcomes: {sorted(other)}"
    if name.startswith(("correct/", "threads/")) and outcomes != {}:
        yield "a right program loses nothing"
    if name.startswith("wrong/") and outcomes == {}:
        yield "a wrong program loses something"
    if collection_of(name) != SHAPES and [collection_of(name).name] != [HOMES[e] for e in entry["graded"]]:
        yield f"lies in {collection_of(name).name}, graded for {entry['graded']}"


def test_an_entry_that_is_not_well_formed_is_found() -> None:
    """Each rule can fail."""
    name = "wrong/velocity_10_hz"
    good = {"about": "", "graded": ["velocity_publisher"], "expected": {"rate": "not_met"}}
    assert list(faults_of(name, good)) == []
    changes: list[dict[str, Any]] = [{"note": ""}, *({"expected": e} for e in ({}, {"rat": "partly"}, {"rate": "met"}))]
    for change in changes:
        assert len(list(faults_of(name, good | change))) == 1, change
    assert len(list(faults_of("correct/velocity_class", good))) == 1
    assert len(list(faults_of(name, {"about": "", "graded": ["joint_publisher"], "expected": {"rate": "partly"}}))) == 1


def test_files_are_those_of_the_exercise() -> None:
    """Each exercise's files are there under their names, and those of no other exercise."""
    wrong = {}
    for name, entry in expected().items():
        files = {path.name for path in folder_of(name).rglob("*.py")}
        wanted = set().union(*(FILES[e] for e in entry["graded"]))
        others = set().union(*FILES.values()) - wanted
        if (wanted <= files) is (name in MISSPELT) or files & others:
            wrong[name] = sorted(files)
    assert wrong == {}


def test_files_compile() -> None:
    """Every file is Python that compiles without a warning, except where that is its fault."""
    wrong = {}
    for name in expected():
        found = [text for path in sorted(folder_of(name).rglob("*.py")) if (text := complaint(path))]
        if bool(found) is not (name in NOT_PYTHON):
            wrong[name] = found
    assert wrong == {}


def complaint(path: Path) -> str:
    """Return why a file is no Python; empty if it is."""
    try:
        compile(path.read_bytes(), str(path), "exec")
    except (SyntaxError, ValueError, Warning) as error:  # ValueError: how Python 3.11 and older say NUL bytes
        return f"{type(error).__name__}: {error}"
    return ""
