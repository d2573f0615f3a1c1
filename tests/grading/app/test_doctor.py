"""A machine is examined by trying it: ROS, messages, sandboxes; `grade doctor` says what was found."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import NoReturn

import pytest
from click.testing import CliRunner

from grader.cli.main import app
from grader.grading.app import doctor
from grader.grading.app.observe import ObserveRequest
from grader.grading.reporting.doctor import checkup_to_json, render_checkup
from grader.runtime import machine
from grader.runtime.model.checkup import Checkup, Fact, TierReport
from grader.runtime.model.errors import EnvironmentFault, HarnessError
from grader.runtime.model.limits import Limits

BY_ROOT = TierReport("bubblewrap-root", "A2", usable=False, why="not root", remedy="run it with sudo")
BY_USER = TierReport("bubblewrap", "A1", usable=False, why="none", remedy="install bubblewrap")
HOLDS = TierReport("landlock", "C", usable=True, why="")


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str]]:
    """Replace what starts processes; returns what was observed, with which tier."""
    seen: list[tuple[str, str]] = []

    def observe(request: ObserveRequest, progress: Callable[[str], None]) -> SimpleNamespace:
        progress("observing")
        seen.append((request.isolation, request.files[0].read_text()))
        return SimpleNamespace(topics=[SimpleNamespace(name="/trial", messages=10)], faults=[])

    monkeypatch.setattr(machine, "find_ros", lambda: None)
    monkeypatch.setattr(machine, "software", lambda ros: ())
    monkeypatch.setattr(machine, "weaknesses", lambda ros: ())
    monkeypatch.setattr(doctor, "observe", observe)
    monkeypatch.setattr(machine, "is_for_others", lambda name: name == "bubblewrap-root")
    return seen


def examined(monkeypatch: pytest.MonkeyPatch, *tiers: TierReport) -> Checkup:
    monkeypatch.setattr(machine, "find_ros", lambda: SimpleNamespace(runtime=None, distro="jazzy"))
    monkeypatch.setattr(machine, "inspect_tiers", lambda ros: tiers)
    monkeypatch.setattr(machine, "byte_code", lambda runtime: Fact("byte code", "up to date"))
    monkeypatch.setattr(machine, "isolation_from_name", lambda name: SimpleNamespace(can_fork=name == "landlock"))
    monkeypatch.setattr(machine, "sandbox_memory", lambda ros: Fact("sandbox check", "remembered"))
    return doctor.examine(lambda step: None)


def test_the_strongest_tier_that_holds_is_used(
    monkeypatch: pytest.MonkeyPatch, stand_in: list[tuple[str, str]]
) -> None:
    """Messages are exchanged in the sandbox that grading would use."""
    checkup = examined(monkeypatch, BY_ROOT, BY_USER, HOLDS)
    assert (checkup.safe, checkup.used, checkup.remedy) == (True, "landlock", "")
    assert [isolation for isolation, _ in stand_in] == ["landlock"]


def test_it_says_where_nodes_cannot_be_forked(monkeypatch: pytest.MonkeyPatch, stand_in: list[tuple[str, str]]) -> None:
    """Every start takes longer there: entering all namespaces at once needs a newer kernel."""
    nested = TierReport("bubblewrap", "A1", usable=True, why="")
    forked, executed = (
        next(fact.value for fact in examined(monkeypatch, tier).facts if fact.name == "start of nodes")
        for tier in (HOLDS, nested)
    )
    assert forked == "each is forked from a process that has imported ROS"
    assert executed.endswith("to be forked into bubblewrap, it needs Linux 5.8 or newer")
    assert len(stand_in) == 2


def test_without_a_sandbox_messages_are_tried_all_the_same(
    monkeypatch: pytest.MonkeyPatch, stand_in: list[tuple[str, str]]
) -> None:
    """It is a node of our own; and what helps this user comes before becoming another."""
    checkup = examined(monkeypatch, BY_ROOT, BY_USER)
    assert (checkup.safe, checkup.used, checkup.remedy) == (False, "", "install bubblewrap")
    assert [isolation for isolation, _ in stand_in] == ["none"]


def test_a_run_that_fails_is_a_finding(monkeypatch: pytest.MonkeyPatch, stand_in: list[tuple[str, str]]) -> None:
    """The checkup goes on, and says what failed."""

    def fail(request: ObserveRequest, progress: Callable[[str], None]) -> NoReturn:
        raise HarnessError("the worker died")

    monkeypatch.setattr(doctor, "observe", fail)
    checkup = examined(monkeypatch, HOLDS)
    assert checkup.exchange is not None
    assert checkup.exchange.problem == "the worker died"
    assert not checkup.safe


def test_without_ros_the_rest_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """The remedy is the one that grading would name; no sandbox can be tried."""

    def none() -> NoReturn:
        raise EnvironmentFault("ROS 2: expected rclpy, found none in this environment", "pip install it")

    monkeypatch.setattr(machine, "find_ros", none)
    result = CliRunner().invoke(app, ["doctor"])
    assert result.exit_code == 2
    assert result.stdout.startswith(
        "grading is NOT SAFE here\n  ROS 2: expected rclpy, found none in this environment\n"
    )
    assert "fix: pip install it\n" in result.stdout
    assert "  kernel " in result.stdout


def test_bubblewrap_that_is_not_there_is_told_with_its_command(monkeypatch: pytest.MonkeyPatch) -> None:
    """Other sandboxes may hold, so this alone is no problem."""
    monkeypatch.setattr(shutil, "which", lambda name: None)
    fact = next(fact for fact in machine.software(None) if fact.name == "bubblewrap")
    assert (fact.value, fact.fits) == ("not installed", True)
    assert fact.remedy.endswith("install -y bubblewrap")


def test_known_weaknesses_are_told_with_their_fixes(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line each, as text and as JSON; none of them makes grading unsafe."""
    monkeypatch.setattr(machine, "_said_by", lambda program: "bubblewrap 0.8.0")
    monkeypatch.setattr(machine, "repaired_here", frozenset)
    monkeypatch.setattr(shutil, "which", lambda name: __file__)
    facts = [fact for fact in machine.weaknesses(None) if "bubblewrap" in fact.value]
    assert [fact.value.split(": ")[:2] for fact in facts] == [["bubblewrap 0.8.0", "CVE-2026-87766"]]
    checkup = Checkup(tuple(facts), None, (), "", "", Limits())
    text = render_checkup(checkup, width=200, colour=False)
    assert sum("known weakness" in line for line in text.splitlines()) == 1
    assert "fix: install the updates of your distribution, or bubblewrap 0.12.0 or newer" in text
    (told,) = json.loads(checkup_to_json(checkup))["facts"]
    assert (told["name"], told["fits"], told["remedy"]) == ("known weakness", True, facts[0].remedy)


