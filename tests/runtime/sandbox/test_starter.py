"""Processes that a starter forks: the same sandbox as that of an executed process, and nothing of other processes."""

from __future__ import annotations

import contextlib
import json
import os
import platform
import re
import resource
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hostile import hostile, printed, record, staging
from sandboxes import DOMAIN, Sandbox, finish, said, sandbox_or_skip
from tiers import more, tiers

from grader.runtime.host.originals import wait_until
from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.model.trace import AssessedTrace, FaultKind
from grader.runtime.recording.codec import to_json
from grader.runtime.ros_installation import RosInstallation
from grader.runtime.sandbox.bubblewrap import Bubblewrap
from grader.runtime.sandbox.environment import worker_environment
from grader.runtime.sandbox.tiers import PLAIN_NAME
from grader.runtime.session import RecordingSession, open_session
from grader.runtime.usage import families

pytestmark = pytest.mark.ros

S = 1_000_000_000

#: What a student's process can find out about its surroundings.
INSPECT = """
import ctypes, json, os, resource, signal, socket, sys
system = ctypes.CDLL(None)
def option(number):
    value = ctypes.c_int()
    return system.prctl(number, ctypes.byref(value)), value.value
def listed(folder):
    try:
        return sorted(os.listdir(folder))
    except OSError as error:
        return error.errno
status = {name: text.strip() for name, _, text in (line.partition(":") for line in open("/proc/self/status"))}
names = [name for name in dir(resource) if name.startswith("RLIMIT_")]
mounts = [line.split() for line in open("/proc/self/mountinfo")]
targets = {}
for name in os.listdir("/proc/self/fd"):
    try:
        targets[int(name)] = os.readlink(f"/proc/self/fd/{name}").split(":")[0]
    except OSError:
        pass
found = json.dumps({
    "status": {key: status[key] for key in status
        if key.startswith(("Cap", "NoNew", "Seccomp", "Groups", "Gid", "Spec", "Umask", "CoreDumping", "Cpus"))
        or key in ("SigBlk", "SigIgn", "SigCgt")},
    "user is another": [os.getuid() != 0, len({*os.getresuid()})],
    "limits": {name: resource.getrlimit(getattr(resource, name)) for name in names},
    "mounts": sorted([m[4], m[5], *m[m.index("-") + 1:][:1]] for m in mounts),
    "descriptors": targets,
    "environment": dict(os.environ),
    "leads": [os.getsid(0) == os.getpid(), os.getpgid(0) == os.getpid()],
    "place": [os.getcwd(), socket.gethostname()],
    "folders": {folder: listed(folder) for folder in ("/", "/tmp", "/dev", "/dev/shm", "/submission", ".")},
    "dumpable, kept capabilities, secure bits, slack": [system.prctl(n, 0, 0, 0, 0) for n in (3, 7, 27, 30)],
    "subreaper": option(37),
    "dies by": option(2),
    "scheduling": [os.sched_getscheduler(0), os.getpriority(os.PRIO_PROCESS, 0), os.nice(0)],
    "timers": [signal.getitimer(which) for which in (0, 1, 2)],
    "handlers": {number: repr(signal.getsignal(number)).partition(" at ")[0] for number in range(1, 65)},
    "kernel": {name: open(f"/proc/self/{name}").read() for name in ("oom_score_adj", "personality", "cgroup")},
    "program": [sys.argv[0], sys.path, str(sys.flags), sys.executable, sys.prefix],
})
for begin in range(0, len(found), 1000):  # the grader cuts long lines
    print(found[begin : begin + 1000])
"""

