"""Asks pytest whether the tests of a rubric can be collected, for the rubric's author."""

from __future__ import annotations

from pathlib import Path

from grader.grading.app.interfaces import rubric_modules
from grader.grading.model.exercise import Exercise
from grader.runtime.model.errors import RubricError
from grader.runtime.model.wording import printable
from grader.runtime.session import collected_tests


def collect_tests(path: Path, exercise: Exercise, course: tuple[Path, ...] = ()) -> None:
    """Let pytest import the file of a rubric's tests.

    Args:
        path: The rubric.
        exercise: What was read from it.
        course: Folders of interface packages.

    Raises:
        RubricError: The file cannot be imported, or pytest finds other tests in it than were read.
        EnvironmentFault: pytest is not installed.
    """
    tests = [scenario.test for scenario in exercise.scenarios if scenario.test is not None]
    if not tests:
        return
    found, mistake = collected_tests(tests[0], [str(folder) for folder in rubric_modules(exercise, course)])
    where = printable(str(path.parent / tests[0].file), 500)
    if mistake is not None:
        raise RubricError(f"{where}:{mistake.line or 1}: {printable(mistake.text, 300)}")
    known = [test.name for test in tests]
    strange = next((name for name in found if name not in known), "")
    if strange:
        text = f"expected tests that can be read from the file, found {printable(strange)}, which only pytest finds"
        hint = "write each test as a function of the file, with ids that are written out"
        raise RubricError(f"{where}:1: {text}", hint)
    missed = next((name for name in known if name not in found), "")
    if missed:
        raise RubricError(f"{where}:1: expected pytest to collect {printable(missed)}, but it does not")