def test_a_setting_that_forbids_namespaces_is_told_with_both_commands(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """One for now, as a CI runner wants it, and one for good."""
    name = "kernel.apparmor_restrict_unprivileged_userns"
    setting = tmp_path / "kernel" / name.partition(".")[2]
    setting.parent.mkdir()
    setting.write_text("1\n")
    monkeypatch.setattr(machine, "SETTINGS_FOLDER", tmp_path)
    monkeypatch.setattr(machine, "setting_command", lambda: f"sudo sysctl -w {name}=0")
    fact = next(fact for fact in machine.system() if fact.name == "user namespaces")
    assert fact.value == f"kept from ordinary users by {name}=1"
    assert fact.remedy.startswith(f"sudo sysctl -w {name}=0 (")
    assert f"echo {name}=0 | sudo tee /etc/sysctl.d/" in fact.remedy


@pytest.mark.parametrize(("memory", "space", "fits"), [(1 << 40, 1 << 40, True), (1 << 20, 1 << 20, False)])
def test_too_little_room_is_told(monkeypatch: pytest.MonkeyPatch, memory: int, space: int, fits: bool) -> None:
    """Memory and disk below what one scenario needs."""
    monkeypatch.setattr(machine, "_available_memory", lambda: memory)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=space))
    facts = {fact.name: fact for fact in machine.system()}
    for name in ("memory", "temporary files"):
        assert facts[name].fits is fits
        assert bool(facts[name].remedy) is not fits


@pytest.mark.ros
def test_a_real_machine_is_examined() -> None:
    """The real command: versions, ten messages over DDS, all tiers; the exit code is the verdict's."""
    done = subprocess.run(
        [sys.executable, "-c", "from grader.cli.main import main; main()", "doctor", "--json"],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    data = json.loads(done.stdout)
    assert done.returncode == (0 if data["safe"] else 2)
    assert data["exchange"]["arrived"] == data["exchange"]["expected"] == 10
    assert [tier["tier"] for tier in data["tiers"]] == ["A2", "A1", "B", "C", "D"]
    facts = {fact["name"]: fact["value"] for fact in data["facts"]}
    assert facts["RMW"].startswith("rmw_fastrtps_cpp ")
    assert "Fast DDS" in facts["RMW"]
    assert {"grader", "Python", "ROS 2", "rclpy", "bubblewrap", "kernel", "user", "Landlock"} <= set(facts)
