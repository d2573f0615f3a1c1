"""Tests that a rubric names: which criteria they are, as read from the text of their file, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest

from grader.course.authoring.checking import check_rubric
from grader.course.packaging import Chosen, gradescope
from grader.grading.app.test_files import collect_tests
from grader.grading.evidence.manifest import scenario_digest
from grader.grading.model.exercise import Exercise
from grader.grading.rubrics.loader import read_rubric, side_files
from grader.runtime.model.errors import RubricError

RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: robot, number: "1", title: Robot}
files: [robot.py]
pytest: tests/test_robot.py
"""
BEGIN = "import pytest\n\n\n"
Write = Callable[[str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a rubric with a file of tests, and return its path."""

    def written(tests: str) -> Path:
        (tmp_path / "tests").mkdir(exist_ok=True)
        (tmp_path / "tests/test_robot.py").write_text(BEGIN + tests)
        (tmp_path / "rubric.yaml").write_text(RUBRIC)
        return tmp_path / "rubric.yaml"

    return written


SEVERAL = '''
@pytest.mark.points("1/3", hint="spin  the node", needs=[])
def test_spins(ros):
    """It spins.

    Forever.
    """


@pytest.mark.points(2, needs="test_spins")
@pytest.mark.parametrize("speed", [0.5, -0.5, True, None, "fast", (1, 2)])
@pytest.mark.parametrize(("x", "y"), [(1, 2), pytest.param(3, 4, id="far out", marks=pytest.mark.points(2.5))])
def test_drives(ros, x, y, speed):
    pass


@pytest.mark.points(1)
@pytest.mark.parametrize("n", range(2), ids=["one", "two"])
class TestStop:
    def test_wall(self, ros, n):
        pass

    @pytest.mark.points(4)
    def test_cliff(self, ros, n):
        pass

    def helper(self):
        pass


@pytest.fixture
def test_data():
    return 1
'''


def names(exercise: Exercise) -> list[str]:
    """Return what pytest calls the tests of an exercise."""
    return [scenario.test.name for scenario in exercise.scenarios if scenario.test is not None]


@pytest.mark.slow
def test_ids_titles_and_points_are_those_that_pytest_collects(write: Write) -> None:
    """The text of the file says which tests pytest will collect, by the same names."""
    rubric = write(SEVERAL.replace("@pytest.fixture\ndef test_data():\n    return 1\n", ""))
    exercise = read_rubric(rubric)
    collect_tests(rubric, exercise)  # raises RubricError if pytest finds others
    first, second, *_ = exercise.criteria
    assert (first.id, first.title, first.points, first.hint) == (
        "test_spins",
        "It spins",
        Fraction(1, 3),
        "spin the node",
    )
    assert second.id == "test_drives_1_2_0_5"
    assert second.title == "Drives (1-2-0.5)"
    assert second.needs == ("test_spins",)
    points = {c.id: c.points for c in exercise.criteria}
    assert points["test_drives_far_out__0_5"] == Fraction(5, 2)
    assert points["teststop__test_wall_one"] == 1
    assert points["teststop__test_cliff_one"] == 4
    assert len(points) == len(exercise.criteria) == len(names(exercise)) == 1 + 12 + 4


@pytest.mark.parametrize(
    ("tests", "line", "said"),
    [
        ("def test_a(ros): pass", 4, "`test_a`: expected @pytest.mark.points(N) above the test"),
        ("@pytest.mark.points(0)\ndef test_a(ros): pass", 4, "points above 0"),
        ("@pytest.mark.points(-2)\ndef test_a(ros): pass", 4, "points above 0"),
        ("@pytest.mark.points('six')\ndef test_a(ros): pass", 4, "points such as 6, 2.5 or 1/3"),
        ("@pytest.mark.points(True)\ndef test_a(ros): pass", 4, "points such as 6, 2.5 or 1/3"),
        ("@pytest.mark.points\ndef test_a(ros): pass", 4, "the points as in @pytest.mark.points(3)"),
        ("@pytest.mark.points(MANY)\ndef test_a(ros): pass", 4, "written out, found MANY"),
        ("@pytest.mark.points(1, worth=2)\ndef test_a(ros): pass", 4, "hint or needs beside the points, found `worth`"),
        ("@pytest.mark.points(1, hint=3)\ndef test_a(ros): pass", 4, "hint as a text"),
        ("@pytest.mark.points(1)\n@pytest.mark.skip\ndef test_a(ros): pass", 5, "no @pytest.mark.skip"),
        ("@pytest.mark.points(1)\n@pytest.mark.xfail()\ndef test_a(ros): pass", 5, "no @pytest.mark.xfail"),
        ("@pytest.mark.points(1)\n@pytest.mark.ros(seeds=3)\ndef test_a(ros): pass", 5, "no `seeds`"),
        (
            "@pytest.mark.points(1)\n@pytest.mark.parametrize('x', range(3))\ndef test_a(ros, x): pass",
            5,
            "a list of values that is written out, or ids",
        ),
        (
            "@pytest.mark.points(1)\n@pytest.mark.parametrize('x', [A, B])\ndef test_a(ros, x): pass",
            5,
            "written out, found A",
        ),
        (
            "@pytest.mark.points(1)\n@pytest.mark.parametrize('x', [1, 1])\ndef test_a(ros, x): pass",
            5,
            "found `1` again: give them ids",
        ),
        (
            "@pytest.mark.points(1)\ndef test_a(ros): pass\n@pytest.mark.points(1)\ndef test_A(ros): pass",
            7,
            "found `test_a` for test_a, line 5",
        ),
        (
            "@pytest.mark.points(1)\n@pytest.mark.parametrize('x', ['zwö'])\ndef test_a(ros, x): pass",
            5,
            "an id of printable ASCII characters, found zwö",
        ),
        ("@pytest.mark.points(1)\nasync def test_a(ros): pass", 5, "expected `def`, found `async def`"),
        ("@pytest.mark.points(1)\nclass TestA(Base):\n    def test_a(self, ros): pass", 5, "a class of tests without"),
        (
            "@pytest.fixture(params=[1, 2])\ndef n(request): pass\n@pytest.mark.points(1)\ndef test_a(ros, n): pass",
            5,
            "a fixture without params",
        ),
        ("def check_a(ros): pass", 1, "expected tests, which are functions whose names begin with test_, found none"),
        ("def test_a(:", 4, "expected Python, found SyntaxError"),
    ],
)  # fmt: skip
def test_mistakes_are_refused_with_their_line(write: Write, tests: str, line: int, said: str) -> None:
    """A file whose tests cannot be read as criteria is refused when the rubric is read, before anything runs."""
    rubric = write(tests)
    with pytest.raises(RubricError) as refused:
        read_rubric(rubric)
    assert said in refused.value.message
    assert refused.value.message.startswith(f"{rubric.parent / 'tests/test_robot.py'}:{line}:")


def test_needs_name_earlier_criteria(write: Write) -> None:
    """A test may need a criterion that comes before it, and no other."""
    one = "@pytest.mark.points(1, needs='test_b')\ndef test_a(ros): pass\n"
    with pytest.raises(RubricError, match=r"rubric.yaml:4:9: tests/test_robot.py:5: `test_a`: .*found `test_b`"):
        read_rubric(write(f"{one}@pytest.mark.points(1)\ndef test_b(ros): pass\n"))


def test_ids_are_not_those_of_other_criteria(write: Write, tmp_path: Path) -> None:
    """A test has a name that no criterion and no scenario of the rubric has."""
    write("@pytest.mark.points(1)\ndef test_a(ros): pass\n")
    checks = """
scenarios: [{id: test_a, processes: [robot.py], observe: {duration: 5 s}}]
criteria:
  - {id: hears, title: T, points: 1, scenario: test_a, check: {uses_logger: {process: robot.py}}}
"""
    (tmp_path / "rubric.yaml").write_text(RUBRIC + checks)
    with pytest.raises(RubricError, match="expected a new id, found `test_a`, which is taken"):
        read_rubric(tmp_path / "rubric.yaml")


@pytest.mark.parametrize("name", ["../test_robot.py", "/etc/passwd", "test_robot.txt", "[1]"])
def test_the_file_lies_beside_the_rubric(tmp_path: Path, name: str) -> None:
    """A rubric names no file elsewhere."""
    (tmp_path / "rubric.yaml").write_text(RUBRIC.replace("tests/test_robot.py", name))
    with pytest.raises(RubricError, match=r"rubric.yaml:4:9: "):
        read_rubric(tmp_path / "rubric.yaml")


def test_a_student_cannot_write_it(write: Write, tmp_path: Path) -> None:
    """A file of tests in a folder of submissions is refused, as a file of checks is."""
    rubric = write("@pytest.mark.points(1)\ndef test_a(ros): pass\n")
    with pytest.raises(RubricError, match="expected a file that students cannot write"):
        read_rubric(rubric, submissions=[tmp_path / "tests"])


def test_its_text_is_part_of_the_rubric(write: Write) -> None:
    """Another text is another rubric and another scenario; where the rubric goes, the file goes too."""
    test = "@pytest.mark.points(1)\ndef test_a(ros):\n    assert {}\n"
    before = read_rubric(rubric := write(test.format(1)))
    after = read_rubric(write(test.format(2)))
    assert before.digest != after.digest
    assert scenario_digest(before.scenarios[0]) != scenario_digest(after.scenarios[0])
    assert [file.name for file in side_files(rubric)] == ["tests/test_robot.py"]


def test_tests_and_checks_go_together(write: Write, tmp_path: Path) -> None:
    """A rubric may have criteria of both kinds; those of the tests come last, and may need the others."""
    write("@pytest.mark.points(1, needs='logs')\ndef test_a(ros): pass\n")
    checks = """
scenarios: [{id: alone, processes: [robot.py], observe: {duration: 5 s}}]
criteria:
  - {id: logs, title: T, points: 1, scenario: alone, check: {uses_logger: {process: robot.py}}}
"""
    (tmp_path / "rubric.yaml").write_text(RUBRIC + checks)
    assert [criterion.id for criterion in read_rubric(tmp_path / "rubric.yaml").criteria] == ["logs", "test_a"]


def test_without_tests_a_rubric_needs_scenarios_and_criteria(tmp_path: Path) -> None:
    """Only a rubric that names tests may lack the others."""
    (tmp_path / "rubric.yaml").write_text(RUBRIC.replace("pytest: tests/test_robot.py\n", ""))
    with pytest.raises(RubricError, match="expected the key `criteria`, found none"):
        read_rubric(tmp_path / "rubric.yaml")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tests", "said"),
    [
        ("import nothing_of_the_kind\n@pytest.mark.points(1)\ndef test_a(ros): pass\n", ":4: ModuleNotFoundError: "),
        ("LIMIT = 1 / 0\n@pytest.mark.points(1)\ndef test_a(ros): pass\n", ":4: ZeroDivisionError: division by zero"),
        (
            "@pytest.mark.points(1)\ndef test_a(ros): pass\nif True:\n    def test_b(ros): pass\n",
            "found test_b, which only pytest finds",
        ),
        ("@pytest.mark.points(1)\ndef test_a(ros): pass\ndel test_a\n", "expected pytest to collect test_a"),
    ],
)
def test_check_asks_pytest(write: Write, tests: str, said: str) -> None:
    """`grade rubric check` imports the file, and says where pytest finds other tests in it."""
    with pytest.raises(RubricError) as refused:
        check_rubric(write(tests))
    assert said in refused.value.message


@pytest.mark.slow
def test_check_counts_them(write: Write) -> None:
    """`grade rubric check` sums up a rubric of tests, and says which ones give no advice."""
    checked = check_rubric(write("@pytest.mark.points(5)\ndef test_a(ros): pass\n"))
    assert checked.summary.endswith("robot: 1 scenario, 1 criterion, 5 points")
    assert [warning.partition(": ")[2] for warning in checked.warnings] == [
        "test_a has no hint: a student who does not meet it may get no advice"
    ]


def test_bundles_for_platforms_refuse_tests(write: Write) -> None:
    """They would lack pytest: that is said when a bundle is made, and not to the first student."""
    rubric = write("@pytest.mark.points(5)\ndef test_a(ros): pass\n")
    with pytest.raises(RubricError, match="expected a rubric without tests for pytest, which bundles do not bring"):
        gradescope(Chosen((), (rubric,), "auto"))
