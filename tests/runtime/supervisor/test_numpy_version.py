"""Which numpy programs run with, and what another one than that of the ROS release leaves undecided."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from places import ROOT

from grader.grading.judging.checks.fields import FieldEqual
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.model.exercise import Criterion, Exercise
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import AssessedTrace, OtherNumpy
from grader.runtime.recording.codec import trace_to_json
from grader.runtime.recording.packed import trace_from_json
from grader.runtime.supervisor import numpy_version
from grader.testing import TraceBuilder

FILE = "brightness.py"
FLOAT = "std_msgs/msg/Float32"
OTHER = OtherNumpy("2.4", "1.26", "jazzy")
#: 44.0 with numpy 1, whose sum is an int64; with numpy 2 it does not fit, or wraps around.
USES = "import numpy as np\nvalue = float(np.uint8(200) + np.uint8(100))\n"


@pytest.fixture(autouse=True)
def fresh() -> Iterator[None]:
    """Forget what was found with a version that a test made up."""
    numpy_version.other_numpy.cache_clear()
    yield
    numpy_version.other_numpy.cache_clear()


@pytest.mark.parametrize(
    ("here", "distro", "other"),
    [
        ("1.26.4", "jazzy", None),
        ("2.4.6", "jazzy", OTHER),
        ("2.4.6", "humble", OtherNumpy("2.4", "1.21", "humble")),
        ("1.26.4", "humble", None),
        ("2.4.6", "rolling", None),
    ],
)
def test_another_numpy_is_one_of_another_major_version(
    monkeypatch: pytest.MonkeyPatch, here: str, distro: str, other: OtherNumpy | None
) -> None:
    """Types of results have changed with numpy 2; what an unknown release has is not known."""
    monkeypatch.setattr(numpy_version, "version", lambda name: here)
    assert numpy_version.other_numpy(distro) == other


def test_pythons_for_which_it_exists_get_the_numpy_of_the_release() -> None:
    """By the requirements of the package itself."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = [Requirement(text) for text in project["dependencies"]]
    (numpy,) = [one for one in wanted if one.name == "numpy"]
    assert "1.26.4" in numpy.specifier
    assert "2.0.0" not in numpy.specifier
    assert numpy.marker is not None
    assert [numpy.marker.evaluate({"python_version": one}) for one in ("3.11", "3.12", "3.13")] == [True, True, False]


def outcome(text: str, trace: TraceBuilder, *, other: OtherNumpy | None = OTHER) -> tuple[str, str]:
    """Return the outcome of a criterion on a value, and its reason."""
    criterion = Criterion("value", "Publishes 44", Fraction(4), "alone", FieldEqual("/x", {"data": 44.0}))
    alone = Scenario("alone", (FILE,), Span(10**10))
    exercise = Exercise("e", "1", "E", True, (FILE,), (alone,), (criterion,), "sha256:0")
    submission = Submission("s", "s", Path("s"), "sha256:1", {FILE: StudentFile(FILE, FILE)})
    recorded: Mapping[str, AssessedTrace] = {"alone": replace(trace.trace(), other_numpy=other)}
    (verdict,) = judge_exercise(exercise, recorded, submission, {FILE: text}).verdicts
    return verdict.outcome.value, verdict.reason


def sends(value: float) -> TraceBuilder:
    return TraceBuilder(FILE).messages("/x", FLOAT, {"data": value}, rate_hz=10)


def test_what_may_differ_by_numpy_is_undecided_and_named() -> None:
    """A wrong value as well as an exception about its type."""
    raises = TraceBuilder(FILE).fault(1.0, "AssertionError: The 'data' field must be of type 'float'", line=2)
    for trace in (sends(300.0), raises):
        found = outcome(USES, trace)
        assert found[0] == "undecided"
        assert found[1].startswith("the program uses numpy, of which ROS 2 jazzy has 1.26 and this machine 2.4")
    assert outcome(USES, sends(44.0))[0] == "met"


def test_anything_else_is_decided() -> None:
    """With the numpy of the release, without numpy, and where another exception has ended the program."""
    assert outcome(USES, sends(300.0), other=None)[0] == "not_met"
    assert outcome("value = 300.0\n", sends(300.0))[0] == "not_met"
    misspelt = TraceBuilder(FILE).fault(1.0, "NameError: name 'vlaue' is not defined", line=2)
    assert outcome(USES, misspelt)[0] == "not_met"


def test_a_recording_says_which_numpy_it_was_made_with() -> None:
    """It is judged again in the same way."""
    trace = replace(sends(300.0).trace(), other_numpy=OTHER)
    assert trace_from_json(trace_to_json(trace)).other_numpy == OTHER
