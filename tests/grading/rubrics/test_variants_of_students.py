"""Variants drawn from a variant key: reproducible by whoever has key and id, by nobody else, and about evenly."""

import hashlib
import hmac
import json
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import cast

import pytest
from click.testing import CliRunner, Result

from grader.cli.main import app
from grader.grading.app.seeds import ByKey, by_key, checked_student, read_key
from grader.grading.rubrics.variants import VariantOptions
from grader.runtime.model.errors import KeyFileError, VariantError

KEY = b"a course key for tests, not a secret"


class Options:
    """A variant of ten values."""

    name, count = "rate", 10

    def value(self, index: int) -> int:
        return index


def drawn(student: str, *, key: bytes = KEY, exercise: str = "pump") -> object:
    """Return the value of a student."""
    return ByKey(key, student).value(exercise, cast("VariantOptions", Options()))


def test_the_rule_can_be_followed_with_any_tool() -> None:
    """HMAC-SHA256 over four lines; the first 16 bytes as a number, modulo the count of values."""
    digest = hmac.new(KEY, b"grader/variant/v1\npump\nrate\nada@x.edu", hashlib.sha256).digest()
    assert drawn("ada@x.edu") == int.from_bytes(digest[:16], "big") % 10


def test_an_id_is_the_same_however_it_is_typed() -> None:
    """Case, blanks around it, and ways to encode a letter make no difference."""
    assert {drawn(name) for name in ("Ada.O\u00f6", " ada.o\u00f6 ", "ADA.O\u00d6", "ada.oo\u0308")} == {
        drawn("ada.o\u00f6")
    }


def test_values_differ_by_student_exercise_and_key() -> None:
    """And come up about equally often."""
    count = Counter(drawn(f"s{number}") for number in range(2000))
    assert set(count) == set(range(10))
    assert min(count.values()) > 140
    assert [drawn(f"s{n}") for n in range(20)] != [drawn(f"s{n}", exercise="fan") for n in range(20)]
    assert [drawn(f"s{n}") for n in range(20)] != [drawn(f"s{n}", key=KEY + b"!") for n in range(20)]


@pytest.mark.parametrize("student", ["", "  ", "a\nb", "x" * 201, "\u202eada"])
def test_an_id_that_is_none_is_refused(student: str) -> None:
    """It could not be typed again, or would forge a line."""
    with pytest.raises(VariantError, match="expected the id of a student"):
        checked_student(student)


def test_a_key_is_read_without_the_line_break_behind_it(tmp_path: Path) -> None:
    """Editors add one."""
    for name, end in (("a", b""), ("b", b"\n"), ("c", b"\r\n")):
        (tmp_path / name).write_bytes(KEY + end)
    assert {read_key(tmp_path / name, "variant key") for name in "abc"} == {KEY}


@pytest.mark.parametrize(
    ("content", "found"), [(b"short\n", "found 5"), (b"x" * 5000, "found more than 4096"), (None, "No such file")]
)
def test_a_key_that_cannot_be_used_is_refused(tmp_path: Path, content: bytes | None, found: str) -> None:
    """One that could be guessed would tell students each other's values."""
    path = tmp_path / "variant.key"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(KeyFileError, match=found) as refusal:
        by_key(path, "ada")
    assert "short" not in refusal.value.message


@pytest.fixture
def sheet(tmp_path: Path) -> Callable[..., Result]:
    """Run `grade rubric variant` on exercise 1 with a rate that varies."""
    from grader.grading.rubrics.builtin import builtin_rubrics

    text = builtin_rubrics()["velocity_publisher"].read_text(encoding="utf-8")
    text = text.replace("\nscenarios:", "\nvariants:\n  rate: {choose: [10 Hz, 15 Hz, 20 Hz]}\nscenarios:", 1)
    (tmp_path / "r.yaml").write_text(text.replace("rate: 20 Hz,", "rate: {variant: rate},"), encoding="utf-8")
    (tmp_path / "variant.key").write_bytes(KEY)

    def run(*more: str) -> Result:
        words = ["rubric", "variant", str(tmp_path / "r.yaml"), "--variant-key", str(tmp_path / "variant.key"), *more]
        return CliRunner().invoke(app, words)

    return run


def test_the_task_sheet_says_a_students_values(sheet: Callable[..., Result]) -> None:
    """As Markdown, and as JSON with the digest that the report will have."""
    done = sheet("--student", "ada", "--format", "json")
    data = json.loads(done.stdout)
    assert (done.exit_code, data["student"], data["exercise"]) == (0, "ada", "velocity_publisher")
    assert data["values"]["rate"] in ("10 Hz", "15 Hz", "20 Hz")
    assert data["rubric"].startswith("sha256:")
    text = sheet("--student", "ada").stdout
    assert f"| rate | `{data['values']['rate']}` |" in text


def test_a_task_sheet_of_a_hostile_id_is_only_text(sheet: Callable[..., Result]) -> None:
    """Whoever chose it may have thought of the page that it ends on."""
    text = sheet("--student", "<script>|`x`").stdout
    assert "<script>" not in text
