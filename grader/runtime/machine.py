"""Describes this machine as far as recording depends on it: its software, its settings, and what its sandboxes hold."""

from __future__ import annotations

import ctypes
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import version
from pathlib import Path

import grader
from grader.runtime.model.checkup import Fact, TierReport
from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.model.quantities import GIB, MIB
from grader.runtime.model.releases import release_of
from grader.runtime.outdated import BUBBLEWRAP, FAST_DDS, LINUX, kernel_version, outdated, version_of
from grader.runtime.ros_installation import RosInstallation, find_ros
from grader.runtime.sandbox.bubblewrap import ENTERABLE
from grader.runtime.sandbox.choose import Machine, inspect_tiers, sandbox_memory
from grader.runtime.sandbox.properties import SETTINGS_FOLDER, has_filter, package_command, setting_command
from grader.runtime.sandbox.tiers import is_for_others, isolation_from_name
from grader.runtime.supervisor.byte_code import byte_code
from grader.runtime.supervisor.memory_groups import group_fact
from grader.runtime.supervisor.numpy_version import other_numpy

#: Disk space that staged submissions, recordings and reports may need at the same time.
MIN_SCRATCH_BYTES = 512 * MIB
#: Memory below which a scenario with two nodes, its worker and the grader may not fit.
MIN_MEMORY_BYTES = GIB

#: How long a program may take to tell its version, in seconds.
SAID_S = 60.0
_VERSION = re.compile(r"<version>\s*([0-9.]+)\s*</version>")
_CREATE_RULESET, _ASK_VERSION = 444, 1  # linux/landlock.h; the number is the same on every architecture
_PERSISTENT = "/etc/sysctl.d/60-rclpy-grader.conf"


#: The installation, or why there is none that can be used.
Found = tuple[RosInstallation | None, tuple[Fact, ...]]


def ros_here(find: Callable[[], RosInstallation] = find_ros) -> Found:
    """Find the ROS installation, or report as a fact why it cannot be used."""
    try:
        return find(), ()
    except EnvironmentFault as fault:
        return None, (Fact("ROS 2", fault.message.removeprefix("ROS 2: "), fits=False, remedy=fault.hint),)


def prepared(ros: RosInstallation) -> tuple[Fact, ...]:
    """Report what makes recording fast, or its limits sure: byte code, groups of memory, tests of sandboxes."""
    return byte_code(ros.runtime), group_fact(), sandbox_memory(Machine(ros))


def sandboxes(ros: RosInstallation) -> tuple[TierReport, ...]:
    """Test every sandbox and return the reports, strongest first; `none` comes last."""
    return inspect_tiers(Machine(ros))


def can_fork(name: str) -> bool:
    """Return whether students' nodes are forked in a sandbox, not executed; raises EnvironmentFault without it."""
    return isolation_from_name(name).can_fork


def node_start(name: str, *, can_fork: bool) -> Fact:
    """Report how students' nodes are started in a sandbox."""
    if can_fork:
        return Fact("start of nodes", "each is forked from a process that has imported ROS")
    text = "each executes Python and imports ROS, which takes longer: to be forked"
    return Fact("start of nodes", f"{text} into {name}, it needs Linux {'.'.join(map(str, ENTERABLE))} or newer")


def easiest_remedy(tiers: Sequence[TierReport]) -> str:
    """Return the easiest fix of a sandbox; running as another user comes last, because it takes the most effort."""
    ordered = sorted(tiers, key=lambda tier: is_for_others(tier.name))
    return next((tier.remedy for tier in ordered if tier.remedy), "")


def software(ros: RosInstallation | None) -> Iterator[Fact]:
    """Yield the versions of all software involved; those of ROS only if it is installed."""
    yield Fact("grader", grader.__version__)
    yield _python(ros)
    if ros is not None:
        yield _numpy(ros)
        origin = "Python wheels" if ros.source == "wheels" else "the sourced installation"
        yield Fact("ROS 2", f"{ros.distro}, from {origin} in {ros.prefix}")
        yield Fact("rclpy", ros.rclpy_version)
        yield Fact("RMW", f"rmw_fastrtps_cpp {_package_version(ros.prefix, 'rmw_fastrtps_cpp')}{_fast_dds(ros)}")
    yield _bubblewrap()


def _python(ros: RosInstallation | None) -> Fact:
    """Report the version of Python, and whether it is older than the one that the ROS release is made for."""
    value = f"{platform.python_version()} ({sys.executable})"
    wanted = release_of(ros.distro).python if ros is not None else None
    if ros is None or wanted is None or wanted <= sys.version_info[:2]:
        return Fact("Python", value)
    newer = ".".join(map(str, wanted))
    lack = f"ROS 2 {ros.distro} runs on Python {newer}: criteria whose programs need it are undecided here"
    return Fact("Python", f"{value}; {lack}", remedy=f"install the grader with python{newer}")


def _numpy(ros: RosInstallation) -> Fact:
    """Report the version of numpy, and whether numbers are other ones on the ROS release."""
    other = other_numpy(ros.distro)
    value = version("numpy")
    if other is None:
        return Fact("numpy", value)
    lack = (
        f"ROS 2 {ros.distro} has numpy {other.wanted}: criteria that programs with numpy do not meet are undecided here"
    )
    return Fact("numpy", f"{value}; {lack}", remedy=f"install numpy {other.wanted}, which needs Python 3.12 or older")


