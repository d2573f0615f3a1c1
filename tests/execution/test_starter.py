"""Processes that a starter forks: the same sandbox as that of an executed process, and nothing of other processes."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hostile import hostile, record
from sandboxes import DOMAIN, Sandbox, finish, said, sandbox_or_skip

from grader.core.trace import FaultKind, Trace
from grader.execution.codec import to_json
from grader.execution.recording_session import RecordingSession
from grader.execution.ros_installation import RosInstallation
from grader.execution.sandbox.environment import worker_environment
from grader.execution.usage import families

pytestmark = pytest.mark.ros

S = 1_000_000_000

#: What a student's process can find out about its surroundings.
INSPECT = """
import ctypes, json, os, resource, socket, sys
status = {name: text.strip() for name, _, text in (line.partition(":") for line in open("/proc/self/status"))}
names = [name for name in dir(resource) if name.startswith("RLIMIT_")]
mounts = [line.split() for line in open("/proc/self/mountinfo")]
targets = {}
for name in os.listdir("/proc/self/fd"):
    try:
        targets[int(name)] = os.readlink(f"/proc/self/fd/{name}").split(":")[0]
    except OSError:
        pass
print(json.dumps({
    "status": {key: status[key] for key in status
        if key.startswith(("Cap", "NoNew", "Seccomp", "Groups", "Gid", "Spec", "Speculation", "Umask", "CoreDumping"))},
    "user is another": os.getuid() != 0,
    "limits": {name: resource.getrlimit(getattr(resource, name)) for name in names},
    "mounts": sorted([m[4], m[5], *m[m.index("-") + 1:][:1]] for m in mounts),
    "descriptors": targets,
    "environment": dict(os.environ),
    "leads": [os.getsid(0) == os.getpid(), os.getpgid(0) == os.getpid()],
    "place": [os.getcwd(), socket.gethostname()],
    "folders": {folder: sorted(os.listdir(folder)) for folder in ("/", "/tmp", "/dev", "/dev/shm", "/submission")},
    "dumpable": ctypes.CDLL(None).prctl(3, 0, 0, 0, 0),
    "signals": sorted(s for s in range(1, 65) if int(status["SigIgn"], 16) >> s - 1 & 1),
    "blocked": status["SigBlk"],
    "command": sys.argv[0],
}))
"""

#: A worker that starts the same program in both ways and prints what each printed.
BOTH = """
import json, socket, subprocess, sys
from pathlib import Path
from grader.core.limits import Limits
from grader.execution.codec import from_json
from grader.execution.ros_installation import PythonRuntime
from grader.execution.sandbox.protocol import StudentProcess
from grader.execution.sandbox.tiers import HOST, isolation_from_name
from grader.execution.sandbox.starter import Starter
told = json.loads(sys.argv[1])
isolation, runtime = isolation_from_name(told["tier"]), from_json(PythonRuntime, told["runtime"])
arguments = ("-s", "-u", "-c", told["code"])
process = StudentProcess(runtime, HOST, Path(told["submission"]), arguments, {"ROS_DOMAIN_ID": told["domain"]}, ())
command = isolation.student_command(process, Limits())
executed = subprocess.run(
    command.argv, env=dict(command.environment), pass_fds=command.pass_fds, stdin=subprocess.DEVNULL,
    capture_output=True, start_new_session=True,
)
starter = Starter("", runtime, isolation.host_seen_at)
ours, theirs = socket.socketpair()
started = starter.start(
    isolation.prepared_sandbox(process, Limits()), {}, (str(runtime.executable), *arguments), theirs
)
out = started.stdout.read()
print(json.dumps([executed.stdout.decode(), out.decode(), started.wait(), started.stderr.read().decode()]))
started.close()
starter.close()
"""


@pytest.fixture(params=["bubblewrap-root", "bubblewrap"])
def sandbox(request: pytest.FixtureRequest, ros: RosInstallation, submission: Path) -> Sandbox:
    return sandbox_or_skip(request.param, ros, submission)


@pytest.fixture
def run(studio: RecordingSession, tmp_path: Path) -> Callable[..., Trace]:
    def run_one(source: str, **fields: Any) -> Trace:
        return record(studio, tmp_path / "s", source, duration_ns=2 * S, **fields)

    tmp_path.chmod(0o755)
    return run_one


def printed(trace: Trace) -> list[str]:
    return [line.text for line in trace.lines() if line.stream == "stdout"]


def test_a_forked_process_is_in_the_sandbox_of_an_executed_one(sandbox: Sandbox) -> None:
    """Descriptors, privileges, mounts, limits, environment: equal.

    But for the placeholder, the connection to the grader, and that a forked process leads its session.
    """
    told = {
        "tier": sandbox.isolation.name,
        "runtime": to_json(sandbox.ros.runtime),
        "submission": str(sandbox.submission),
        "domain": DOMAIN,
        "code": INSPECT,
    }
    argv = (str(sandbox.ros.runtime.executable), "-s", "-B", "-c", BOTH, json.dumps(told))
    variables = worker_environment(sandbox.ros.runtime, Path("/tmp"))
    executed, forked, code, errors = said(finish(sandbox.worker(argv, pass_fds=(), **variables)))
    assert errors == ""
    assert code == 0
    found, expected = json.loads(forked), json.loads(executed)
    placeholder = ["/grader_host/cat"]
    assert [mount for mount in found["mounts"] if mount[0] in placeholder]
    found["mounts"] = [mount for mount in found["mounts"] if mount[0] not in placeholder]
    assert found["descriptors"].pop("3") == "socket"
    assert (expected.pop("leads"), found.pop("leads")) == ([False, False], [True, True])
    assert found == expected


def test_a_program_does_not_see_the_starter(run: Callable[..., Trace]) -> None:
    """It has the usual descriptors, path and arguments, and only the interface packages that its file names."""
    trace = run(
        hostile(
            before="""
            import os, sys
            print(sorted(int(name) for name in os.listdir("/proc/self/fd"))[:4], sys.argv, __name__)
            print([n for n in sys.modules if n.startswith("nav" "_msgs")], sys.path[0])
            """
        )
    )
    assert printed(trace) == ["[0, 1, 2, 3] ['a.py'] __main__", "[] /submission"]
    assert len(trace.messages("/cmd_vel")) > 20


#: Leaves a word in every place that the process can reach, and looks for words of others there.
CANARY = """
import gc, mmap, os, sys
word = b"canary-" + b"of-a-start-"
def seen():
    found = set()
    for line in open("/proc/self/maps"):
        span, rights = line.split()[:2]
        if "r" in rights and not line.rstrip().endswith(("[vvar]", "[vsyscall]", "[vvar_vclock]")):
            begin, end = (int(x, 16) for x in span.split("-"))
            with open("/proc/self/mem", "rb", 0) as memory:
                try:
                    memory.seek(begin)
                    block = memory.read(end - begin)
                except (OSError, OverflowError):
                    continue
            at = block.find(word)
            while at >= 0:
                found.add(block[at + len(word) : at + len(word) + 4])
                at = block.find(word, at + 1)
    return {text for text in found if text.isdigit()}
