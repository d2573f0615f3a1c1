"""A machine is examined by trying it: ROS, messages, sandboxes; `grade doctor` says what was found."""

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn

import pytest

from grader.grading.app.doctor import concluded, examine
from grader.grading.app.grade import Progress
from grader.grading.app.observe import ObserveRequest
from grader.grading.reporting.doctor import checkup_to_json, render_checkup
from grader.runtime import machine
from grader.runtime.model.checkup import Checkup, Fact, TierReport
from grader.runtime.model.errors import EnvironmentFault, HarnessError
from grader.runtime.model.limits import Limits
from grader.runtime.sandbox.tiers import is_for_others

#: The tier of bubblewrap that is for another user than the one who runs this, and the one that is not.
OTHERS, OWN = sorted(("bubblewrap-root", "bubblewrap"), key=is_for_others, reverse=True)
BY_OTHERS = TierReport(OTHERS, "A2", usable=False, why="another user", remedy="run it as another user")
BY_USER = TierReport(OWN, "A1", usable=False, why="none", remedy="install bubblewrap")
HOLDS = TierReport("landlock", "C", usable=True, why="")


def say_nothing(step: str) -> None:
    pass


class Look:
    """Observes no node, but says that all its messages came; notes in which tiers it was to look."""

    def __init__(self) -> None:
        self.tiers: list[str] = []

    def __call__(self, request: ObserveRequest, progress: Progress) -> Any:
        progress("observing")
        self.tiers.append(request.isolation)
        assert "rclpy.init()" in request.files[0].read_text()
        return SimpleNamespace(topics=[SimpleNamespace(name="/trial", messages=10)], faults=[])


def test_the_strongest_tier_that_holds_is_used() -> None:
    """Messages are exchanged in the sandbox that grading would use."""
    look = Look()
    checkup = concluded((), (BY_OTHERS, BY_USER, HOLDS), say_nothing, look)
    assert (checkup.safe, checkup.used, checkup.remedy) == (True, "landlock", "")
    assert look.tiers == ["landlock"]
    assert checkup.exchange is not None
    assert (checkup.exchange.arrived, checkup.exchange.problem) == (10, "")


def test_it_says_where_nodes_cannot_be_forked() -> None:
    """Every start takes longer there: entering all namespaces at once needs a newer kernel."""
    (fact,) = concluded((), (HOLDS,), say_nothing, Look()).facts
    assert fact == Fact("start of nodes", "each is forked from a process that has imported ROS")
    executed = machine.node_start("bubblewrap", can_fork=False)
    assert executed.value.endswith("to be forked into bubblewrap, it needs Linux 5.8 or newer")


def test_without_a_sandbox_messages_are_tried_all_the_same() -> None:
    """It is a node of our own; and what helps this user comes before becoming another."""
    look = Look()
    checkup = concluded((), (BY_OTHERS, BY_USER), say_nothing, look)
    assert (checkup.safe, checkup.used, checkup.remedy) == (False, "", "install bubblewrap")
    assert look.tiers == ["none"]


def test_a_run_that_fails_is_a_finding() -> None:
    """The checkup goes on, and says what failed."""

    def fail(request: ObserveRequest, progress: Progress) -> NoReturn:
        raise HarnessError("the worker died")

    checkup = concluded((), (HOLDS,), say_nothing, fail)
    assert checkup.exchange is not None
    assert checkup.exchange.problem == "the worker died"
    assert not checkup.safe


def test_without_ros_the_rest_is_told() -> None:
    """The remedy is the one that grading would name; no sandbox can be tried."""

    def none() -> NoReturn:
        raise EnvironmentFault("ROS 2: expected rclpy, found none in this environment", "pip install it")

    checkup = examine(say_nothing, lambda: machine.ros_here(none))
    assert not checkup.safe
    text = render_checkup(checkup, width=200, colour=False)
    assert text.startswith("grading is NOT SAFE here\n  ROS 2: expected rclpy, found none in this environment\n")
    assert "fix: pip install it\n" in text
    assert "  kernel " in text


def test_bubblewrap_that_is_not_there_is_told_with_its_command(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Other sandboxes may hold, so this alone is no problem."""
    monkeypatch.setenv("PATH", str(tmp_path))
    fact = next(fact for fact in machine.software(None) if fact.name == "bubblewrap")
    assert (fact.value, fact.fits) == ("not installed", True)
    assert fact.remedy.endswith("install -y bubblewrap")


def test_an_outdated_program_is_told_with_its_update(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """In one line, as text and as JSON; it does not make grading unsafe."""
    old = tmp_path / "bwrap"
    old.write_text("#!/bin/sh\necho bubblewrap 0.8.0\n")
    old.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    facts = [fact for fact in machine.weaknesses(None) if "bubblewrap" in fact.value]
    assert len(facts) == 1
    checkup = Checkup(tuple(facts), None, (), "", "", Limits())
    text = render_checkup(checkup, width=200, colour=False)
    assert sum("known weakness" in line for line in text.splitlines()) == 1
    assert "fix: install the updates of your distribution, or bubblewrap 0.12.0 or newer" in text
    (told,) = json.loads(checkup_to_json(checkup))["facts"]
    assert (told["name"], told["fits"], told["remedy"]) == ("known weakness", True, facts[0].remedy)


def test_a_setting_that_forbids_namespaces_is_told_with_both_commands(tmp_path: Path) -> None:
    """One for now, as a CI runner wants it, and one for good."""
    name = "kernel.apparmor_restrict_unprivileged_userns"
    setting = tmp_path / "kernel" / name.partition(".")[2]
    setting.parent.mkdir()
    setting.write_text("1\n")
    fact = machine.namespaces(f"sudo sysctl -w {name}=0", tmp_path)
    assert fact.value == f"kept from ordinary users by {name}=1"
    assert fact.remedy.startswith(f"sudo sysctl -w {name}=0 (")
    assert f"echo {name}=0 | sudo tee /etc/sysctl.d/" in fact.remedy


@pytest.mark.parametrize(("room", "fits"), [(1 << 40, True), (1 << 20, False)])
def test_too_little_room_is_told(room: int, fits: bool) -> None:
    """Memory and disk below what one scenario needs."""
    for fact in (machine.memory(room), machine.scratch("/tmp", room)):
        assert fact.fits is fits
        assert bool(fact.remedy) is not fits


def test_a_machine_that_tells_no_memory_is_no_problem() -> None:
    """Nothing is known against it."""
    assert machine.memory(None) == Fact("memory", "unknown")


@pytest.mark.long
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
