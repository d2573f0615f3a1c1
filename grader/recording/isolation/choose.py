"""Chooses the tier of isolation by trying it, not by looking at versions."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path

import grader
from grader.model.containment import PROPERTIES, TIERS, Property, TierReport
from grader.model.errors import EnvironmentFault
from grader.recording.isolation import bubblewrap, flat, landlock, plain, probe
from grader.recording.isolation.bubblewrap import Bubblewrap
from grader.recording.isolation.flat import FlatBubblewrap
from grader.recording.isolation.landlock import Landlock
from grader.recording.isolation.plain import Plain
from grader.recording.isolation.protocol import Command, Isolation, Limits, StudentProcess
from grader.recording.ros_installation import RosInstallation

AUTO = "auto"
NAMES = (bubblewrap.ROOT_NAME, bubblewrap.USER_NAME, plain.NAME)
PROBE_S = 10.0


def choose_isolation(wanted: str, ros: RosInstallation) -> Isolation:
    """Return the isolation to record in.

    Args:
        wanted: `auto` for the strongest that holds on this machine, which may be none (`Plain.why` then says why; the
            caller warns); `none` for no walls; or the name of a tier, which must hold.
        ros: What students' processes will run with.

    Raises:
        EnvironmentFault: The tier asked for does not exist or does not hold here.
    """
    if wanted == plain.NAME:
        return Plain()
    if wanted not in (AUTO, *NAMES):
        raise EnvironmentFault(f"isolation: expected auto or one of {', '.join(NAMES)}, found {wanted}")
    try:
        isolation = Bubblewrap.here()
        why = why_not(isolation, ros)
    except EnvironmentFault as fault:
        if wanted != AUTO:
            raise
        return Plain(f"{fault.message}; {fault.hint}" if fault.hint else fault.message)
    if wanted not in (AUTO, isolation.name):
        raise EnvironmentFault(f"isolation: {wanted} is for another user than this one, found {isolation.name}")
    if why and wanted != AUTO:
        raise EnvironmentFault(f"isolation: {isolation.name} does not hold on this machine: {why}")
    return Plain(why) if why else isolation


def inspect_tiers(ros: RosInstallation) -> tuple[TierReport, ...]:
    """Try every tier and return what each is worth here, strongest first; the tier without walls comes last."""
    reports = [_inspected(name, ros) for name in NAMES if name != plain.NAME]
    open_ones = tuple(Property(name, holds=False, mechanism="none") for name in PROPERTIES)
    nothing = TierReport(
        plain.NAME, TIERS[plain.NAME], usable=False, why="it contains nothing; ask for it by name", properties=open_ones
    )
    return (*reports, nothing)


def _inspected(name: str, ros: RosInstallation) -> TierReport:
    try:
        isolation = Bubblewrap.here()
    except EnvironmentFault as fault:
        return TierReport(name, TIERS[name], usable=False, why=fault.message, remedy=fault.hint)
    if name != isolation.name:
        return TierReport(name, TIERS[name], usable=False, why=f"it is for another user; this one has {isolation.name}")
    why = why_not(isolation, ros)
    return TierReport(name, TIERS[name], usable=not why, why=why)


def isolation_from_name(name: str) -> Isolation:
    """Return the isolation that another process chose, without trying it again.

    Raises:
        EnvironmentFault: There is no such tier.
    """
    if name not in TIERS:
        raise EnvironmentFault(f"isolation: expected one of {', '.join(TIERS)}, found {name}")
    if name == landlock.NAME:
        return Landlock.here()
    if name == flat.NAME:
        return FlatBubblewrap.here()
    return Plain() if name == plain.NAME else Bubblewrap.here()


def why_not(isolation: Isolation, ros: RosInstallation) -> str:
    """Start one small process inside both walls and return why they do not hold; empty if they do."""
    with tempfile.TemporaryDirectory(prefix="grade-probe-") as folder:
        canary, submission = Path(folder) / "canary", Path(folder) / "submission"
        canary.write_text("canary", encoding="utf-8")
        submission.mkdir()
        package = Path(grader.__file__).resolve().parent
        request = {
            "hidden": list(map(str, (canary, package / "model", package / "judging", "/etc/passwd"))),
            "readable": [isolation.submission_seen_at, isolation.host_seen_at, *_needed(ros)],
            "submission": isolation.submission_seen_at,
        }
        source = Path(probe.__file__).read_text(encoding="utf-8")
        process = StudentProcess(
            runtime=ros.runtime,
            host_folder=package / "host",
            submission=submission,
            arguments=("-I", "-S", "-c", source, json.dumps(request)),
            environment={},
            pass_fds=(),
        )
        student = isolation.student_command(process, Limits())
        try:
            # The student's command may be the worker itself: no Python has to start in between.
            worker = isolation.worker_command(student.argv, student.environment, student.pass_fds)
            return _verdict(worker)
        finally:
            for descriptor in student.opened_fds:
                os.close(descriptor)


def _needed(ros: RosInstallation) -> list[str]:
    folders = [str(path) for path in (*ros.runtime.library_paths, *ros.runtime.python_paths)]
    return [folder for folder in folders if os.path.isdir(folder)]  # noqa: PTH112 -- strings for JSON


def _verdict(command: Command) -> str:
    try:
        done = subprocess.run(
            command.argv,
            env=dict(command.environment),
            pass_fds=command.pass_fds,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=PROBE_S,
            start_new_session=True,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"the probe did not end within {PROBE_S:.0f} s"
    said = done.stderr.decode("utf-8", "replace").strip().splitlines()
    if done.returncode != 0:
        return said[-1][:300] if said else f"the probe ended with code {done.returncode}"
    holds: Mapping[str, bool] = json.loads(done.stdout)
    broken = [name for name, held in holds.items() if not held]
    return f"it does not do this: {', '.join(broken)}" if broken else ""
