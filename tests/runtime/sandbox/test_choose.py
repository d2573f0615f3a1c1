"""Which tier is taken, what the self-test sees, what is remembered, and what is refused."""

import json
import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from places import ROOT
from sandboxes import USER, find_sandbox, opened_start, unreachable
from tiers import tiers

import grader
from grader.runtime.model.checkup import NO_SANDBOX, PROPERTIES, REQUIRED, TIERS, Property, TierReport, missing
from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.ros_installation import RosInstallation, find_ros
from grader.runtime.sandbox import memory, selftest
from grader.runtime.sandbox import properties as remedies
from grader.runtime.sandbox.bubblewrap import Bubblewrap
from grader.runtime.sandbox.choose import Machine, choose_isolation, inspect_tier, inspect_tiers, sandbox_memory
from grader.runtime.sandbox.memory import Memory, circumstances
from grader.runtime.sandbox.properties import NO_EXCHANGE
from grader.runtime.sandbox.protocol import Isolation
from grader.runtime.sandbox.tiers import ISOLATING, Plain, isolation_from_name
from grader.runtime.temp_dirs import OWN

MAIN = "from grader.cli.main import main; main()"
CONTAINER = Path(__file__).with_name("containers.py")
ALL_HOLD = tuple(Property(name, holds=True, mechanism="a wall") for name in PROPERTIES)


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Tests remember nothing of each other, and nothing of the user's."""
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / OWN


def report(name: str = "bubblewrap", properties: tuple[Property, ...] = ALL_HOLD, **changes: Any) -> TierReport:
    return TierReport(name, TIERS[name], **{"usable": True, "why": "", "properties": properties, **changes})


def without(*names: str) -> tuple[Property, ...]:
    """Return properties of which these do not hold."""
    return tuple(replace(found, holds=found.name not in names) for found in ALL_HOLD)


class Offered(Plain):
    """A tier that this machine has, whatever it needs."""

    def __init__(self, name: str) -> None:
        self.name = name  # type: ignore[misc]


class Trials:
    """A machine that has every tier, and the reports that its self-tests make."""

    def __init__(self, ros: RosInstallation) -> None:
        self.asked: list[str] = []  # the tiers that were tested
        self.reports: dict[str, TierReport] = {}  # what is found, by tier; every other tier holds
        self.machine = Machine(ros, Offered, self._inspected, lambda name: name == "bubblewrap-root")

    def _inspected(self, isolation: Isolation, ros: RosInstallation) -> TierReport:
        assert ros is self.machine.ros
        self.asked.append(isolation.name)
        return self.reports.get(isolation.name, report(isolation.name))


@pytest.fixture
def trials(ros: RosInstallation) -> Trials:
    return Trials(ros)


# --- the choice ---


def test_the_strongest_tier_that_holds_is_taken(trials: Trials) -> None:
    """Weaker ones are not even tried."""
    trials.reports["bubblewrap-root"] = report("bubblewrap-root", (), usable=False, why="no process runs in it")
    trials.reports["bubblewrap"] = report("bubblewrap", without("shm"), usable=False, why="shm NOT CONTAINED")
    chosen = choose_isolation("auto", trials.machine)
    assert chosen.isolation.name == "bubblewrap-flat"
    assert chosen.containment == ALL_HOLD
    assert trials.asked == ["bubblewrap-root", "bubblewrap", "bubblewrap", "bubblewrap-flat"], "the broken one twice"


@pytest.mark.parametrize("name", REQUIRED)
def test_without_a_required_property_auto_refuses(trials: Trials, name: str) -> None:
    """Whichever it is; the tiers, what they lack and what to do are told."""
    for tier in ISOLATING:
        trials.reports[tier] = report(tier, without(name), usable=False, why=f"{name} NOT CONTAINED")
    with pytest.raises(EnvironmentFault, match=f"landlock: not contained: {name}") as refused:
        choose_isolation("auto", trials.machine)
    assert "bubblewrap-root" not in refused.value.message, "no news for this user"
    assert refused.value.hint


@pytest.mark.parametrize("name", sorted(set(PROPERTIES) - set(REQUIRED)))
def test_what_is_not_required_is_told_and_not_refused(trials: Trials, name: str) -> None:
    """The report carries it."""
    trials.reports["bubblewrap-root"] = report("bubblewrap-root", without(name))
    containment = choose_isolation("auto", trials.machine).containment
    assert [found.name for found in containment if not found.holds] == [name]