#: A worker that starts the same program in both ways and prints what each printed.
BOTH = """
import json, socket, subprocess, sys
from pathlib import Path
from grader.runtime.model.limits import Limits
from grader.runtime.recording.codec import from_json
from grader.runtime.ros_installation import PythonRuntime
from grader.runtime.sandbox.protocol import StudentProcess
from grader.runtime.sandbox.tiers import HOST, isolation_from_name
from grader.runtime.sandbox.starter import Starter
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


TIERS = (
    *("bubblewrap-root", "bubblewrap", "bubblewrap-flat", "bubblewrap-flat-user"),
    *("landlock", "landlock-user", "none"),
)
#: The folder of a process in a tier without namespaces around it.
OWN_FOLDER = re.compile(r"grade-student-[0-9a-f]+")


@pytest.fixture(params=tiers(*TIERS))
def sandbox(request: pytest.FixtureRequest, ros: RosInstallation, submission: Path) -> Sandbox:
    return sandbox_or_skip(request.param, ros, submission)


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., AssessedTrace]:
    def run_one(source: str, **fields: Any) -> AssessedTrace:
        return record(session, tmp_path / "s", source, duration_ns=2 * S, **fields)

    tmp_path.chmod(0o755)
    return run_one


#: Folders of the machine that other tests change meanwhile, where a tier has none of its own.
SHARED = ("/", "/tmp", "/dev", "/dev/shm")


def test_a_forked_process_is_in_the_sandbox_of_an_executed_one(sandbox: Sandbox) -> None:
    """Descriptors, privileges, mounts, limits, environment: equal.

    But for the placeholder, the connection to the grader, and that a forked process leads its session and dies with its
    parent; an executed one may die only with its sandbox. Without a sandbox of its own it does both in both ways.
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
    texts = (OWN_FOLDER.sub("own", "".join(text.splitlines())) for text in (forked, executed))
    found, expected = (json.loads(text) for text in texts)
    assert found["descriptors"].pop("3") == "socket"
    # Where the library of ctypes keeps its own file open, the connection has taken the first free number here.
    kept = [[d.pop(n) for n in list(d) if "libffi" in d[n]] for d in (found["descriptors"], expected["descriptors"])]
    assert kept[0] == kept[1]
    assert (found["leads"], found["dies by"]) == ([True, True], [0, signal.SIGKILL])
    if isinstance(sandbox.isolation, Bubblewrap):
        placeholder = ["/grader_host/cat"]
        assert [mount for mount in found["mounts"] if mount[0] in placeholder]
        found["mounts"] = [mount for mount in found["mounts"] if mount[0] not in placeholder]
        assert expected.pop("leads") == [False, False]
        del found["leads"], found["dies by"], expected["dies by"]
    elif sandbox.is_ordinary:
        # The limit is above what the user runs at that moment.
        assert resource.RLIM_INFINITY not in found["limits"].pop("RLIMIT_NPROC")
        del expected["limits"]["RLIMIT_NPROC"]
    if sandbox.isolation.name == PLAIN_NAME:
        for one in (found, expected):
            one["folders"] = {folder: names for folder, names in one["folders"].items() if folder not in SHARED}
    assert found == expected


@pytest.mark.parametrize("clock", ["virtual", *more(["wall"])])
def test_a_node_has_the_same_surroundings_in_both_ways(session: RecordingSession, tmp_path: Path, clock: str) -> None:
    """A node that is forked and one that is executed, each with the host in its process.

    They differ in the placeholder; the number of the connection to the grader; whether the empty input could be written
    to; the session, which a forked process leads; and files and threads of LTTng, which the starter keeps to itself.
    """
    tmp_path.chmod(0o755)
    with open_session(session.isolation.name, 1, executes=True) as other:
        found, expected = (
            json.loads("".join(printed(record(each, tmp_path / way, INSPECT, duration_ns=S, clock=clock))))
            for way, each in (("forked", session), ("executed", staging(other)))
        )
    for surroundings in (found, expected):
        surroundings["folders"]["/dev/shm"] = [
            name for name in surroundings["folders"]["/dev/shm"] if not name.startswith("lttng-ust-")
        ]
        surroundings["descriptors"] = sorted(surroundings["descriptors"].values())
        del surroundings["environment"]["ROS_DOMAIN_ID"]  # each recording has its own
    found["mounts"] = [mount for mount in found["mounts"] if mount[0] != "/grader_host/cat"]
    assert (expected.pop("leads"), found.pop("leads")) == ([False, False], [True, True])
    assert found == expected


@pytest.mark.long
@pytest.mark.parametrize("tier", tiers("bubblewrap-flat", "landlock", usual="landlock"))
def test_a_folder_of_a_forked_process_has_a_size_and_ends_with_it(tier: str, tmp_path: Path) -> None:
    """In tiers without namespaces another fork sees to both, in real time, whatever the host makes of the clock."""
    tmp_path.chmod(0o755)
    fills = """
        import os
        print(os.getcwd().replace("/", "|"), flush=True)  # the recording names the folder as other tiers do
        for number in range(8):
            open(f"file-{number}", "wb").write(bytes(4 << 20))
        sum(range(60_000_000))
        """
    try:
        with open_session(tier, 1) as session:
            trace = record(staging(session), tmp_path / "s", hostile(before=fills), duration_ns=2 * S)
            assert [fault.kind for fault in trace.faults()] == [FaultKind.KILLED]
            assert "MiB" in trace.faults()[0].text
            calm = record(
                staging(session), tmp_path / "calm", "import os\nprint(os.getcwd().replace('/', '|'))", duration_ns=S
            )
    except EnvironmentFault as fault:
        pytest.skip(fault.message)
    folders = [text.replace("|", "/") for text in (*printed(trace), *printed(calm))]
    assert ["grade-student-" in folder for folder in folders] == [True, True]
    assert wait_until(lambda: not any(Path(folder).exists() for folder in folders), 60)