files = [os.path.join(top, name) for root in ("/tmp", "/dev/shm") for top, _, names in os.walk(root) for name in names]
before = seen()
kept = [word + b"%04d" % NUMBER]
sys.modules["canary"] = kept
import rclpy.node
rclpy.node.canary = kept
os.environ["CANARY"] = kept[0].decode()
for folder in ("/tmp", "/dev/shm"):
    open(f"{folder}/canary", "wb").write(kept[0])
print("before:", sorted(before), [f for f in files if "canary" in f], os.path.exists("/tmp/canary.old"),
    len(seen() - before), [line for line in open("/proc/self/maps") if line.split()[1] in ("rw-s", "-w-s", "rwxs")])
"""


@pytest.mark.parametrize("starts", [6, pytest.param(1000, marks=pytest.mark.nightly)])
def test_nothing_of_a_start_is_found_by_a_later_one(run: Callable[..., Trace], starts: int) -> None:
    """Not in memory, modules, environment or files: each process is a fork of one that has run no student's code."""
    for number in range(1, starts + 1):
        source = f"NUMBER = {number}\n{CANARY}\nimport sys\nsys.exit(0)\n"
        trace = run(source)
        assert printed(trace) == ["before: [] [] False 1 []"], (number, trace.faults())


def below() -> set[int]:
    """Return the descendants of this process."""
    return families([os.getpid()])[os.getpid()] - {os.getpid()}


def starters() -> list[int]:
    """Return the starters among the descendants of this process, some of which may end meanwhile."""
    found = []
    for pid in below():
        with contextlib.suppress(OSError):
            words = Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
            if any(word.endswith(b"/starter.py") for word in words):
                found.append(pid)
    return found


def test_a_starter_that_is_killed_costs_no_recording(run: Callable[..., Trace]) -> None:
    """The recording is done again with a new worker, which has a new starter."""
    assert len(run(hostile()).messages("/cmd_vel")) > 20
    for pid in starters():
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    trace = run(hostile())
    assert trace.harness_problem == ""
    assert len(trace.messages("/cmd_vel")) > 20


def test_a_process_that_is_killed_is_told_as_killed(run: Callable[..., Trace]) -> None:
    """By the signal that ended it."""
    (fault,) = run(hostile(later="if self.count == 10: os.kill(os.getpid(), 9)")).faults()
    assert (fault.kind, fault.signal) == (FaultKind.KILLED, "SIGKILL")


def settled() -> list[int]:
    """Return the descendants of this process when none has come or gone for a while, at the latest after 10 s."""
    deadline = time.monotonic() + 10
    found, since = sorted(below()), time.monotonic()
    while time.monotonic() < min(since + 0.5, deadline):
        time.sleep(0.02)
        now = sorted(below())
        if now != found:
            found, since = now, time.monotonic()
    return found


def test_nothing_is_left_of_a_process(run: Callable[..., Trace]) -> None:
    """Neither what it started nor its sandbox, nor an entry in the kernel's list of processes."""
    run(hostile())
    before = settled()
    run(hostile())
    assert settled() == before
