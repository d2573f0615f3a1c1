"""The limits of a rubric: their values, and the messages about mistakes in them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from stand_in_checks import CHECKS

from grader.grading.model.exercise import Exercise
from grader.grading.rubrics.loader import read_rubric
from grader.grading.rubrics.units import QuantityError, format_quantity, parse_quantity
from grader.runtime.model.errors import RubricError
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import KIB, MIB, NS_PER_S, Unit

BYTES = Unit("B")
RUBRIC = """\
schema: grader/rubric/v1
exercise: {{id: pump, number: 7, title: A pump}}
files: [pump.py]
limits: {limits}
scenarios:
  - {{id: alone, processes: [pump.py], observe: {{duration: 2 s}}}}
  - {{id: again, processes: [pump.py], observe: {{duration: 3 s}}}}
criteria:
  - {{id: logs, title: Logs, points: 1, scenario: alone, check: {{uses_logger: {{process: pump.py}}}}}}
"""


@pytest.fixture
def read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Read a rubric with some limits, under the short name `r.yaml`."""
    monkeypatch.chdir(tmp_path)

    def read_one(limits: str) -> Exercise | None:
        Path("r.yaml").write_text(RUBRIC.format(limits=limits), encoding="utf-8")
        return read_rubric(Path("r.yaml"), checks=CHECKS)

    return read_one


def test_every_limit_can_be_set_and_holds_for_every_scenario(read: Callable[..., Any]) -> None:
    """What is written with its unit arrives as the number that counts."""
    exercise = read(
        "{memory: 1 GiB, processor_time: 90 s, processes: 100, output: 2 MiB, lines: 10, open_files: 64, "
        "file_size: 1 MiB, scratch: 8 MiB, real_time: 2 min, messages: 99, message_size: 1.5 KiB, traffic: 1 MiB, "
        "participants: 3}"
    )
    wanted = Limits(
        memory_bytes=1024 * MIB,
        processor_ns=90 * NS_PER_S,
        processes=100,
        output_bytes=2 * MIB,
        lines=10,
        open_files=64,
        file_bytes=MIB,
        scratch_bytes=8 * MIB,
        wall_ns=120 * NS_PER_S,
        messages=99,
        message_bytes=1536,
        traffic_bytes=MIB,
        participants=3,
    )
    assert [scenario.limits for scenario in exercise.scenarios] == [wanted, wanted]


def test_what_is_not_named_stays_as_usual(read: Callable[..., Any]) -> None:
    """A rubric names only what it needs otherwise."""
    (first, _) = read("{messages: 7}").scenarios
    assert first.limits == Limits(messages=7)
    assert read("{}").scenarios[0].limits == Limits()


@pytest.mark.parametrize(
    ("limits", "message", "hint"),
    [
        ("{memory: 512}", "4:18: expected a size with its unit, such as `512 MiB`, found `512`", "write `512 MiB` or"),
        ("{memory: 512 MB}", "4:18: expected a size in GiB, MiB, KiB or B, found `512 MB`", "write `512 MiB`"),
        ("{memory: 1 MiB}", "4:18: expected at least 128 MiB, which even an idle node needs, found", ""),
        ("{memory: -1 MiB}", "4:18: expected a size of at least 0", ""),
        ("{memory: 0.3 B}", "4:18: expected a whole number of bytes", ""),
        ("{real_time: 1 s}", "4:21: expected at least 10 s, which even an idle node needs", ""),
        ("{real_time: 5}", "4:21: expected a duration with its unit", "write `5 s`"),
        ("{processes: 4}", "4:21: expected at least 32, which even an idle node needs, found `4`", ""),
        ("{messages: 2.5}", "4:20: expected a whole number, found `2.5`", ""),
        ("{messages: true}", "4:20: expected a whole number, found `true`", ""),
        ("{messages: 20 s}", "4:20: expected a whole number, found `20 s`", ""),
        ("{mesages: 20}", "4:10: expected `memory`, `processor_time`", "did you mean `messages`?"),
        ("many", "4:9: expected a mapping (`key: value`), found `many`", ""),
    ],
)
def test_a_mistake_is_named_with_its_place(read: Callable[..., Any], limits: str, message: str, hint: str) -> None:
    """Line, column, what was expected and what was found."""
    with pytest.raises(RubricError) as caught:
        read(limits)
    assert caught.value.message.startswith(f"r.yaml:{message}")
    assert caught.value.hint.startswith(hint)
    assert bool(caught.value.hint) == bool(hint)


@given(st.integers(min_value=0, max_value=1 << 50))
def test_sizes_survive_being_written(count: int) -> None:
    """A size is printed as it can be read, with nothing lost."""
    assert parse_quantity(format_quantity(count, BYTES), BYTES) == count


@pytest.mark.parametrize(("text", "count"), [("64 KiB", 64 * KIB), ("1.5KiB", 1536), (" 7 B ", 7), ("0 GiB", 0)])
def test_a_size_is_whole_bytes(text: str, count: int) -> None:
    """Sizes in every unit become exact integers."""
    assert parse_quantity(text, BYTES) == count


def test_a_size_in_no_unit_of_size_is_refused() -> None:
    """Seconds are no bytes."""
    with pytest.raises(QuantityError, match="a size in GiB, MiB, KiB or B"):
        parse_quantity("10 s", BYTES)