def test_a_program_does_not_see_the_starter(run: Callable[..., AssessedTrace]) -> None:
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


#: Looks for what earlier starts left in each place that a process may reach, leaves a word in each, and looks again.
CANARY = """
import builtins, contextlib, ctypes, errno, json, os, socket, sys
import rclpy, rclpy.node
word = b"canary-" + b"of-a-start-"
mine = lambda: word + b"%04d" % NUMBER
kept = []
system = ctypes.CDLL(None, use_errno=True)
system.mq_open.argtypes = [ctypes.c_char_p, ctypes.c_int, ctypes.c_uint, ctypes.c_void_p]
CREATE, KEY, PORT, SESSION = 0o1000, 4242, 45454, -3
def in_memory():
    for line in open("/proc/self/maps"):
        span, rights = line.split()[:2]
        if "r" not in rights or line.rstrip().endswith(("[vvar]", "[vsyscall]", "[vvar_vclock]")):
            continue
        begin, end = (int(x, 16) for x in span.split("-"))
        with open("/proc/self/mem", "rb", 0) as memory, contextlib.suppress(OSError, OverflowError):
            memory.seek(begin)
            block = memory.read(end - begin)
            at = block.find(word)
            while at >= 0:
                if block[at + len(word) : at + len(word) + 4].isdigit():
                    return True
                at = block.find(word, at + 1)
    return False
def checked(result):
    if result < 0:
        raise OSError(ctypes.get_errno(), "")
    return result
def is_there(call, *arguments):
    return lambda: call(*arguments) >= 0
def writable():
    folders = [m.split()[4] for m in open("/proc/self/mountinfo") if m.split()[5].startswith("rw")]
    return [top for folder in folders if not folder.startswith("/proc") for top, _, _ in os.walk(folder)
        if os.access(top, os.W_OK)]
def leave_files():
    for folder in writable():
        with open(os.path.join(folder, "canary"), "wb") as file:
            file.write(mine())
def bound(kind, address, family=socket.AF_INET):
    kept.append(socket.socket(family, kind))
    kept[-1].bind(address)
def is_bound(kind, address, family=socket.AF_INET):
    with socket.socket(family, kind) as other:
        try:
            other.bind(address)
        except OSError as error:
            return error.errno == errno.EADDRINUSE
    return False
UDP, UNIX = (socket.SOCK_DGRAM, ("127.0.0.1", PORT)), (socket.SOCK_STREAM, chr(0) + "canary", socket.AF_UNIX)
places = {
    "memory": (lambda: kept.append(mine()), in_memory),
    "a module": (lambda: sys.modules.update(canary=mine()), lambda: "canary" in sys.modules),
    "builtins": (lambda: setattr(builtins, "canary", mine()), lambda: hasattr(builtins, "canary")),
    "a global": (lambda: setattr(rclpy.node, "canary", mine()), lambda: hasattr(rclpy.node, "canary")),
    "a class": (lambda: setattr(rclpy.node.Node, "canary", mine()), lambda: hasattr(rclpy.node.Node, "canary")),
    "the environment": (lambda: os.environ.update(CANARY="1"), lambda: "CANARY" in os.environ),
    "files": (leave_files, lambda: any("canary" in os.listdir(folder) for folder in writable())),
    "a port": (lambda: bound(*UDP), lambda: is_bound(*UDP)),
    "an abstract socket": (lambda: bound(*UNIX), lambda: is_bound(*UNIX)),
    "shared memory": (lambda: checked(system.shmget(KEY, 4096, CREATE | 0o666)), is_there(system.shmget, KEY, 0, 0)),
    "semaphores": (lambda: checked(system.semget(KEY, 1, CREATE | 0o666)), is_there(system.semget, KEY, 0, 0)),
    "messages": (lambda: checked(system.msgget(KEY, CREATE | 0o666)), is_there(system.msgget, KEY, 0)),
    "a queue": (lambda: checked(system.mq_open(b"/canary", os.O_CREAT | os.O_RDWR, 0o666, None)),
        is_there(system.mq_open, b"/canary", os.O_RDONLY, 0, None)),
    "a key": (lambda: checked(system.syscall(ADD_KEY, b"user", b"canary", mine(), 4, SESSION)),
        is_there(system.syscall, KEYCTL, 10, SESSION, b"user", b"canary", 0)),
}
found = [place for place, (_, look) in places.items() if look()]
left = []
for place, (leave, _) in places.items():
    with contextlib.suppress(OSError):
        leave()
        left.append(place)
again = [place for place, (_, look) in places.items() if look()]
shared = [line for line in open("/proc/self/maps") if line.split()[1].endswith("s")]
print(json.dumps([found, left, again, shared]))
sys.exit(0)
"""
#: Places that a process can write into; the others are closed to it.
OPEN_PLACES = (
    *("memory", "a module", "builtins", "a global", "a class", "the environment", "files"),
    *("a port", "an abstract socket"),
)
#: The numbers of `add_key` and `keyctl` by machine.
KEY_CALLS = {"x86_64": (248, 250), "aarch64": (217, 219)}


