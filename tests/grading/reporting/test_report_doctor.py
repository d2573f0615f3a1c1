"""A checkup is shown to people and to programs, with a fix for what is missing."""

from __future__ import annotations

import json
import unicodedata

import pytest

from grader.grading.reporting.doctor import checkup_to_json, render_checkup
from grader.runtime.model.checkup import PROPERTIES, Checkup, Exchange, Fact, Property, TierReport
from grader.runtime.model.limits import Limits

WORKS = Exchange("bubblewrap", 10, 10, 1.25)
HOLDS = TierReport(
    "bubblewrap",
    "A1",
    usable=True,
    why="",
    properties=tuple(Property(n, holds=True, mechanism="m") for n in PROPERTIES),
)
LEAKS = TierReport(
    "landlock",
    "C",
    usable=False,
    why="net_egress NOT CONTAINED (a route)",
    properties=tuple(
        Property(n, holds=n != "net_egress", mechanism="n", found="" if n != "net_egress" else "a route")
        for n in PROPERTIES
    ),
    remedy="docker run --network none",
)
ABSENT = TierReport("bubblewrap-flat", "B", usable=False, why="sandbox: expected bwrap, found none", remedy="get bwrap")
GOOD = Checkup((Fact("Python", "3.11"),), WORKS, (HOLDS, ABSENT, LEAKS), "bubblewrap", "", Limits())
NONE_HOLDS = Checkup((), WORKS, (ABSENT, LEAKS), "", "get bwrap", Limits())
NO_ROS = Checkup((Fact("ROS 2", "none", fits=False, remedy="install it"),), None, (), "", "", Limits())
NO_DDS = Checkup((), Exchange("bubblewrap", 10, 3, 9.0), (HOLDS,), "bubblewrap", "", Limits())


def text(checkup: Checkup, width: int = 100) -> str:
    return render_checkup(checkup, width=width, colour=False)


def test_a_machine_that_is_safe_is_called_so() -> None:
    """First the verdict and the sandbox; then every tier with each property, and what gives it in the used one."""
    shown = text(GOOD)
    assert shown.startswith("grading is safe here, in the sandbox bubblewrap\n")
    assert "A1 bubblewrap         holds; grading uses it\n" in shown
    assert "C  landlock           not here: it does not contain net_egress\n" in shown
    assert "fix: get bwrap" in shown
    assert "  net_egress*  yes   NO    sends nothing beyond this machine's loopback (m)\n" in shown
    assert "  C, net_egress: a route\n" in shown
    assert all(name in shown for name in PROPERTIES)
    assert "memory 512 MiB, processor time 120 s, processes 64" in shown


@pytest.mark.parametrize(
    ("checkup", "problem", "remedy"),
    [
        (NONE_HOLDS, "  sandbox: none holds on this machine\n", "    fix: get bwrap\n"),
        (NO_ROS, "  ROS 2: none\n", "    fix: install it\n"),
        (NO_DDS, "  DDS exchange: 3 of 10 messages of a trial node arrived\n", ""),
    ],
)
def test_what_is_missing_comes_first_with_its_remedy(checkup: Checkup, problem: str, remedy: str) -> None:
    """Whoever reads only the first lines knows what to do."""
    assert not checkup.safe
    assert text(checkup).startswith(f"grading is NOT SAFE here\n{problem}{remedy}\n")


def test_an_exchange_that_could_not_be_tried_says_why() -> None:
    """A problem is told, also if by then every message had come."""
    checkup = Checkup((), Exchange("none", 10, 10, 1.0, "the node\nraised"), (HOLDS,), "bubblewrap", "", Limits())
    assert not checkup.safe
    assert "  FAILS  10 of 10 messages of a trial node without a sandbox" in text(checkup)
    assert text(checkup).count("the node\\nraised") == 2


@pytest.mark.parametrize("width", [1, 60, 80, 120])
@pytest.mark.parametrize("checkup", [GOOD, NONE_HOLDS, NO_ROS, NO_DDS])
def test_every_width_is_kept(checkup: Checkup, width: int) -> None:
    """No line is longer than the page, which has at least 60 columns."""
    assert max(map(len, text(checkup, width).splitlines())) <= max(width, 60)


def test_colour_changes_no_word() -> None:
    """Without its sequences the coloured page is the plain one."""
    coloured = render_checkup(GOOD, width=80, colour=True)
    assert "\x1b[" in coloured
    plain = "".join(part.split("m", 1)[-1] if i else part for i, part in enumerate(coloured.split("\x1b[")))
    assert plain == text(GOOD, 80)


def test_nothing_that_a_machine_says_steers_a_terminal() -> None:
    """Names of paths and what programs print are shown, not obeyed."""
    evil = "\x1b[2J\u202e\nx"
    tiers = (TierReport("landlock", "C", usable=False, why=evil, properties=HOLDS.properties[:1], remedy=evil),)
    checkup = Checkup((Fact("user", evil, fits=False, remedy=evil),), WORKS, tiers, "", evil, Limits())
    for shown in (text(checkup), checkup_to_json(checkup)):
        assert not [c for c in shown if c != "\n" and unicodedata.category(c) in {"Cc", "Cf"}]


def test_programs_read_the_same() -> None:
    """The JSON holds the verdict, the problems with their remedies, each tier with each property, and the limits."""
    data = json.loads(checkup_to_json(GOOD))
    assert (data["schema"], data["safe"], data["used"], data["problems"]) == (
        "grader/checkup/v1",
        True,
        "bubblewrap",
        [],
    )
    assert [tier["tier"] for tier in data["tiers"]] == ["A1", "B", "C"]
    assert data["tiers"][2]["properties"][4] == {
        "name": "net_egress",
        "holds": False,
        "mechanism": "n",
        "found": "a route",
    }
    assert data["tiers"][1]["remedy"] == "get bwrap"
    assert data["exchange"]["succeeded"] is True
    assert data["limits"]["memory_bytes"] == 512 << 20
    lacking = json.loads(checkup_to_json(NONE_HOLDS))
    assert (lacking["safe"], lacking["used"]) == (False, None)
    assert lacking["problems"] == [
        {"name": "sandbox", "value": "none holds on this machine", "fits": False, "remedy": "get bwrap"}
    ]
    assert json.loads(checkup_to_json(NO_ROS))["exchange"] is None
