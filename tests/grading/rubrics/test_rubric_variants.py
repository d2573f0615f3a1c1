"""Variants in a rubric: values stand where they are used, places stay right, every value that may come is tried."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from ruamel.yaml import YAML
from stand_in_checks import CHECKS

from grader.grading.model.exercise import Drawn, Exercise, Variant
from grader.grading.rubrics.draws import First, Options, Recorded
from grader.grading.rubrics.loader import read_rubric
from grader.grading.rubrics.schema import rubric_schema
from grader.runtime.model.errors import RubricError
from grader.runtime.stimuli.numbers import NumberStream

RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: pump, number: "7", title: A pump}
files: [pump.py]
variants:
  rate: {choose: [5 Hz, 10 Hz]}
  speed: {between: [0.2, 0.8], step: 0.05}
  topic: {choose: [/flow, /stream]}
scenarios:
  - id: alone
    processes: [pump.py]
    observe: {duration: 10 s}
    stimuli:
      - numbers: {topic: {variant: topic}, type: std_msgs/msg/Float32, values: [{variant: speed}, 1],
                  period: 200 ms, hold: 2 s}
criteria:
  - id: rate
    title: At its rate
    points: 6
    scenario: alone
    check: {topic_rate: {topic: {variant: topic}, rate: {variant: rate}, tolerance: 0.25 Hz, window: 1500 ms}}
  - id: values
    title: Right values
    points: 1
    scenario: alone
    check: {field_values: {topic: /flow, values: {data: {variant: speed}}}}
"""
VARIANTS = RUBRIC[RUBRIC.index("variants:\n") : RUBRIC.index("scenarios:\n")]


class Nth:
    """Draws the same index of every variant, counted from the front or the back."""

    student = "ada"

    def __init__(self, index: int) -> None:
        self.index = index

    def value(self, exercise: str, options: Options) -> float | str:
        return options.value(self.index % options.count)


