"""A program that works out beforehand what it will be asked, from its own files and whatever key everybody has."""

from pathlib import Path

import pytest
from decided import grade_until_decided

from grader.grading.app.request import GradeRequest
from grader.grading.app.seeds import PRACTICE, SeedKey

PROGRAM = str(Path(__file__).resolve().parent / "foreknowledge")

pytestmark = pytest.mark.ros


def logged(key: SeedKey) -> str:
    """Return what the program gets for logging values that it never read."""
    request = GradeRequest(PROGRAM, exercises=("two_node_communication",), seed_key=key)
    report = grade_until_decided(request)
    return next(v.outcome.value for v in report.exercises[0].verdicts if v.id == "logs_fan_speed")


@pytest.mark.nightly
def test_who_knows_the_key_knows_the_questions() -> None:
    """So a run with the practice key is nobody's mark; and the program below is able to do what it tries."""
    assert logged(PRACTICE) == "met"


@pytest.mark.breadth(0, 1)
@pytest.mark.parametrize("key", [b"a key of some class", b"the key of another class"])
def test_without_the_key_of_the_class_nobody_knows_them(key: bytes) -> None:
    """The files are the same, the values are not."""
    assert logged(SeedKey(key)) == "not_met"
