"""Rubric files become exercises; every mistake in one is named with its line and column."""

from __future__ import annotations

import os
import random
from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from stand_in_checks import CHECKS, Everything, FieldValues, Point, Publishes, TopicRate, UsesLogger
from tables import read_table
from tracing import ODOMETRY

from grader.grading.model.exercise import Criterion, Exercise
from grader.grading.rubrics.loader import MAX_MISTAKES, RubricMistakes, read_rubric
from grader.runtime.model.errors import RubricError
from grader.runtime.model.limits import MAX_RUBRIC_BYTES
from grader.runtime.model.scenario import Between, JustAbove, JustBelow, Scenario, Span
from grader.runtime.stimuli.numbers import NumberStream
from grader.runtime.stimuli.recorded import RecordedStream

GOOD = """\
schema: grader/rubric/v1
exercise: {id: pump, number: 7, title: A pump, required: false}
files: [pump.py, valve.py]
scenarios:
  - id: alone
    processes: [pump.py]
    observe: {duration: 2 min, after_first_message_on: /flow, wait_at_most: 30 s}
    stimuli:
      - numbers:
          topic: /level
          type: std_msgs/msg/Float32
          values: [1, 2.5, {between: [20.5, 24]}, {just_above: 25}, {just_below: 25}]
          period: 200 ms
          hold: 2 s
          start: 500 ms
      - recorded: {topic: /odom, type: nav_msgs/msg/Odometry, start: 5 s, duration: 16 s}
  - id: both
    processes: [pump.py, valve.py]
    observe: {duration: 20 s}
criteria:
  - id: flows
    title: Publishes the flow
    points: 6
    scenario: alone
    check: {publishes: {topic: /flow, type: std_msgs/msg/Float32}}
  - id: rate
    title: At 5 Hz
    points: 2.5
    scenario: alone
    check: {topic_rate: {topic: /flow, rate: 5 Hz, tolerance: 0.25 Hz, window: 1500 ms}}
    needs: [flows]
    hint: >
      a period is
      one over a rate
  - id: values
    title: Right values
    points: 1/3
    scenario: both
    check: {field_values: {topic: /flow, values: {data: 1, a.b: -2.5e-3}, tolerance: 0.1}}
    needs: [flows, rate]
  - id: logs
    title: Logs
    points: 1
    scenario: both
    check:
      uses_logger: {process: valve.py}
"""