@pytest.fixture
def read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Read a rubric under the short name `r.yaml`."""
    monkeypatch.chdir(tmp_path)

    def reader(content: str = RUBRIC, draw: Any = None) -> Exercise | None:
        Path("r.yaml").write_text(content, encoding="utf-8")
        return read_rubric(Path("r.yaml"), checks=CHECKS, draw=draw)

    return reader


def test_a_value_stands_wherever_its_variant_is_named(read: Callable[..., Any]) -> None:
    """In a scenario and in checks, as if it had been written there."""
    exercise = read(draw=Nth(-1))
    assert exercise.variant == Variant("ada", (("rate", "10 Hz"), ("speed", 0.8), ("topic", "/stream")))
    rate, values = (criterion.check for criterion in exercise.criteria)
    assert (rate.topic, rate.rate, values.values) == ("/stream", 10.0, {"data": 0.8})
    (stimulus,) = exercise.scenarios[0].stimuli
    assert isinstance(stimulus, NumberStream)
    assert (stimulus.topic, stimulus.values) == ("/stream", (0.8, 1.0))


def test_it_is_the_rubric_with_the_values_written_out(read: Callable[..., Any]) -> None:
    """But for the digest, which covers file and values."""
    plain = RUBRIC.replace(VARIANTS, "")
    for name, value in (("topic", "/flow"), ("rate", "5 Hz"), ("speed", "0.2")):
        plain = plain.replace(f"{{variant: {name}}}", value)
    drawn, written = read(draw=First()), read(plain)
    assert (drawn.scenarios, drawn.criteria) == (written.scenarios, written.criteria)
    assert len({drawn.digest, written.digest, read(draw=Nth(1)).digest}) == 3
    assert read(draw=Nth(1)).digest == read(draw=Nth(1)).digest


def test_without_a_student_such_a_rubric_is_refused(read: Callable[..., Any]) -> None:
    """The message tells what to add."""
    with pytest.raises(RubricError) as refusal:
        read()
    assert refusal.value.message == "r.yaml:4:1: expected a student, because this rubric has variants, found none"
    assert "--student ID --variant-key FILE" in refusal.value.hint


def test_what_was_graded_can_be_judged_without_the_key(read: Callable[..., Any]) -> None:
    """Kept values are used unchanged; the message names one that was not kept."""
    graded = read(draw=Nth(3))
    kept = {"pump": dict(graded.variant.values)}
    assert read(draw=Recorded(Drawn("ada", kept))) == graded
    del kept["pump"]["rate"]
    with pytest.raises(RubricError, match=r"r\.yaml:5:3: no value was stored"):
        read(draw=Recorded(Drawn("ada", kept)))


@pytest.mark.parametrize(
    ("written", "count", "first", "last"),
    [
        ("{between: [0.2, 0.8], step: 0.05}", 13, 0.2, 0.8),
        ("{between: [0.1, 0.75], step: 0.1}", 7, 0.1, 0.7),
        ("{between: [-3, 3], step: 2}", 4, -3, 3),
        ("{between: [10 Hz, 12 Hz], step: 0.5 Hz}", 5, "10.0 Hz", "12.0 Hz"),
    ],
)
def test_values_between_two_are_exact(
    read: Callable[..., Any], written: str, count: int, first: float | str, last: float | str
) -> None:
    """No step is lost or gained in floating point, and a unit stays."""
    seen = {}

    class Spy(First):
        def value(self, exercise: str, options: Options) -> float | str:
            seen[options.name] = [options.value(index) for index in range(options.count)]
            return options.value(0)

    content = RUBRIC.replace("rate: {choose: [5 Hz, 10 Hz]}", "rate: {choose: [5 Hz, 10 Hz]}\n  x: " + written)
    content = content.replace("values: [{variant: speed}, 1]", "values: [{variant: speed}, {variant: x}]")
    if isinstance(first, str):
        content = RUBRIC.replace("{choose: [5 Hz, 10 Hz]}", written)
    read(content, draw=Spy())
    values = seen["rate" if isinstance(first, str) else "x"]
    assert (len(values), values[0], values[-1]) == (count, first, last)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[5 Hz, 10 Hz]", "[5 Hz, 10]", "20:57: expected a frequency with its unit, such as `20 Hz`, found `10`"),
        ("[/flow, /stream]", "[/flow, stream]", "13:26: expected an absolute topic name"),
        ("[5 Hz, 10 Hz]", "[5 Hz]", "5:18: expected two or more different values, found a list of 1"),
        ("[5 Hz, 10 Hz]", "[5 Hz, [6 Hz]]", "5:25: expected a value such as 10 Hz, /cmd_vel or 0.5"),
        ("choose: [5 Hz, 10 Hz]", "chose: [5 Hz]", "5:10: expected `choose`, `between` or `step` in `rate`"),
        ("step: 0.05", "step: 0", "6:10: expected two numbers, the lower one first, and a step above 0"),
        ("step: 0.05", "step: 1 s", "6:10: expected one unit in `between` and `step`"),
        ("step: 0.05", "step: 1e-09", "6:10: expected a step that gives 2 to 10,000 values"),
        (", step: 0.05", "", "6:10: expected either `choose`, or `between` and `step`"),
        ("[0.2, 0.8]", "[0.2]", "6:20: expected two numbers, the lower one first, found a list of 1"),
        ("{variant: rate}", "{variant: rat}", "20:57: expected one of `variants` (`rate`, `speed` or `topic`)"),
        ("{variant: rate}", "5 Hz", "5:3: expected `{variant: rate}` somewhere in the rubric, found none"),
        ("points: 6", "points: {variant: speed}", "18:13: expected a value of its own here, found the variant `speed`"),
        ("id: alone", "id: {variant: topic}", "9:9: expected a value of its own here, found the variant `topic`"),
        (VARIANTS, "variants: {}\n", "4:11: expected at least one variant, found nothing"),
        (VARIANTS, "", "9:26: expected text, found a mapping with `variant`"),
    ],
)
def test_a_mistake_is_named_with_its_place(read: Callable[..., Any], old: str, new: str, message: str) -> None:
    """For every drawn value: a rubric that fits only some students is invalid."""
    with pytest.raises(RubricError) as refusal:
        read(RUBRIC.replace(old, new), draw=First())
    assert f"r.yaml:{message}" in refusal.value.message


def test_the_schema_admits_variants_where_reading_does() -> None:
    """Editors complete and check such rubrics; points never vary."""
    validator = jsonschema.Draft202012Validator(rubric_schema(CHECKS))
    assert list(validator.iter_errors(YAML(typ="safe").load(RUBRIC))) == []
    fixed = RUBRIC.replace("points: 6", "points: {variant: speed}")
    assert [list(e.path)[-1] for e in validator.iter_errors(YAML(typ="safe").load(fixed))] == ["points"]
    json.dumps(validator.schema)
