"""Checks that share a class: rubrics may use both names, and both give the same points for every recording."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from archive import judged, recorded_of
from sample_folders import EXERCISES

from grader.grading.model.exercise import Exercise
from grader.grading.model.report import Report, Verdict
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.shipped import shipped

TWINS = {
    "exercise_1": [
        (
            "field_values: {topic: /cmd_vel, values: {linear.x: 0.5, linear.y: 0, linear.z: 0}}",
            "field_equal: {topic: /cmd_vel, fields: {linear.x: 0.5, linear.y: 0, linear.z: 0}}",
        ),
        (
            "field_values: {topic: /cmd_vel, values: {angular.x: 0, angular.y: 0, angular.z: 0.1}}",
            "field_equal: {topic: /cmd_vel, fields: {angular.x: 0, angular.y: 0, angular.z: 0.1}}",
        ),
    ],
    "exercise_3": [
        (
            "bidirectional_graph: {forward: /temperature, back: /fan_speed}",
            "graph_edges: {between_processes: true, at_once: true, "
            "edges: [{topic: /temperature}, {topic: /fan_speed}]}",
        ),
    ],
}


def with_twins(name: str, folder: Path) -> Exercise:
    """Read the rubric of an exercise with each check replaced by its twin."""
    shutil.copytree(shipped("rubrics") / name, folder, ignore=shutil.ignore_patterns("__pycache__"))
    path = folder / "rubric.yaml"
    text = path.read_text(encoding="utf-8")
    for usual, twin in TWINS[name]:
        assert usual in text
        text = text.replace(usual, twin)
    path.write_text(text, encoding="utf-8")
    return read_rubric(path)


def of_twins(report: Report, exercise: Exercise) -> list[Verdict]:
    names = {line.partition(":")[0] for pairs in TWINS.values() for pair in pairs for line in pair}
    ids = {criterion.id for criterion in exercise.criteria if criterion.check_name in names}
    return [verdict for part in report.exercises for verdict in part.verdicts if verdict.id in ids]


@pytest.mark.nightly
@pytest.mark.breadth(0, 1)
@pytest.mark.parametrize("name", TWINS)
def test_twins_judge_every_recording_alike(tmp_path: Path, name: str) -> None:
    """The same outcome, points and problem."""
    usual, twin = read_rubric(shipped("rubrics") / name / "rubric.yaml"), with_twins(name, tmp_path / name)
    compared = lost = 0
    for sample, recorded in recorded_of(EXERCISES / name).items():
        both = [of_twins(judged(recorded, {exercise.id: exercise}), exercise) for exercise in (usual, twin)]
        for one, other in zip(*both, strict=True):
            assert (one.outcome, one.score, one.problem) == (other.outcome, other.score, other.problem), sample
            compared, lost = compared + 1, lost + (one.score < one.max_score)
    assert compared > lost > 10


@pytest.mark.nightly
def test_each_name_keeps_the_form_of_its_evidence(tmp_path: Path) -> None:
    """Of `graph_edges`, edges are texts; of `bidirectional_graph`, each is a list of node, topic and node."""
    usual = read_rubric(shipped("rubrics") / "exercise_3" / "rubric.yaml")
    twin = with_twins("exercise_3", tmp_path / "exercise_3")
    kinds: dict[bool, set[type]] = {False: set(), True: set()}
    for recorded in recorded_of(EXERCISES / "exercise_3").values():
        for exercise in (usual, twin):
            for verdict in of_twins(judged(recorded, {exercise.id: exercise}), exercise):
                kinds[exercise is twin] |= {type(edge) for edge in verdict.evidence.get("edges", [])}
    assert kinds == {False: {list}, True: {str}}
