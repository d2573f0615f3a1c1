"""The check `installs`, and the notes in its place: flaws are told once, on one line, whatever names are in them."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import pytest
from tracing import Recording

from grader.grading.judging.checks.packages import Installs
from grader.grading.judging.installs import MOST_NOTES, notes_on_installing, told_flaw
from grader.grading.model.exercise import Location
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.projects import ExaminedPackage, FlawKind, InstallFlaw

RIGHT = ExaminedPackage("talk", "src/talk")
FLAW = InstallFlaw(FlawKind.NO_FILE, "src/robot/setup.py", 12, ("resource/robot", "share"))
ELSEWHERE = InstallFlaw(FlawKind.SCRIPT_FOLDER, "src/robot/setup.cfg", 0, ("robot", ""))
WRONG = ExaminedPackage("robot", "src/robot", (FLAW, ELSEWHERE))


@pytest.mark.parametrize(
    ("package", "packages", "credit", "reason"),
    [
        ("", (RIGHT,), 1, "talk: nothing is missing for colcon build"),
        ("talk", (WRONG, RIGHT), 1, "talk: nothing is missing for colcon build"),
        (
            "",
            (RIGHT, WRONG),
            0,
            "src/robot/setup.py:12: it installs resource/robot, which is not there, so the build fails; 1 more flaw",
        ),
        ("drive", (RIGHT, WRONG), 0, "submission: expected a package drive, found talk, robot"),
        ("", (), 0, "submission: expected a ROS package, found no package.xml"),
    ],
)
def test_packages_that_are_asked_for_have_to_install(
    package: str, packages: Sequence[ExaminedPackage], credit: int, reason: str
) -> None:
    """All of them, or the one that the rubric names."""
    finding = Installs(package).judge_packages(tuple(packages))
    assert (finding.credit, finding.reason) == (Fraction(credit), reason)


def test_the_first_flaw_gives_place_and_hint() -> None:
    """The evidence has the others."""
    finding = Installs().judge_packages((WRONG,))
    assert finding.location == Location("src/robot/setup.py", 12)
    assert finding.hint == "create it, as an empty file"
    assert len(finding.evidence["flaws"]) == 2


def test_a_recording_alone_says_nothing_of_packages() -> None:
    """A report of an older submission leaves the criterion undecided."""
    with pytest.raises(HarnessError, match="packages"):
        Installs().judge(Recording().trace())


def test_notes_name_the_first_flaws_and_count_the_rest() -> None:
    """A workspace that was never built has many."""
    notes = notes_on_installing([ExaminedPackage("robot", "", (FLAW,) * (MOST_NOTES + 2)), RIGHT])
    assert len(notes) == MOST_NOTES + 1
    assert notes[-1] == "2 more things would not be installed by colcon build"
    assert notes_on_installing([RIGHT]) == ()


@pytest.mark.parametrize("kind", FlawKind)
def test_names_of_a_package_are_told_in_one_line(kind: FlawKind) -> None:
    """Whatever a student calls them."""
    names = {FlawKind.MANIFEST: ("email", "{0}{x.__class__}\n")}.get(kind, ("{0}\n", "a\nb", "c\td"))
    exact = {
        FlawKind.BUILD_TYPE: 0,
        **dict.fromkeys((FlawKind.NO_SETUP, FlawKind.PROJECT_NAME, FlawKind.SETUP_NAME, FlawKind.NO_FOLDER), 2),
        **dict.fromkeys((FlawKind.SCRIPT_FOLDER, FlawKind.UNDECLARED), 2),
    }
    sentence, hint = told_flaw(InstallFlaw(kind, "a\nb/package.xml", 1, names[: exact.get(kind, 3)]))
    assert "\n" not in sentence + hint
    assert sentence.startswith("a b/package.xml:1: ")
