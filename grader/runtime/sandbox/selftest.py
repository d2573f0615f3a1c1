"""The self-test of a tier: runs a probe that tries to break out of it, and evaluates the result for each property."""

from __future__ import annotations

import array
import contextlib
import fcntl
import json
import os
import secrets
import socket
import struct
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from grader.runtime.domains import domains_of
from grader.runtime.model.checkup import PROPERTIES, TIERS, Property, TierReport, missing
from grader.runtime.model.dataclass import dataclass
from grader.runtime.recording.codec import to_json
from grader.runtime.ros_installation import RosInstallation
from grader.runtime.sandbox.environment import PACKAGE, worker_environment
from grader.runtime.sandbox.exposure import worker_view
from grader.runtime.sandbox.properties import EXCHANGE, NO_EXCHANGE, mechanism
from grader.runtime.sandbox.protocol import Isolation

#: A sandbox that does not work may hang; a busy machine needs tens of seconds for the starts in one that does.
TRIAL_S = 45.0
STAGED = "probe.txt"
ANSWERED = {"achieved", "outgrown", "said"}
#: Folders that a student never writes to.
CLOSED = ("/", "/dev", "/etc", "/usr/lib", "/proc")
#: Files of this machine that no program needs, of which the first two are readable for every user.
MACHINES = ("/etc/hostname", "/etc/resolv.conf", "/etc/shadow")
SIOCGIFADDR = 0x8915  # linux/sockios.h


@dataclass(frozen=True, slots=True)
class Bait:
    """The bait for the probe of one trial."""

    folder: Path  # the folder of the trial; deleted afterwards
    canary: Path  # a file next to the submission that every user may read and write
    segment: Path  # a file in this machine's shared memory that every user may read and write
    secret: str  # a text in the worker's command line and environment
    sinks: tuple[socket.socket, ...]  # listeners on this machine's addresses other than the loopback
    loopback: socket.socket  # a listener on the loopback address


def inspect(isolation: Isolation, ros: RosInstallation) -> TierReport:
    """Run a probe inside a tier and return the report on the tier; takes about half a second."""
    letter = TIERS[isolation.name]
    with laid_bait() as bait:
        answer, why = trial_answer(isolation, ros, bait)
        if set(answer.get("achieved", ())) != set(PROPERTIES):
            why = why or str(answer.get("said") or "the probe did not answer")
            return TierReport(isolation.name, letter, usable=False, why=f"no process runs in it: {why}")
        achieved: dict[str, list[str]] = answer["achieved"]
        for name, more in noticed(bait, outgrown=bool(answer["outgrown"])):
            achieved[name].append(more)
    contained = tuple(property_of(isolation.name, name, achieved[name]) for name in PROPERTIES)
    why = why_not(contained)
    return TierReport(isolation.name, letter, usable=not why, why=why, properties=contained)


def property_of(tier: str, name: str, achieved: list[str]) -> Property:
    """Evaluate a property from what the probe achieved against it."""
    if not achieved:
        return Property(name, holds=True, mechanism=mechanism(tier, name))
    return Property(name, holds=False, mechanism=mechanism(tier, name), found=", ".join(dict.fromkeys(achieved))[:300])


def why_not(contained: tuple[Property, ...]) -> str:
    """Return why a tier with these properties cannot be used; empty if it can."""
    if any(NO_EXCHANGE in found.found for found in contained if found.name == EXCHANGE):
        return NO_EXCHANGE
    return "; ".join(map(str, missing(contained)))


def trial_answer(isolation: Isolation, ros: RosInstallation, bait: Bait) -> tuple[dict[str, Any], str]:
    """Run the trial and return its answer, or an empty one with the reason."""
    submission = bait.folder / "submission"
    domains = domains_of(shared=isolation.shares_network)
    request = {
        "isolation": isolation.name,
        "runtime": to_json(ros.runtime),
        "submission": str(submission),
        "staged": STAGED,
        "domain": domains.take(),
        "probe": asked_of_probe(bait),
    }
    module = "grader.runtime.sandbox.trial"
    argv = (str(ros.runtime.executable), "-s", "-B", "-m", module, json.dumps(request), bait.secret)
    command = isolation.worker_command(argv, environment(ros, bait), (), worker_view(ros.runtime, bait.folder))
    try:
        done = subprocess.run(
            command.argv,
            env=dict(command.environment),
            pass_fds=command.pass_fds,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=TRIAL_S,
            start_new_session=True,
            check=False,
            cwd="/",
        )
    except subprocess.TimeoutExpired:
        return {}, f"the self-test did not end within {TRIAL_S:.0f} s"
    except OSError as error:
        return {}, f"{Path(command.argv[0]).name} cannot be started: {error.strerror}"
    finally:
        domains.close()
        for descriptor in command.opened_fds:
            os.close(descriptor)
    with contextlib.suppress(ValueError):
        answer = json.loads(done.stdout)
        if isinstance(answer, dict) and answer.keys() >= ANSWERED:
            return answer, ""
    errors = done.stderr.decode("utf-8", "replace").strip().splitlines()
    return {}, errors[-1][:300] if errors else f"the self-test ended with code {done.returncode}"


