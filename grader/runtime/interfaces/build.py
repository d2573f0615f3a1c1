"""Builds packages of definitions into Python packages, once for each set of definitions."""

from __future__ import annotations

import importlib.util
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
from collections.abc import Collection, Sequence
from hashlib import sha256
from pathlib import Path

from grader.runtime.interfaces.definitions import KINDS, DefinitionError, InterfacePackage, digest, read_definitions
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EnvironmentFault

#: As many definitions as a package may have are built in seconds.
_PROCESSOR_S = 120
_MEMORY = 2 * 1024**3
#: Exit codes of a process that the kernel ended at a limit, or for lack of memory.
_AT_A_LIMIT = (-signal.SIGXCPU, -signal.SIGKILL, -signal.SIGXFSZ)
_RUNTIME = Path(__file__).with_name("runtime")
_SOURCES = (*sorted(_RUNTIME.glob("*.py")), Path(__file__).with_name("generate.py"))


@dataclass(frozen=True)
class BuiltInterfaces:
    """Built packages, in a folder laid out as an installation prefix.

    Attributes:
        prefix: The folder, for AMENT_PREFIX_PATH.
        names: Names of the packages.
    """

    prefix: Path
    names: tuple[str, ...]

    @property
    def python(self) -> Path:
        """The folder for PYTHONPATH."""
        return self.prefix / "python"

    @property
    def share(self) -> Path:
        """The folder of definitions and type descriptions, PACKAGE/KIND/NAME.msg and .json."""
        return self.prefix / "share"


def missing_packages(packages: Collection[InterfacePackage], share: Sequence[Path]) -> tuple[InterfacePackage, ...]:
    """Those packages that no installation provides.

    Args:
        packages: The packages.
        share: The share folders of the ROS installation.
    """
    return tuple(
        package
        for package in packages
        if not any((folder / package.name / "package.xml").is_file() for folder in share)
    )


def installed_messages(share: Sequence[Path]) -> frozenset[str]:
    """Full names of the messages that an installation provides, `std_msgs/msg/Header`."""
    return frozenset(f"{path.parts[-3]}/msg/{path.stem}" for folder in share for path in folder.glob("*/msg/*.json"))


def build(packages: Collection[InterfacePackage], cache: Path, share: Sequence[Path]) -> BuiltInterfaces:
    """Build packages that refer to each other and to installed ones, unless it has been done before.

    Neither compiler nor CMake is needed. Any number of processes may build at the same time.

    Args:
        packages: The packages; those that the installation provides are left to it.
        cache: The folder that keeps what was built, by digest.
        share: The share folders of the ROS installation.

    Returns:
        What was built; it does not change afterwards.

    Raises:
        DefinitionError: A definition is wrong, or there are too many.
        EnvironmentFault: The generators of ROS are missing or fail.
    """
    wanted = missing_packages(packages, share)
    prefix = cache / _key(wanted, share)
    built = BuiltInterfaces(prefix, tuple(sorted(package.name for package in wanted)))
    if prefix.is_dir():
        return built
    for package in wanted:
        _check_name(package.name)
    read_definitions(wanted, installed_messages(share))
    cache.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="building-", dir=cache) as staging:
        made = Path(staging) / "prefix"
        _write(wanted, made)
        _generate(made, share)
        made.chmod(0o755)
        try:
            made.rename(prefix)
        except OSError:
            if not prefix.is_dir():  # another process was faster
                raise
    return built


def _check_name(package: str) -> None:
    """Refuse a package that would hide an installed Python module other than one of definitions."""
    found = importlib.util.find_spec(package)
    if found is None or found.origin is None:
        return
    if not any((Path(found.origin).parent / kind).is_dir() for kind in KINDS):
        raise DefinitionError(package, "", 0, "an installed Python module has this name", "choose another name")


def _key(packages: Collection[InterfacePackage], share: Sequence[Path]) -> str:
    """The digest of everything that the result depends on: definitions, generators, runtime and Python's version."""
    made = sha256(digest(packages).encode())
    for path in _SOURCES:
        made.update(path.read_bytes())
    for path in (found for folder in share for found in (folder / "rosidl_generator_py").glob("**/*.*")):
        made.update(path.read_bytes())
    made.update(repr((sys.version_info[:2], tuple(map(str, share)))).encode())
    return made.hexdigest()[:32]


def _write(packages: Collection[InterfacePackage], prefix: Path) -> None:
    index = prefix / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True)
    for package in packages:
        (index / package.name).touch()
        described = f'<package format="3"><name>{package.name}</name><version>0.0.0</version></package>\n'
        (prefix / "share" / package.name).mkdir()
        (prefix / "share" / package.name / "package.xml").write_text(described, encoding="utf-8")
        for definition in package.definitions:
            folder = prefix / "share" / package.name / definition.kind
            folder.mkdir(parents=True, exist_ok=True)
            (folder / f"{definition.name}.{definition.kind}").write_text(definition.text, encoding="utf-8", newline="")


def _generate(prefix: Path, share: Sequence[Path]) -> None:
    """Run the generators in a process of their own: they are not made for use within another program."""
    command = [sys.executable, "-m", "grader.runtime.interfaces.generate", str(prefix), *map(str, share)]
    source = str(Path(__file__).parents[3])
    paths = os.pathsep.join((source, *filter(None, [os.environ.get("PYTHONPATH")])))
    done = subprocess.run(
        command,
        env={**os.environ, "PYTHONPATH": paths},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
        preexec_fn=_limit,
    )
    if done.returncode == 0 and done.stdout:
        raise DefinitionError(*json.loads(done.stdout))
    if done.returncode in _AT_A_LIMIT or done.stderr.rstrip().endswith("MemoryError"):
        problem = "building all definitions takes too much memory or processor time"
        raise DefinitionError("interfaces", "", 0, problem, "define fewer and smaller types")
    if done.returncode:
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        raise EnvironmentFault(f"building interfaces: expected ROS's generators to work, found {last}", "grade doctor")


def _limit() -> None:
    """Limit the process that generates, unless it has lower limits already."""
    for which, wanted in ((resource.RLIMIT_CPU, _PROCESSOR_S), (resource.RLIMIT_AS, _MEMORY)):
        _, most = resource.getrlimit(which)
        value = wanted if most == resource.RLIM_INFINITY else min(wanted, most)
        resource.setrlimit(which, (value, value))