def test_a_tier_asked_for_by_name_must_keep_its_promises(trials: Trials, cache: Path) -> None:
    """Landlock promises nothing about the network that it was given; every other tier does."""
    for tier in ISOLATING:
        trials.reports[tier] = report(tier, without("net_egress"), usable=False, why="net_egress NOT CONTAINED")
    assert choose_isolation("landlock", trials.machine).isolation.name == "landlock"
    with pytest.raises(EnvironmentFault, match=r"bubblewrap-flat: .*net_egress"):
        choose_isolation("bubblewrap-flat", trials.machine)
    next(cache.glob("sandbox-landlock-*.json")).unlink()
    trials.reports["landlock"] = report(
        "landlock", without("net_egress", "fs_write"), usable=False, why="fs_write open"
    )
    with pytest.raises(EnvironmentFault, match="fs_write"):
        choose_isolation("landlock", trials.machine)


def test_none_is_taken_at_its_word(trials: Trials) -> None:
    """Nothing is tried, and nothing is said to be contained."""
    chosen = choose_isolation("none", trials.machine)
    assert (chosen.isolation.name, chosen.containment, trials.asked) == (NO_SANDBOX, (), [])


@pytest.mark.parametrize("make", [lambda name: choose_isolation(name, Machine(find_ros())), isolation_from_name])
def test_an_unknown_tier_is_a_fault_of_the_set_up(make: Callable[[str], object]) -> None:
    """The names that exist are told."""
    with pytest.raises(EnvironmentFault, match=r"expected .*bubblewrap.*, found docker"):
        make("docker")


def test_a_self_test_is_made_once(trials: Trials) -> None:
    """A second choice remembers the first one; an inspection tests anew."""
    first, second = (choose_isolation("auto", trials.machine) for _ in range(2))
    assert (first.isolation.name, first.containment) == (second.isolation.name, second.containment)
    assert trials.asked == ["bubblewrap-root"]
    assert [found.name for found in inspect_tiers(trials.machine)] == list(TIERS)
    assert trials.asked == ["bubblewrap-root", *ISOLATING]


def test_a_failed_self_test_is_made_again(trials: Trials) -> None:
    """The machine may have been busy, or was mended."""
    trials.reports["bubblewrap"] = report("bubblewrap", without("shm"), usable=False, why="shm")
    inspect_tier("bubblewrap", trials.machine)
    assert trials.asked == ["bubblewrap"] * 2, "it is tried twice, for a busy machine"
    trials.reports.clear()
    assert inspect_tier("bubblewrap", trials.machine).usable


