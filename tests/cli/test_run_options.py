"""The options of a run: from one row each follow the command line, the wire, evidence, and the line to repeat it."""

from __future__ import annotations

import json
import shlex
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import click
import msgspec
import pytest
from click.testing import CliRunner

from grader.cli.remembered import KEPT
from grader.cli.run_options import run_options
from grader.course.classroom.messages import Terms, pack_message, unpack_message
from grader.course.classroom.store import Conditions
from grader.grading.app.request import GradeRequest, command_words, request_for, request_to_json
from grader.grading.model import grading_options as module
from grader.grading.model.grading_options import (
    BATCH,
    GRADE,
    GradingOptions,
    Keyed,
    OptionKind,
    key_values,
    option_names,
    option_words,
    options_of_json,
    options_to_json,
    paths,
    rows,
    with_paths,
)
from grader.runtime.model.dataclass import dataclass

#: A value of each option that is not the usual one.
OTHER: dict[str, Any] = {
    "exercises": ("b", "a"),
    "every": True,
    "rubrics": (Path("r 1.yaml"), Path("r2.yaml")),
    "seed": 9,
    "student": "ada",
    "variant_key": Path("k"),
    "bags": (("nav_msgs/msg/Odometry", Path("bag")), ("/scan", Path("a b"))),
    "interfaces": (Path("i"), Path("j")),
    "clock": "wall",
    "isolation": "none",
    "time_budget_s": 20.5,
    "spot_checks": 0.051,
}
WORDS = (
    "--exercise b --exercise a --all --rubric 'r 1.yaml' --rubric r2.yaml --seed 9 --student ada --variant-key k "
    "--recording nav_msgs/msg/Odometry=bag --recording '/scan=a b' --interfaces i --interfaces j --clock wall "
    "--isolation none --time-budget 20.5 --spot-checks 5.1%"
)


def given(command: str, *words: str, record: type[GradingOptions] = GradingOptions) -> GradingOptions:
    """Return what a command makes of these words."""
    heard = []

    def called(*, options: GradingOptions) -> int:
        heard.append(options)
        return 0

    made = click.command()(run_options(command, record)(called))
    done = CliRunner().invoke(made, list(words))
    assert done.exit_code == 0, done.output
    return heard[0]


def test_every_option_has_another_value_here() -> None:
    """So that no test below passes over a new one."""
    assert set(OTHER) == {name for name, _, _ in rows()} == {each.name for each in fields(GradingOptions)}
    usual = GradingOptions()
    assert not [name for name, value in OTHER.items() if getattr(usual, name) == value]


def test_the_words_of_the_command_are_read_as_what_they_were_made_of() -> None:
    """The line that repeats a report asks for the same."""
    options = GradingOptions(**OTHER)
    words = list(option_words(options))
    assert words == shlex.split(WORDS)
    assert given(GRADE, *words) == options
    assert given(GRADE) == GradingOptions()
    assert list(option_words(GradingOptions())) == []


def test_a_class_has_defaults_of_its_own_and_no_student() -> None:
    """Everybody's variant follows from the roster, and everybody is checked."""
    assert given(BATCH) == GradingOptions(spot_checks=1.0)
    assert set(option_names(BATCH)) == set(option_names(GRADE)) - {"student"}
    assert set(option_names(BATCH)) <= set(KEPT)  # the next run repeats them


def test_evidence_keeps_what_decides_a_recording() -> None:
    """Names, order and values; some are there only where they are not as usual."""
    usual = (
        '{"exercises": [], "recordings": {}, "clock": "auto", "isolation": "auto", "student": "", "variant_key": null}'
    )
    assert json.dumps(options_to_json(GradingOptions())) == usual
    text = json.dumps(options_to_json(GradingOptions(**OTHER)))
    assert text == (
        '{"exercises": ["b", "a"], "recordings": {"nav_msgs/msg/Odometry": "bag", "/scan": "a b"}, "clock": "wall", '
        '"isolation": "none", "student": "ada", "variant_key": "k", "interfaces": ["i", "j"]}'
    )
    kept = {name for name, row, _ in rows() if row.kept}
    read = options_of_json(json.loads(text), GradingOptions())
    assert read == GradingOptions(**{name: value for name, value in OTHER.items() if name in kept})
    assert options_of_json({}, GradingOptions()) == GradingOptions()


def test_all_of_them_travel() -> None:
    """As bytes to another machine, and as JSON to a process of this one; a path need not be valid text."""
    odd = Path("\udcff.yaml")
    options = GradingOptions(**{**OTHER, "rubrics": (odd,)})
    terms = Terms(Conditions("0", (), "", options), (), standalone=False, deadline_s=1.0)
    assert unpack_message(pack_message(terms), Terms) == terms
    line = json.loads(json.dumps(msgspec.to_builtins(options, enc_hook=str)))
    assert msgspec.convert(line, GradingOptions, dec_hook=lambda kind, value: kind(value)) == options
    assert odd in paths(options)
    assert paths(with_paths(options, lambda path: Path("x", path)))[0] == Path("x", odd)


@dataclass(frozen=True, slots=True, kw_only=True)
class WithTwoMore(GradingOptions):
    """The record with two options that the grader does not have."""

    gravity: float = module._row(
        9.81, "--gravity", "How heavy things are.", kind=OptionKind.SECONDS, kept=True, keyed=Keyed.RECORDING
    )
    maps: tuple[Path, ...] = module._row((), "--map", "Use this map.", kind=OptionKind.PATH, metavar="FILE", kept=True)


@pytest.mark.parametrize("command", [GRADE, BATCH])
def test_a_new_option_is_one_row(command: str) -> None:
    """From it follow the command line, the line to repeat a report, evidence, the key of a result, and the wire."""
    words = ["--gravity", "1.62", "--map", "moon.pgm"]
    found = given(command, *words, record=WithTwoMore)
    assert isinstance(found, WithTwoMore)
    assert (found.gravity, found.maps) == (1.62, (Path("moon.pgm"),))
    plain = replace(found, spot_checks=0.0)
    assert list(option_words(plain)) == words
    data = options_to_json(found)
    assert (data["gravity"], data["maps"]) == (1.62, ["moon.pgm"])
    assert options_of_json(json.loads(json.dumps(data)), WithTwoMore()) == plain
    assert "gravity" not in options_to_json(WithTwoMore())
    assert key_values(found)["gravity"] == key_values(found, recordings=True)["gravity"] == 1.62
    assert Conditions("0", (), "", found).key("a") != Conditions("0", (), "", replace(found, gravity=1.0)).key("a")
    assert paths(with_paths(found, lambda path: Path("moved", path))) == [Path("moved/moon.pgm")]
    line = msgspec.to_builtins(found, enc_hook=str)
    assert msgspec.convert(line, WithTwoMore, dec_hook=lambda kind, value: kind(value)) == found


def test_a_request_has_all_options_and_what_is_known_of_the_submission() -> None:
    """Nothing is lost on the way from one to the other."""
    request = request_for("./ada", GradingOptions(**OTHER), workers=2)
    assert request == GradeRequest("./ada", workers=2, **OTHER)
    assert command_words(request, 9)[2:] == tuple(option_words(GradingOptions(**OTHER)))
    assert request_to_json(request) == {**options_to_json(request), "variants": {}}