@pytest.fixture
def rubric(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Write a rubric and read it under the short name `r.yaml`."""
    monkeypatch.chdir(tmp_path)

    def read(content: bytes | str, **keywords: Any) -> Exercise | None:
        path = Path("r.yaml")
        path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass"))
        return read_rubric(path, **{"checks": CHECKS, **keywords})

    return read


def refused(rubric: Callable[..., Any], content: bytes | str) -> RubricError | RubricMistakes:
    with pytest.raises(RubricError) as caught:
        rubric(content)
    return caught.value


def criterion(*values: Any) -> Criterion:
    """Return a criterion; the stand-ins have no judge method."""
    return Criterion(*values)


def test_a_rubric_becomes_an_exercise(rubric: Callable[..., Any]) -> None:
    """Every key arrives in the model, units converted, points exact, defaults kept."""
    exercise = rubric(GOOD)
    numbers = NumberStream(
        topic="/level",
        type="std_msgs/msg/Float32",
        values=(1.0, 2.5, Between(20.5, 24.0), JustAbove(25.0), JustBelow(25.0)),
        period_ns=200_000_000,
        hold_ns=2_000_000_000,
        start_ns=500_000_000,
    )
    odometry = RecordedStream("/odom", ODOMETRY, "", 5_000_000_000, 16_000_000_000)
    rate = TopicRate("/flow", 5.0, 0.25, 1_500_000_000)
    assert exercise == Exercise(
        id="pump",
        number="7",
        title="A pump",
        required=False,
        files=("pump.py", "valve.py"),
        scenarios=(
            Scenario("alone", ("pump.py",), Span(120_000_000_000, "/flow", 30_000_000_000), (numbers, odometry)),
            Scenario("both", ("pump.py", "valve.py"), Span(20_000_000_000)),
        ),
        criteria=(
            criterion("flows", "Publishes the flow", Fraction(6), "alone", Publishes("/flow", "std_msgs/msg/Float32")),
            criterion("rate", "At 5 Hz", Fraction(5, 2), "alone", rate, ("flows",), "a period is one over a rate"),
            criterion(
                "values",
                "Right values",
                Fraction(1, 3),
                "both",
                FieldValues("/flow", {"data": 1.0, "a.b": -0.0025}, 0.1),
                ("flows", "rate"),
            ),
            criterion("logs", "Logs", Fraction(1), "both", UsesLogger("valve.py")),
        ),
        digest=exercise.digest,
    )


def test_the_digest_is_of_the_files_bytes(rubric: Callable[..., Any]) -> None:
    """One more blank is another rubric; the name of the file is not part of it."""
    assert rubric(GOOD).digest == rubric(GOOD).digest != rubric(GOOD + "\n").digest


def test_line_ends_and_a_byte_order_mark_do_not_matter(rubric: Callable[..., Any]) -> None:
    """A rubric saved on Windows reads the same."""
    crlf = b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode()
    assert rubric(crlf).criteria == rubric(GOOD).criteria


def test_an_anchor_saves_typing(rubric: Callable[..., Any]) -> None:
    """A part that is written once may be used twice."""
    text = GOOD.replace("observe: {duration: 2 min,", "observe: &o {duration: 2 min,")
    text = text.replace("observe: {duration: 20 s}", "observe: *o")
    scenarios = rubric(text).scenarios
    assert scenarios[0].span == scenarios[1].span


def with_everything(parameters: str) -> str:
    return GOOD.replace("uses_logger: {process: valve.py}", f"everything: {parameters}")


def test_every_kind_of_parameter_can_be_written(rubric: Callable[..., Any]) -> None:
    """Text, numbers, flags, choices, pairs, lists, nested values and durations inside them."""
    text = "{word: a, count: 3, flag: true, side: above, pair: [1, b], many: [{x: 1, after: 2 s}, {x: 2}], "
    text += "one: {x: 3}, copy: c, times: [1 s, 2 ms]}"
    (*_, criterion) = rubric(with_everything(text)).criteria
    many = (Point(1.0, 2_000_000_000), Point(2.0))
    want = Everything("a", 3, True, "above", (1.0, "b"), many, Point(3.0), "c", (1_000_000_000, 2_000_000))
    assert criterion.check == want


def test_what_is_left_out_keeps_the_checks_default(rubric: Callable[..., Any]) -> None:
    """Defaults live in the check alone."""
    (*_, criterion) = rubric(with_everything("{word: a, count: 3, flag: false, side: above, pair: [1, b]}")).criteria
    assert criterion.check == Everything("a", 3, False, "above", (1.0, "b"))


BAD = read_table(Path(__file__).with_name("bad_rubrics.yaml"))


@pytest.mark.parametrize("bad", BAD, ids=[bad["new"].strip()[:40] for bad in BAD])
def test_a_mistake_is_named_with_its_place_and_remedy(rubric: Callable[..., Any], bad: Mapping[str, str]) -> None:
    """`file:line:column: expected, found`, and a hint where one is very likely right."""
    assert bad["old"] in GOOD
    error = refused(rubric, GOOD.replace(bad["old"], bad["new"], 1))
    assert (error.message, error.hint) == (bad["message"], bad["hint"])


def test_a_number_of_five_thousand_digits_is_refused(rubric: Callable[..., Any]) -> None:
    """Python itself refuses to read such a number; the message is short all the same."""
    error = refused(rubric, GOOD.replace("points: 1\n", "points: " + "9" * 5000 + "\n"))
    assert error.message.startswith("r.yaml:43:13: expected a value of the kind !!int, found `999")
    assert len(error.message) < 200


def test_all_mistakes_are_told_at_once_in_the_order_of_the_file(rubric: Callable[..., Any]) -> None:
    """One line each; with several, a hint says which line it is for."""
    text = (
        GOOD.replace("points: 6", "points: x").replace("rate: 5 Hz", "rate: 5").replace("pump, number", "Pump, number")
    )
    error = refused(rubric, text)
    assert [line.split(": ")[0] for line in error.message.splitlines()] == [
        "r.yaml:2:16",
        "r.yaml:23:13",
        "r.yaml:30:46",
    ]
    assert error.hint == "30:46: write `5 Hz`"


def test_a_file_full_of_mistakes_is_cut_short(rubric: Callable[..., Any]) -> None:
    """A page of messages helps no author."""
    text = GOOD + "".join(f"key{number}: 1\n" for number in range(50))
    assert len(refused(rubric, text).message.splitlines()) == MAX_MISTAKES + 1


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "r.yaml:1:1: expected a rubric, found an empty file"),
        (b"# nothing\n", "r.yaml:1:1: expected a rubric, found an empty file"),
        (b"just text", "r.yaml:1:1: expected a mapping (`key: value`), found `just text`"),
        (b"[1, 2]", "r.yaml:1:1: expected a mapping (`key: value`), found a list of 2"),
        (b"a: \xe9\n", "r.yaml:1:4: expected UTF-8 text, found the byte 0xe9"),
        ("é: x\nab: ü".encode() + b"\xff", "r.yaml:2:6: expected UTF-8 text, found the byte 0xff"),
        (GOOD.encode("utf-16"), "r.yaml:1:1: expected UTF-8 text, found the byte 0xff"),
        (b"x" * (MAX_RUBRIC_BYTES + 1), "r.yaml: expected at most 256 KiB, found more"),
        (b"[" * MAX_RUBRIC_BYTES, "r.yaml:1:25: expected at most 24 levels, found more"),
        (b"a: &a [*a]", "r.yaml:1:4: expected a small document, found aliases that multiply it"),
        (b"%YAML 3.0\n---\na: 1", "r.yaml:1:1: not valid YAML"),
        (b'a: "\\U00110000"', "r.yaml:1:1: not valid YAML"),
    ],
)
def test_what_is_no_rubric_at_all_is_one_line(rubric: Callable[..., Any], content: bytes, message: str) -> None:
    """Empty, too large, not UTF-8, not a mapping, endless: one line each."""
    assert refused(rubric, content).message.startswith(message)


def test_aliases_that_multiply_are_refused(rubric: Callable[..., Any]) -> None:
    """A small file that expands to a billion values is rejected."""
    rows = ["a: &a [x, x, x, x, x, x, x, x, x, x]"]
    rows += [f"{b}: &{b} [{', '.join([f'*{a}'] * 10)}]" for a, b in zip("abcdefgh", "bcdefghi", strict=True)]
    assert "found aliases that multiply it" in refused(rubric, "\n".join(rows)).message


def test_a_path_that_cannot_be_read_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A missing file, a folder, a pipe, a file as a folder, a null character."""
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path("file").write_text("")
    os.mkfifo("pipe")
    for name, message in {
        "no\nsuch.yaml": "no\\nsuch.yaml: expected a rubric file, found nothing there",
        "file/x.yaml": "file/x.yaml: expected a rubric file, found nothing there",
        "folder": "folder: expected a rubric file, found a folder",
        "pipe": "pipe: expected a rubric file, found something that is not a regular file",
        "a\0b": "a\\x00b: expected a path, found one with a null character",
        "x" * 300: "cannot be read: File name too long",
    }.items():
        with pytest.raises(RubricError) as caught:
            read_rubric(Path(name), checks=CHECKS)
        assert message in caught.value.message


NOISE = (
    "",
    " ",
    "  ",
    ":",
    "-",
    "[",
    "]",
    "{",
    "}",
    "'",
    '"',
    "&a ",
    "*a",
    "!!",
    "#",
    "\t",
    "|",
    "%",
    "é",
    "\0",
    "? ",
    "5",
)


def mutated(random_: random.Random, text: str) -> str:
    """Return a rubric after a few accidents of an editor."""
    lines = text.splitlines(keepends=True)
    for _ in range(random_.randint(1, 3)):
        row = random_.randrange(len(lines))
        line = lines[row]
        column = random_.randrange(len(line) + 1)
        inserted = line[:column] + random_.choice(NOISE) + line[column:]
        lines[row] = random_.choice([inserted, line[:column] + line[column + 1 :], line * 2, "", line.strip()])
    return "".join(lines)


def refusal(rubric: Callable[..., Any], text: str) -> RubricError | None:
    """Return the error of a rubric, or None if it can be read."""
    try:
        rubric(text)
    except RubricError as error:
        return error
    return None


@pytest.mark.long
def test_no_accident_gives_a_traceback(rubric: Callable[..., Any]) -> None:
    """Three hundred damaged rubrics: each is read, or refused with a place."""
    random_ = random.Random(7)
    errors = [error for _ in range(300) if (error := refusal(rubric, mutated(random_, GOOD)))]
    assert len(errors) > 100
    for error in errors:
        assert all(line.startswith("r.yaml:") for line in error.message.splitlines())
        assert "\n" not in error.hint