def test_without_bubblewrap_auto_names_the_command_that_installs_it(
    ros: RosInstallation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the network is open, Landlock alone does not do."""
    monkeypatch.setattr(shutil, "which", lambda name, path=None: None)
    machine = Machine(ros, self_test=lambda *_: report("landlock", without("net_egress"), usable=False))
    with pytest.raises(EnvironmentFault, match="lacks bubblewrap, which keeps your program from harming it") as refused:
        choose_isolation("auto", machine)
    assert refused.value.hint.endswith("install -y bubblewrap")
    with pytest.raises(EnvironmentFault, match="bwrap"):
        choose_isolation("bubblewrap-flat", machine)


# --- the self-test, with real processes ---


@pytest.mark.ros
@pytest.mark.parametrize("name", tiers("bubblewrap-root", "bubblewrap", "bubblewrap-flat", "landlock"))
def test_the_self_test_passes_where_a_tier_holds(ros: RosInstallation, tmp_path: Path, name: str) -> None:
    """Everything that is required, but perhaps the network under Landlock; and a message makes the round."""
    found = find_sandbox(name, ros, tmp_path)
    if isinstance(found, str):
        pytest.skip(found)
    if found.start_as:
        pytest.skip("it is for an ordinary user")
    seen = selftest.inspect(found.isolation, ros)
    assert [lack.name for lack in missing(seen.properties)] in ([], ["net_egress"] if name == "landlock" else [])
    assert [prop.name for prop in seen.properties] == list(PROPERTIES)
    assert not [prop for prop in seen.properties if NO_EXCHANGE in prop.found]


def test_bait_is_cleared_away() -> None:
    """Its folder, its file in shared memory and its listeners."""
    with selftest.laid_bait() as bait:
        assert bait.canary.exists()
        assert bait.segment.exists()
    assert not bait.folder.exists()
    assert not bait.segment.exists()
    assert {sink.fileno() for sink in (*bait.sinks, bait.loopback)} == {-1}


@pytest.mark.ros
def test_a_probe_without_a_sandbox_gets_through_everywhere(ros: RosInstallation) -> None:
    """The attempts are real ones: where nothing holds them back they succeed."""
    seen = selftest.inspect(Plain(), ros)
    open_ones = {found.name for found in seen.properties if not found.holds}
    expected = {"fs_read", "fs_write", "procs", "signals", "shm", "dds_private"}
    assert expected <= open_ones
    assert not seen.usable


def _bubblewrap() -> Bubblewrap:
    try:
        return Bubblewrap.here()
    except EnvironmentFault as fault:
        pytest.skip(fault.message)


def _script(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "bwrap"
    path.write_text(f"#!{sys.executable} -ISB\nimport os, sys\n{text}\n", encoding="utf-8")
    path.chmod(0o755)
    return path


@pytest.mark.ros
def test_a_network_that_stays_open_is_noticed(ros: RosInstallation, tmp_path: Path) -> None:
    """A bubblewrap that quietly leaves one option out, as a broken or replaced one might."""
    real = _bubblewrap()
    leaky = _script(
        tmp_path,
        f"shown = ['--ro-bind', '{real.bwrap}', '{real.bwrap}']  # the worker starts the real one\n"
        f"os.execv('{real.bwrap}', ['bwrap', *shown, *(a for a in sys.argv[1:] if a != '--unshare-net')])",
    )
    seen = selftest.inspect(replace(real, bwrap=leaky), ros)
    names = [found.name for found in seen.properties if not found.holds]
    assert "dds_private" in names
    assert not seen.usable or "net_egress" not in names


@pytest.mark.ros
def test_a_view_that_shows_too_much_is_noticed(ros: RosInstallation) -> None:
    """The probe looks for files of the grader itself."""
    package = Path(grader.__file__).resolve().parent
    shown = replace(
        ros, runtime=replace(ros.runtime, read_paths=(*ros.runtime.read_paths, package / "runtime" / "model"))
    )
    seen = selftest.inspect(_bubblewrap(), shown)
    assert [found.name for found in seen.properties if not found.holds] == ["fs_read"]
    assert (seen.usable, "fs_read NOT CONTAINED" in seen.why) == (False, True)


def test_a_sandbox_that_cannot_start_is_noticed(ros: RosInstallation, tmp_path: Path) -> None:
    """The last words of bubblewrap are the reason."""
    words = "bwrap: No permissions to create new namespace"
    broken = _script(tmp_path, f"sys.exit('{words}')")
    seen = selftest.inspect(replace(_bubblewrap(), bwrap=broken), ros)
    assert (seen.usable, seen.properties) == (False, ())
    assert seen.why.endswith(words)


@pytest.mark.parametrize("answer", ["", "{", "[]", '{"achieved": {}}', "null"])
def test_a_trial_without_a_usable_answer_is_no_pass(ros: RosInstallation, tmp_path: Path, answer: str) -> None:
    """Whatever the worker prints instead."""
    broken = _script(tmp_path, f"print('''{answer}''')")
    assert not selftest.inspect(replace(_bubblewrap(), bwrap=broken), ros).usable


# --- what is remembered ---


def file_of(place: Memory) -> Path:
    assert place.file is not None
    return place.file


@pytest.fixture
def place(ros: RosInstallation, cache: Path) -> Memory:
    place = Memory.of("bubblewrap", ros)
    assert file_of(place).parent == cache
    return place


def test_what_is_kept_is_recalled(place: Memory) -> None:
    """Word for word; the file is the user's alone."""
    kept = report(properties=without("cpu"), remedy="a remedy")
    assert place.recall() is None
    place.keep(kept)
    assert place.recall() == kept
    assert file_of(place).stat().st_mode & 0o777 == 0o600
    assert file_of(place).parent.stat().st_mode & 0o777 == 0o700
    assert len(list(file_of(place).parent.iterdir())) == 1


def test_under_other_circumstances_nothing_is_recalled(place: Memory, ros: RosInstallation) -> None:
    """Another boot, ROS or version has another key, and what has changed is told."""
    assert place.lapse() == "none is remembered"
    place.keep(report())
    assert place.lapse() == ""
    assert Memory.of("bubblewrap", replace(ros, rclpy_version="0")).lapse() == "changed since: ROS"
    for what in place.key:
        changed = replace(place, key={**place.key, what: "another"})
        assert changed.lapse() == f"changed since: {what}"
        assert changed.recall() is None
    boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii")
    assert {("boot", boot), ("grader", grader.__version__)} < set(circumstances(ros))


def test_two_installations_of_one_user_remember_side_by_side(place: Memory, ros: RosInstallation) -> None:
    """Used in turn, they would make each other test the sandbox again."""
    other = Memory.of("bubblewrap", replace(ros, prefix=Path("/opt/other")))
    place.keep(report())
    other.keep(report())
    assert (place.lapse(), other.lapse()) == ("", "")


def test_nothing_is_forgotten_for_what_does_not_matter(
    place: Memory, ros: RosInstallation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Interfaces that containers bring and take, and byte code that the first run of a version writes."""
    monkeypatch.setattr(socket, "if_nameindex", lambda: [(1, "lo"), (2, "eth0")])
    kept = Memory.of("bubblewrap", ros)
    kept.keep(report())
    monkeypatch.setattr(socket, "if_nameindex", lambda: [(1, "lo"), (2, "eth0"), (7, "veth12ab")])
    assert Memory.of("bubblewrap", ros).lapse() == ""
    monkeypatch.setattr(socket, "if_nameindex", lambda: [(1, "lo")])
    assert Memory.of("bubblewrap", ros).lapse() == "changed since: network"
    folder = Path(memory.__file__).parent
    stamped = [Path(text.partition(" ")[0]) for what, text in circumstances(ros) if what == "grader"]
    assert {path.suffix for path in stamped if path.is_relative_to(folder)} == {".py", ".xml"}


def test_a_run_says_why_it_tries_a_sandbox(trials: Trials) -> None:
    """Once; with what is remembered nothing is tried and nothing is said. `grade doctor` knows beforehand."""
    heard: list[str] = []
    assert sandbox_memory(trials.machine).value == "a run would repeat it; bubblewrap: none is remembered"
    choose_isolation("auto", trials.machine, heard.append)
    choose_isolation("auto", trials.machine, heard.append)
    assert heard == ["trying the sandbox bubblewrap-root (none is remembered)"]
    assert sandbox_memory(trials.machine).value == "remembered for bubblewrap-root: runs do not repeat it"


def _spoil(place: Memory, text: str) -> None:
    file_of(place).write_text(text, encoding="utf-8")


def _linked(place: Memory) -> None:
    file_of(place).rename(file_of(place).parent / "x")
    file_of(place).symlink_to("x")


def _instead(place: Memory, make: Callable[[Path], object]) -> None:
    file_of(place).unlink()
    make(file_of(place))


SPOILT: dict[str, Callable[[Memory, str], object]] = {
    "empty": lambda place, text: _spoil(place, ""),
    "cut": lambda place, text: _spoil(place, text[:-20]),
    "no object": lambda place, text: _spoil(place, "[1]"),
    "deep": lambda place, text: _spoil(place, "[" * 60_000),
    "unknown tier": lambda place, text: _spoil(place, text.replace('"bubblewrap"', '"docker"')),
    "one property less": lambda place, text: _spoil(place, text.replace('"fs_read"', '"procs"')),
    "no flag": lambda place, text: _spoil(place, text.replace('"holds": true', '"holds": 1')),
    "no text": lambda place, text: _spoil(place, text.replace('"a wall"', "7")),
    "a key more": lambda place, text: _spoil(place, text.replace('"usable"', '"extra": 1, "usable"')),
    "endless": lambda place, text: _spoil(place, text + " " * 70_000),
    "open to others": lambda place, text: file_of(place).chmod(0o644),
    "a link": lambda place, text: _linked(place),
    "a folder": lambda place, text: _instead(place, Path.mkdir),
    "a pipe": lambda place, text: _instead(place, lambda file: os.mkfifo(file, 0o600)),
}


@pytest.mark.parametrize("name", SPOILT)
def test_a_broken_memory_is_ignored(place: Memory, name: str) -> None:
    """It is as if there were none."""
    place.keep(report())
    SPOILT[name](place, file_of(place).read_text(encoding="utf-8"))
    assert place.recall() is None


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file away")
def test_anothers_memory_is_ignored(place: Memory, ros: RosInstallation) -> None:
    """A file or folder that someone else owns, or may write to, says nothing."""
    place.keep(report())
    os.chown(file_of(place), USER, USER)
    assert place.recall() is None
    os.chown(file_of(place).parent, USER, USER)
    assert Memory.of("bubblewrap", ros).file is None
    os.chown(file_of(place).parent, 0, 0)
    file_of(place).parent.chmod(0o770)
    assert Memory.of("bubblewrap", ros).file is None


def test_without_a_place_nothing_is_kept(ros: RosInstallation, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A read-only home is no reason not to grade."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    place = Memory.of("bubblewrap", ros)
    place.keep(report())
    assert place.recall() is None


# --- remedies ---


def test_a_setting_that_forbids_namespaces_is_named(tmp_path: Path) -> None:
    """With the command that changes it; a setting with another value, or that does not exist, is none."""
    for folder in ("kernel", "user"):
        (tmp_path / folder).mkdir()
    (tmp_path / "kernel" / "unprivileged_userns_clone").write_text("1\n", encoding="ascii")
    (tmp_path / "user" / "max_user_namespaces").write_text("0\n", encoding="ascii")
    failed = report("bubblewrap", (), usable=False, why="no process runs in it")
    command = remedies.remedy_for(failed, tmp_path)
    assert command.removeprefix("sudo ") == "sysctl -w user.max_user_namespaces=15000"
    (tmp_path / "user" / "max_user_namespaces").write_text("15000\n", encoding="ascii")
    assert remedies.remedy_for(failed, tmp_path) == ""


def test_the_systems_own_installer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whichever it has; without a known one, that of most."""
    monkeypatch.setattr(shutil, "which", lambda name: name if name == "dnf" else None)
    assert remedies.package_command("bubblewrap").removeprefix("sudo ") == "dnf install -y bubblewrap"
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert remedies.package_command("bubblewrap").removeprefix("sudo ") == "apt-get install -y bubblewrap"


# --- whole gradings ---


def graded(start: tuple[str, ...], tmp_path: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Grade the reference solutions in some environment."""
    home = tmp_path / "home"
    home.mkdir(mode=0o777)
    home.chmod(0o777)
    for folder in (tmp_path, *tmp_path.parents[:2]):
        folder.chmod(folder.stat().st_mode | 0o755)
    argv = (*start, sys.executable, "-c", MAIN, str(ROOT / "reference_solutions"), "--json", *options)
    kept = {name: os.environ[name] for name in ("AMENT_PREFIX_PATH", "ROS_DISTRO") if name in os.environ}
    environment = {"PATH": os.environ["PATH"], "HOME": str(home), "PYTHONPATH": str(ROOT), **kept}
    return subprocess.run(argv, env=environment, capture_output=True, text=True, check=False, timeout=200, cwd=ROOT)


@pytest.mark.nightly
@pytest.mark.ros
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.long if n == "landlock" else pytest.mark.nightly) for n in ISOLATING]
)
def test_right_solutions_score_full_under_every_tier(ros: RosInstallation, tmp_path: Path, name: str) -> None:
    """In virtual time, with the same verdicts; the report names the tier and what it contains."""
    found = find_sandbox(name, ros, tmp_path)
    if isinstance(found, str):
        pytest.skip(found)
    done = graded(found.start_as, tmp_path, "--isolation", name)
    assert done.returncode == 0, done.stderr
    whole = json.loads(done.stdout)
    assert (whole["score"], {exercise["clock"] for exercise in whole["exercises"]}) == (100, {"virtual"})
    assert whole["environment"]["isolation"].startswith(f"{name} ({TIERS[name]}): fs_read by ")
    assert [found["name"] for found in whole["environment"]["containment"]] == list(PROPERTIES)


@pytest.fixture(
    params=[pytest.param(None, marks=pytest.mark.nightly), pytest.param(USER, marks=pytest.mark.long)],
    ids=["root", "user"],
)
def container(request: pytest.FixtureRequest, ros: RosInstallation) -> Callable[..., tuple[str, ...]]:
    """Return what starts a program in the stand-in for a container, by the options of its network."""
    if os.geteuid() != 0 or shutil.which("unshare") is None:
        pytest.skip("only root can stand in for a container engine")
    told = json.dumps({"user": request.param})

    def start(*network: str) -> tuple[str, ...]:
        return (*opened_start(ros, *network), "env", f"PYTHONPATH={ROOT}", sys.executable, str(CONTAINER), told)

    if blocked := unreachable(start("--net"), ros):
        pytest.skip(blocked)
    return start


@pytest.mark.nightly
@pytest.mark.ros
def test_a_container_without_a_network_is_graded_in(container: Callable[..., tuple[str, ...]], tmp_path: Path) -> None:
    """No namespace can be made there, and none is needed: Landlock and the missing network do."""
    done = graded(container("--net"), tmp_path)
    assert done.returncode == 0, done.stderr
    whole = json.loads(done.stdout)
    assert whole["score"] == 100
    assert whole["environment"]["isolation"].startswith("landlock (C): ")
    open_ones = [found["name"] for found in whole["environment"]["containment"] if not found["holds"]]
    assert open_ones == ["dds_private"]


@pytest.mark.ros
def test_a_container_with_a_network_is_refused(container: Callable[..., tuple[str, ...]], tmp_path: Path) -> None:
    """With the one thing to do about it; nobody's code has run."""
    if [name for _, name in socket.if_nameindex()] == ["lo"]:
        pytest.skip("this machine has no network")
    done = graded(container(), tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "landlock: not contained: net_egress" in done.stderr
    assert "hint: start the container without a network" in done.stderr