def weaknesses(ros: RosInstallation | None) -> Iterator[Fact]:
    """Yield the programs here that are older than the first version without known weaknesses."""
    bwrap = shutil.which("bwrap")
    yield from outdated(
        {
            FAST_DDS: version_of(_fast_dds(ros)) if ros is not None else (),
            BUBBLEWRAP: version_of(_said_by(bwrap)) if bwrap else (),
            LINUX: kernel_version(platform.release(), platform.version()),
        }
    )


def system() -> Iterator[Fact]:
    """Yield the relevant properties of the kernel and the hardware."""
    yield Fact("kernel", f"{platform.system()} {platform.release()} {platform.machine()}, {_distribution()}")
    yield Fact("user", f"{'root' if os.geteuid() == 0 else f'uid {os.geteuid()}'}{_surroundings()}")
    yield namespaces(setting_command())
    yield Fact("Landlock", _landlock())
    yield Fact("processors", str(len(os.sched_getaffinity(0))))
    yield memory(_available_memory())
    folder = tempfile.gettempdir()
    yield scratch(folder, shutil.disk_usage(folder).free)


def _package_version(prefix: Path, package: str) -> str:
    """Return the version of a ROS package from its manifest, or an empty string."""
    try:
        manifest = (prefix / "share" / package / "package.xml").read_text(encoding="utf-8")
    except (OSError, UnicodeError):
        return ""
    found = _VERSION.search(manifest)
    return found[1] if found else ""


def _fast_dds(ros: RosInstallation) -> str:
    """Return the version of Fast DDS from the name of its library, as a phrase, or an empty string."""
    for folder in ros.runtime.library_paths:
        for name in ("fastrtps", "fastdds"):
            versions = sorted(re.findall(r"\.so\.(\d+\.\d+\.\d+)", " ".join(map(str, folder.glob(f"lib{name}*.so.*")))))
            if versions:
                return f", Fast DDS {versions[-1]}"
    return ""


def _bubblewrap() -> Fact:
    path = shutil.which("bwrap")
    if path is None:
        return Fact("bubblewrap", "not installed", remedy=package_command("bubblewrap"))
    return Fact("bubblewrap", f"{_said_by(path).removeprefix('bubblewrap ')} ({path})")


def _said_by(program: str) -> str:
    try:
        done = subprocess.run([program, "--version"], capture_output=True, text=True, timeout=SAID_S, check=False)
    except (OSError, subprocess.SubprocessError, UnicodeError):
        return "cannot be started"
    return done.stdout.strip()[:80]


def _distribution() -> str:
    try:
        return platform.freedesktop_os_release().get("PRETTY_NAME", "an unnamed distribution")
    except OSError:
        return "an unnamed distribution"


def _surroundings() -> str:
    marks = {"/.dockerenv": "a Docker container", "/run/.containerenv": "a Podman container"}
    inside = next((name for path, name in marks.items() if Path(path).exists()), "")
    filtered = "system calls filtered" if has_filter() else ""
    if os.environ.get("GITHUB_ACTIONS") == "true":
        inside = inside or "a GitHub Actions runner"
    known = ", ".join(part for part in (f"in {inside}" if inside else "", filtered) if part)
    return f", {known}" if known else ""


def namespaces(command: str, settings: Path = SETTINGS_FOLDER) -> Fact:
    """Report whether ordinary users may create namespaces; root always may.

    Args:
        command: What lifts the setting that forbids them; empty if none does.
        settings: Where the kernel exposes its settings.
    """
    if not command:
        filtered = ", but a filter of system calls may" if has_filter() else ""
        return Fact("user namespaces", f"no setting forbids them{filtered}")
    name, _, value = command.rpartition(" ")[2].partition("=")
    now = settings.joinpath(*name.split(".")).read_text(encoding="ascii").strip()
    lasting = f"until the next start; for good: echo {name}={value} | sudo tee {_PERSISTENT}"
    return Fact("user namespaces", f"kept from ordinary users by {name}={now}", remedy=f"{command} ({lasting})")


def _landlock() -> str:
    version = ctypes.CDLL(None, use_errno=True).syscall(_CREATE_RULESET, None, 0, _ASK_VERSION)
    return f"version {version}" if version > 0 else "not offered by this kernel"


def memory(available: int | None) -> Fact:
    """Report whether so many bytes of memory are enough; None if they are not known."""
    fits = available is None or available >= MIN_MEMORY_BYTES
    value = "unknown" if available is None else f"{available / GIB:.1f} GiB available"
    return Fact("memory", value, fits=fits, remedy="" if fits else "end other programs: a scenario may need 1 GiB")


def _available_memory() -> int | None:
    """Return the memory available to new programs, in bytes, or None if the kernel does not report it."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:")), None)


def scratch(folder: str, free: int) -> Fact:
    """Report whether so many bytes in the folder for temporary files are enough."""
    fits = free >= MIN_SCRATCH_BYTES
    remedy = "" if fits else "free some space, or set TMPDIR to a folder that has it"
    return Fact("temporary files", f"{free / GIB:.1f} GiB free in {folder}", fits=fits, remedy=remedy)
