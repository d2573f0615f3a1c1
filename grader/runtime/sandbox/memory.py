"""Caches the results of self-tests for a login session in a private file of the user; an invalid file is ignored."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import secrets
import shutil
import socket
import stat
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import grader
from grader.runtime.model.checkup import PROPERTIES, TIERS, Property, TierReport
from grader.runtime.model.dataclass import dataclass
from grader.runtime.ros_installation import RosInstallation
from grader.runtime.sandbox.bubblewrap import SYSTEM_PROGRAMS
from grader.runtime.sandbox.properties import SETTINGS
from grader.runtime.temp_dirs import own_folder

#: A larger file is not one that the grader wrote.
LARGEST = 64 << 10
#: What reading a file that anything may have happened to raises.
UNUSABLE = (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError)


@dataclass(frozen=True, slots=True)
class Memory:
    """The cached self-test of one tier."""

    file: Path | None  # a file in the user's private folder; None if there is no such folder
    # A digest of each thing that the result depends on, by name; a result with another key is ignored
    key: Mapping[str, str]

    @classmethod
    def of(cls, tier: str, ros: RosInstallation) -> Memory:
        """Return the cache entry for a tier, with this boot of the machine, this user and this ROS."""
        texts = {"sandbox": tier}
        for what, text in circumstances(ros):
            texts[what] = "\n".join((texts.get(what, ""), text))
        key = {what: _digest(text) for what, text in texts.items()}
        folder = own_folder("XDG_RUNTIME_DIR", "XDG_CACHE_HOME")
        # A user may alternate between several installations, so each has its own file.
        installation = _digest(f"{Path(__file__)} {ros.runtime.executable} {ros.prefix}")[:12]
        return cls(folder / f"sandbox-{tier}-{installation}.json" if folder else None, key)

    def recall(self) -> TierReport | None:
        """Return the cached self-test, if there is one and only this user can write the file."""
        try:
            remembered = self._read()
            return report_from_json(remembered["report"]) if remembered["key"] == self.key else None
        except UNUSABLE:
            return None

    def lapse(self) -> str:
        """Return why no cached self-test can be used, as a phrase; empty if one can."""
        if self.recall() is not None:
            return ""
        if self.file is None:
            return "there is no folder to remember it in"
        try:
            before = dict(self._read()["key"])
        except UNUSABLE:
            return "none is remembered"
        changed = [what for what, digest in self.key.items() if before.get(what) != digest]
        return f"changed since: {', '.join(changed)}" if changed else "what is remembered cannot be used"

    def _read(self) -> Any:
        """Read the file; raises one of `UNUSABLE` if it is invalid or other users may write it."""
        if self.file is None:
            raise FileNotFoundError
        descriptor = os.open(self.file, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK)
        with os.fdopen(descriptor, "rb") as file:
            found = os.fstat(descriptor)
            if found.st_uid != os.geteuid() or stat.S_IMODE(found.st_mode) != 0o600 or found.st_size > LARGEST:
                raise PermissionError
            return json.loads(file.read(LARGEST))

    def keep(self, report: TierReport) -> None:
        """Store a self-test, if possible."""
        if self.file is None:
            return
        draft = self.file.with_name(f".{secrets.token_hex(8)}")
        with contextlib.suppress(OSError):
            descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
            with os.fdopen(descriptor, "w", encoding="utf-8") as file:
                json.dump({"key": dict(self.key), "report": asdict(report)}, file)
            draft.replace(self.file)


def report_from_json(values: object) -> TierReport:
    """Rebuild a report from the cache; raises ValueError, TypeError or KeyError if it is not valid."""
    if not isinstance(values, dict) or values["name"] not in TIERS:
        raise ValueError("a report of a tier")
    properties = tuple(Property(**found) for found in values.pop("properties"))
    report = TierReport(**values, properties=properties)
    texts = (report.why, report.remedy, *(text for found in properties for text in (found.mechanism, found.found)))
    flags = (report.usable, *(found.holds for found in properties))
    if [found.name for found in properties] != list(PROPERTIES):
        raise ValueError("a report of every property")
    if not all(type(text) is str for text in texts) or not all(type(flag) is bool for flag in flags):
        raise TypeError("texts and flags")
    return report


def circumstances(ros: RosInstallation) -> Iterator[tuple[str, str]]:
    """Yield the name and value of everything that a self-test depends on, without values that change for no reason."""
    yield "boot", _content("/proc/sys/kernel/random/boot_id")
    yield "user", f"{os.geteuid()} {os.getegid()}"
    for name in ("net", "user", "mnt", "pid"):
        with contextlib.suppress(OSError):
            yield "namespaces", os.readlink(f"/proc/self/ns/{name}")  # noqa: PTH115 -- it points to no path
    status = _content("/proc/self/status").splitlines()
    yield from (("privileges", line) for line in status if line.startswith(("Cap", "Seccomp", "NoNewPrivs")))
    # Which ones there are changes with every container that is started here, and changes nothing.
    yield "network", str(any(name != "lo" for _, name in socket.if_nameindex()))
    yield from (("settings", f"{name} {_content('/proc/sys/' + name.replace('.', '/'))}") for name, _, _ in SETTINGS)
    for program in ("bwrap", "prlimit", "setpriv"):
        yield program, _stamp(Path(shutil.which(program, path=SYSTEM_PROGRAMS) or shutil.which(program) or "/nowhere"))
    yield "ROS", f"{ros.prefix} {ros.distro} {ros.rclpy_version}"
    yield "Python", f"{ros.runtime.executable} {ros.runtime.read_paths}"
    yield "grader", grader.__version__
    # Not the folder itself or its byte code, which the first run of a version writes.
    sources = (path for path in Path(__file__).parent.iterdir() if path.suffix in (".py", ".xml"))
    yield from (("grader", _stamp(path)) for path in sorted(sources))


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()


def _content(path: str) -> str:
    try:
        return Path(path).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _stamp(path: Path) -> str:
    try:
        found = path.stat()
    except OSError:
        return f"{path} missing"
    return f"{path} {found.st_size} {found.st_mtime_ns}"
