"""Every attack of the table, tried in the tiers that CI has, and the traps, tried on what they must notice."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import hostile_reports
import pytest
from arena import UNPRIVILEGED, Arena, Ran
from attack_runs import HERE, read_attacks, run_unit, units
from attack_verdicts import EARNS, objections
from tiers import NIGHTLY, but

from grader.grading.reporting.formats import FORMATS
from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.ros_installation import find_ros
from grader.runtime.sandbox.choose import Machine, inspect_tiers

TIERS = ("bubblewrap-root", "bubblewrap")
#: The tier that grading would take here; the other one is left to the nightly run.
USUAL = TIERS[0] if os.geteuid() == 0 else TIERS[1]
OTHERS = tuple(tier for tier in TIERS if tier != USUAL)
#: What does not depend on the tier is tried in one of them.
IN_ONE_TIER = ("archive", "report")
#: What a student could gain by most: what others may not know, and points.
IN_LONG = ("secrets", "verdict")
UNITS = units(read_attacks())


NOTHING = Ran(0, {}, "", "", {})


@pytest.fixture(scope="module")
def usable() -> dict[str, str]:
    try:
        return {tier.name: tier.why for tier in inspect_tiers(Machine(find_ros()))}
    except EnvironmentFault as fault:
        pytest.skip(fault.message)


def skip_without(tier: str, usable: dict[str, str]) -> None:
    if tier in UNPRIVILEGED and os.geteuid() == 0:
        missing = [program for program in ("bwrap", "setpriv") if shutil.which(program) is None]
        if missing:
            pytest.skip(f"{missing[0]} is not installed")
    elif usable[tier]:
        pytest.skip(usable[tier])


@pytest.mark.ros
@pytest.mark.long
@pytest.mark.parametrize("unit", but(IN_LONG, [unit for unit in UNITS if unit not in IN_ONE_TIER], NIGHTLY))
@pytest.mark.parametrize("tier", [USUAL, *(pytest.param(tier, marks=pytest.mark.nightly) for tier in OTHERS)])
def test_attacks_are_contained(tier: str, unit: str, usable: dict[str, str]) -> None:
    """Nothing is read, written, reached, left behind or earned by an attack, and right nodes beside it lose nothing."""
    skip_without(tier, usable)
    achieved = run_unit(tier, UNITS[unit])
    assert {number: texts for number, texts in achieved.items() if texts} == {}


@pytest.mark.ros
@pytest.mark.long
@pytest.mark.parametrize("unit", [pytest.param("archive", marks=pytest.mark.nightly), "report"])
def test_archives_and_texts_are_contained(unit: str, usable: dict[str, str]) -> None:
    """Neither what is unpacked nor what is shown depends on the tier, so one of them is enough."""
    skip_without(USUAL, usable)
    achieved = run_unit(USUAL, UNITS[unit])
    assert {number: texts for number, texts in achieved.items() if texts} == {}


def test_the_table_has_each_attack_once() -> None:
    """77 attacks, numbered without a gap, each with a fixture of its own that exists and names its number."""
    attacks = read_attacks()
    assert [attack.number for attack in attacks] == list(range(1, 78))
    assert [attack.path.name[:3] for attack in attacks] == [f"a{attack.number:02}" for attack in attacks]
    assert [attack.fixture for attack in attacks if not attack.path.exists()] == []
    assert {attack.earns for attack in attacks} <= set(EARNS)


def test_no_fixture_is_forgotten() -> None:
    """What lies among the fixtures is in the table."""
    found = {path for folder in ("nodes", "folders", "archives", "reports") for path in (HERE / folder).glob("a[0-9]*")}
    assert found == {attack.path for attack in read_attacks()}


# --- the traps ---


def texts(arena: Arena, *runs: Ran) -> list[str]:
    return [finding.text for finding in arena.findings(*runs)]


@pytest.fixture
def arena() -> Iterator[Arena]:
    with Arena(USUAL) as arena:
        yield arena


def test_an_untouched_arena_has_nothing_to_tell(arena: Arena) -> None:
    """Without an attack there is no finding."""
    assert texts(arena, NOTHING) == []


@pytest.mark.long
def test_the_secret_is_found_wherever_the_grader_wrote_it(arena: Arena) -> None:
    """In any file of the report, and on either stream."""
    leaks = [
        Ran(1, {}, "", "", {"evidence/a.mcap": b"x" + arena.secret.encode()}),
        Ran(1, {}, arena.secret, "", {}),
        Ran(1, {}, "", arena.secret, {}),
    ]
    assert [len(texts(arena, leak)) for leak in leaks] == [1, 1, 1]


def test_a_file_outside_is_blamed_on_the_attack_that_it_names(arena: Arena) -> None:
    """A marker carries the number of its attack."""
    (arena.outside / "marker-a24").touch()
    assert [(found.number, found.text) for found in arena.findings()] == [(24, "marker-a24 was written outside")]


def test_what_arrives_is_noticed(arena: Arena) -> None:
    """A connection and a packet, at the addresses that attacks are told."""
    told: dict[str, Any] = {}
    exec(arena.planted(), told)
    with socket.create_connection(told["TCP"][0]), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(b"x", told["UDP"][0])
        assert texts(arena) == ["a connection arrived", "a packet arrived"]


def test_temporary_files_are_noticed(arena: Arena) -> None:
    """What the grader leaves in its temporary folder is a finding."""
    (arena.base / "tmp" / "grade-left").mkdir()
    assert texts(arena) == ["tmp holds grade-left"]


def test_a_harmed_bystander_is_noticed(arena: Arena) -> None:
    """A lower priority is enough."""
    os.setpriority(os.PRIO_PROCESS, arena.bystander_pid, os.getpriority(os.PRIO_PROCESS, arena.bystander_pid) + 1)
    assert texts(arena) == ["a process of the instructor's was changed"]


def test_a_process_whose_parent_is_gone_is_noticed_and_ended(arena: Arena) -> None:
    """It has become a child of whoever watches, and does not survive the look."""
    sleep = [sys.executable, "-I", "-S", "-c", "import time; time.sleep(99)", arena.mark]
    subprocess.run([sys.executable, "-I", "-c", f"import subprocess; subprocess.Popen({sleep!r})"], check=True)
    arena.patience_s = 1.0  # this one is ended by nobody else
    (found,) = texts(arena)
    assert found.startswith("processes were left")
    assert texts(arena) == []


def test_a_process_that_another_test_has_started_is_no_leftover(arena: Arena) -> None:
    """Such as a worker that takes the place of another one meanwhile."""
    arena.patience_s = 0.0
    with subprocess.Popen([sys.executable, "-I", "-S", "-c", "import time; time.sleep(99)"]) as started:
        assert texts(arena) == []
        assert started.poll() is None
        started.kill()


def report(**outcomes: str) -> dict[str, Any]:
    log = {"id": "a01__log", "outcome": "met", "reason": "", "evidence": {"first": outcomes.pop("said")}}
    criteria = [{"id": f"a01__{what}", "outcome": outcome, "reason": ""} for what, outcome in outcomes.items()]
    return {"exercises": [{"criteria": [*criteria, log]}]}


def test_an_attack_that_says_that_it_escaped_is_believed() -> None:
    """A node tells which of its attempts succeeded."""
    right = {"topic": "met", "rate": "met", "speed": "met"}
    assert list(objections(report(said="2 attempts, escaped: none", **right), "a01", "honest")) == []
    assert list(objections(report(said="2 attempts, escaped: reads", **right), "a01", "honest")) == ["escaped: reads"]
    assert len(list(objections(report(said="hello", **right), "a01", "honest"))) == 1


def test_a_busy_machine_is_no_success_of_an_honest_node() -> None:
    """It cannot tell what it tried if nothing was seen of it, and it has gained nothing."""
    unseen = dict.fromkeys(("topic", "rate", "speed", "log"), "undecided")
    criteria = [
        {"id": f"a01__{what}", "outcome": outcome, "reason": "", "evidence": {}} for what, outcome in unseen.items()
    ]
    assert list(objections({"exercises": [{"criteria": criteria}]}, "a01", "honest")) == []
    assert len(list(objections({"exercises": [{"criteria": criteria}]}, "a01", "slow"))) == 4


@pytest.mark.parametrize("rate", ["met", "partly", "undecided"])
def test_a_slow_node_must_not_get_its_rate(rate: str) -> None:
    """An attack that improves a verdict, or makes it undecided, is not contained."""
    found = objections(report(said="1 attempts, escaped: none", topic="met", rate=rate, speed="met"), "a01", "slow")
    assert len(list(found)) == 1


def test_a_node_that_was_not_judged_is_no_success() -> None:
    """An empty report proves nothing."""
    assert list(objections({}, "a01", "whatever")) == ["it was not judged"]


BAD = {
    "an image": ("html", b'<p><img src=x onerror="attack69()"></p>'),
    "a script": ("html", b"<script>var a = 'attack69()'</script>"),
    "data cut short": ("html", b'<script type="application/json">{"a": "</script><b>attack69</b>"}</script>'),
    "a link": ("html", b'<a href="javascript:attack69()">x</a>'),
    "markup in markdown": ("markdown", b"text <svg onload=attack69()> text"),
    "a command": ("text", b"a\n   ::add-mask::attack70\n"),
    "an old command": ("text", b"##[error]attack70\n"),
    "an annotation": ("github", b"::error file=x::attack70\n"),
    "an escape sequence": ("text", b"\x1b[31mattack70"),
    "a direction": ("html", "<p>\u202eattack70</p>".encode()),
    "a formula": ("csv", b'a,"=HYPERLINK(attack71)"\n'),
    "not XML": ("junit", b"<testsuites>\x1b</testsuites>"),
    "not JSON": ("json", b'{"score": NaN}'),
    "markup on a platform": ("gradescope", b'{"output": "<iframe src=x>", "output_format": "html"}'),
    "not UTF-8": ("text", b"\xff"),
}


def test_the_reports_of_every_format_are_looked_at() -> None:
    """By a reader that knows what hostile text could do in it."""
    assert {*FORMATS, "csv"} == set(hostile_reports.READERS)


@pytest.mark.parametrize(("format_", "content"), BAD.values(), ids=BAD)
def test_hostile_text_that_came_through_is_noticed(format_: str, content: bytes) -> None:
    """Each of these reports would do what its hostile text wants."""
    assert list(hostile_reports.objections(format_, content))


GOOD = {
    "an escaped image": ("html", b"<p>&lt;img src=x onerror=attack69()&gt;</p>"),
    "whole data": ("html", b'<script type="application/json">{"a": "\\u003c/script>attack69"}</script>'),
    "code in markdown": ("markdown", b"`<img src=x onerror=attack69()>`"),
    "a command in a sentence": ("text", b"it printed ::add-mask::attack70\n"),
    "our own annotation": ("github", b"::error file=x.py,line=3::velocity_publisher: %3A%3Aattack70\n"),
    "a formula as text": ("csv", b"a,'=HYPERLINK(attack71)\n"),
}


@pytest.mark.parametrize(("format_", "content"), GOOD.values(), ids=GOOD)
def test_hostile_text_that_stayed_text_is_let_pass(format_: str, content: bytes) -> None:
    """Quoting a hostile text is what a report is for."""
    assert list(hostile_reports.objections(format_, content)) == []
