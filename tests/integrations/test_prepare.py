"""What `prepare` changes on which machine, with stand-ins for all that would change one."""

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from places import ROOT

pytestmark = pytest.mark.slow

RESTRICTION = "sys/kernel/apparmor_restrict_unprivileged_userns"
SYSCTL = "sysctl --quiet --write kernel.apparmor_restrict_unprivileged_userns=0"
Prepare = Callable[..., tuple[list[str], str]]


@pytest.fixture
def machine(tmp_path: Path) -> Prepare:
    """Return a function that prepares a machine and tells what was run on it."""
    programs, calls = tmp_path / "bin", tmp_path / "calls"
    (tmp_path / "venv" / "bin").mkdir(parents=True)
    programs.mkdir()
    for name in ("bash", "cat", "env"):
        (programs / name).symlink_to(shutil.which(name) or name)

    def stand_in(path: Path, ends: int = 0, does: str = "") -> None:
        path.write_text(f'#!/bin/sh\necho "{path.name} $*" >> {calls}\n{does}\nexit {ends}\n')
        path.chmod(0o755)

    def prepare(
        *package: str,
        user: int = 0,
        restricted: str | None = "1",
        bwrap: bool = True,
        sysctl: int = 0,
        **environment: str,
    ) -> tuple[list[str], str]:
        stand_in(tmp_path / "venv" / "bin" / "python")
        stand_in(programs / "id", does=f"echo {user}")
        stand_in(programs / "apt-get")
        stand_in(programs / "sysctl", ends=sysctl)
        stand_in(programs / "sudo", does='shift; exec "$@"')
        if bwrap:
            stand_in(programs / "bwrap")
        if restricted is not None:
            (tmp_path / RESTRICTION).parent.mkdir(parents=True)
            (tmp_path / RESTRICTION).write_text(f"{restricted}\n")
        words: list[str | Path] = [
            programs / "bash",
            ROOT / "integrations" / "prepare",
            tmp_path / "venv",
            *package,
        ]
        surroundings = {"PATH": str(programs), "PROC": str(tmp_path), **environment}
        done = subprocess.run(words, env=surroundings, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return [line for line in calls.read_text().splitlines() if not line.startswith("id ")], done.stderr

    return prepare


PACKAGE = ("a wheel.whl", "pins.txt")
PIP = "python -I -m pip install --quiet --disable-pip-version-check --constraint pins.txt a wheel.whl"


def test_on_github_s_machines_namespaces_are_allowed(machine: Prepare) -> None:
    """Their user is not root, but may become it."""
    calls, _ = machine(*PACKAGE, user=1001, RUNNER_ENVIRONMENT="github-hosted")
    assert calls == [f"sudo -n {SYSCTL}", SYSCTL, PIP]


@pytest.mark.parametrize("environment", [{"RUNNER_ENVIRONMENT": "self-hosted"}, {}])
def test_nobody_else_s_machine_is_changed(machine: Prepare, environment: dict[str, str]) -> None:
    """It may live for years."""
    assert machine(*PACKAGE, user=1001, **environment)[0] == [PIP]


@pytest.mark.parametrize("restricted", ["0", None])
def test_what_is_not_restricted_is_left_alone(machine: Prepare, restricted: str | None) -> None:
    """Other systems do not even have the setting."""
    assert machine(*PACKAGE, restricted=restricted, RUNNER_ENVIRONMENT="github-hosted")[0] == [PIP]


def test_a_setting_that_cannot_be_changed_is_not_the_end(machine: Prepare) -> None:
    """In a container it is read-only; which sandbox holds is found out later."""
    calls, said = machine(*PACKAGE, sysctl=1, RUNNER_ENVIRONMENT="github-hosted")
    assert calls == [SYSCTL, PIP]
    assert "another sandbox will be tried" in said


def test_bubblewrap_is_installed_where_it_is_missing(machine: Prepare) -> None:
    """From the distribution."""
    calls, _ = machine(*PACKAGE, bwrap=False)
    assert calls[0] == "apt-get update -qq"
    assert calls[1] == "apt-get install -y -qq --no-install-recommends bubblewrap"


def test_a_complete_environment_is_left_alone(machine: Prepare) -> None:
    """It comes from a cache; the machine is new all the same."""
    calls, _ = machine(bwrap=False, user=1001, RUNNER_ENVIRONMENT="github-hosted")
    assert "apt-get install -y -qq --no-install-recommends bubblewrap" in calls
    assert calls[-1] == SYSCTL