def environment(ros: RosInstallation, bait: Bait) -> Mapping[str, str]:
    """Return the environment of a trial's worker, which contains a secret, as a real worker's may."""
    variables = worker_environment(ros.runtime, bait.folder)
    return {**variables, "PATH": os.environ.get("PATH", variables["PATH"]), "PROBE_SECRET": bait.secret}


def asked_of_probe(bait: Bait) -> dict[str, Any]:
    """Return the supervisor's part of the probe's arguments; the worker adds the rest."""
    hidden = (
        bait.canary,
        PACKAGE / "runtime" / "model" / "trace.py",
        PACKAGE / "grading" / "model" / "report.py",
        PACKAGE / "grading" / "judging" / "__init__.py",
        *map(Path, MACHINES),
    )
    return {
        "hidden": [str(path) for path in hidden],
        "closed": [*CLOSED, str(bait.folder)],
        "files": [str(bait.canary)],
        "segments": [str(bait.segment)],
        # In two halves, so that the probe does not find the secret in its own command line.
        "secret": [bait.secret[:16], bait.secret[16:]],
        "sinks": [sink.getsockname()[:2] for sink in bait.sinks if sink.type == socket.SOCK_STREAM],
        "loopback": bait.loopback.getsockname()[1],
    }


@contextlib.contextmanager
def laid_bait() -> Iterator[Bait]:
    """Set up the bait for the block, and remove it."""
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="grade-probe-")))
        folder.chmod(0o755)
        (folder / "submission").mkdir(mode=0o755)
        segment = Path("/dev/shm") / f"grade-probe-{secrets.token_hex(8)}"  # noqa: S108
        files = (folder / "canary", folder / "submission" / STAGED, segment)
        stack.callback(segment.unlink, missing_ok=True)
        for path in files:
            path.write_text("canary", encoding="utf-8")
            path.chmod(0o666)
        sinks = tuple(stack.enter_context(sink) for sink in listeners())
        loopback = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        loopback.bind(("127.0.0.1", 0))
        loopback.setblocking(False)  # noqa: FBT003 -- the name of the method says what
        yield Bait(folder, files[0], segment, secrets.token_hex(16), sinks, loopback)


def listeners() -> Iterator[socket.socket]:
    """Yield a TCP and a UDP socket, on the same port, for each of this machine's addresses beyond the loopback."""
    for _, name in socket.if_nameindex():
        with contextlib.suppress(OSError):
            address = address_of(name)
            if address.startswith("127."):
                continue
            stream = socket.create_server((address, 0))
            yield stream
            datagram = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            yield datagram
            datagram.bind(stream.getsockname())


def address_of(interface: str) -> str:
    """Return the IPv4 address of an interface; raises OSError if it has none."""
    request = array.array("B", struct.pack("16s24x", interface.encode()))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        fcntl.ioctl(asked, SIOCGIFADDR, request)
    return socket.inet_ntoa(request.tobytes()[20:24])


def noticed(bait: Bait, *, outgrown: bool) -> Iterator[tuple[str, str]]:
    """Yield what the bait itself shows, by property, independent of the probe's answer."""
    with contextlib.suppress(BlockingIOError):
        if bait.loopback.recv(16):
            yield "dds_private", "programs outside share its loopback address"
    if bait.canary.read_text(encoding="utf-8") != "canary" or bait.canary.stat().st_mode & 0o777 != 0o666:
        yield "fs_write", f"changed {bait.canary.name}"
    if outgrown:
        yield "fs_write", "outgrew its scratch folder"