LEAVES_A_CONNECTION = """
import socket
listening = socket.socket()
try:
    listening.bind(("127.0.0.1", 45455))  # without SO_REUSEADDR, which would take the port of a closed connection
except OSError as error:
    print(error)
else:
    print("free")
    listening.listen()
    calling = socket.create_connection(("127.0.0.1", 45455))
    answering, _ = listening.accept()
    answering.close()
    calling.close()
"""


@pytest.mark.long
def test_a_later_start_finds_no_connection(run: Callable[..., AssessedTrace]) -> None:
    """The kernel keeps the port of a closed TCP connection for a minute, so the network is not used again."""
    for _ in range(3):
        assert printed(run(LEAVES_A_CONNECTION)) == ["free"]


@pytest.mark.parametrize("starts", [6, pytest.param(1000, marks=pytest.mark.nightly)])
def test_nothing_of_a_start_is_found_by_a_later_one(run: Callable[..., AssessedTrace], starts: int) -> None:
    """Not in memory, modules, files or the kernel: each process is a fork of one that has run no student's code.

    Each start finds again whatever it has left itself, so the places are looked at in a way that would find it.
    """
    add_key, keyctl = KEY_CALLS[platform.machine()]
    for number in range(1, starts + 1):
        trace = run(f"NUMBER, ADD_KEY, KEYCTL = {number}, {add_key}, {keyctl}\n{CANARY}")
        assert [json.loads(line) for line in printed(trace)] == [[[], [*OPEN_PLACES], [*OPEN_PLACES], []]], number


READS_CHARACTER_SETS = """
import locale
print(locale.setlocale(locale.LC_ALL, ""))
"""


def test_the_c_library_finds_its_table_of_character_sets(run: Callable[..., AssessedTrace]) -> None:
    """It shares that with all processes, and looks into it when a program, or Tcl for it, sets the locale."""
    assert printed(run(READS_CHARACTER_SETS)) == ["C.UTF-8"]


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


@pytest.mark.long
def test_a_starter_that_is_killed_costs_no_recording(run: Callable[..., AssessedTrace]) -> None:
    """The recording is done again with a new worker, which has a new starter."""
    assert len(run(hostile()).messages("/cmd_vel")) > 20
    for pid in starters():
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    trace = run(hostile())
    assert trace.harness_problem == ""
    assert len(trace.messages("/cmd_vel")) > 20


def test_a_process_that_is_killed_is_told_as_killed(run: Callable[..., AssessedTrace]) -> None:
    """By the signal that ended it."""
    (fault,) = run(hostile(later="if self.count == 10: os.kill(os.getpid(), 9)")).faults()
    assert (fault.kind, fault.signal) == (FaultKind.KILLED, "SIGKILL")


def test_nothing_is_left_of_a_process(run: Callable[..., AssessedTrace]) -> None:
    """Neither what it started nor its sandbox, nor an entry in the kernel's list of processes."""
    run(hostile())
    before = below()  # with what is about to end of the first recording
    run(hostile())
    assert wait_until(lambda: below() <= before, 60), below() - before
