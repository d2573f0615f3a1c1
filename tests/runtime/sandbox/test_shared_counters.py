"""Counters that the kernel has once for a user or for the machine: a student's process cannot use any of them up."""

from __future__ import annotations

import textwrap

import pytest
from sandboxes import Sandbox, said, sandbox_or_skip
from tiers import tiers

from grader.runtime.model.limits import Limits
from grader.runtime.ros_installation import RosInstallation
from grader.runtime.sandbox.protocol import LOCKED_BYTES, PENDING_SIGNALS

pytestmark = pytest.mark.sandbox

TIERS = ("bubblewrap-root", "bubblewrap", "bubblewrap-flat", "bubblewrap-flat-user", "landlock", "landlock-user")
MIB = 1 << 20


@pytest.fixture(params=tiers(*TIERS))
def sandbox(request: pytest.FixtureRequest, ros: RosInstallation, submission: object) -> Sandbox:
    return sandbox_or_skip(request.param, ros, submission)  # type: ignore[arg-type]


#: Calls by number (x86-64, aarch64), and what each attempt came to: its result, or the name of its error.
TRIES = """
import contextlib, ctypes, errno, fcntl, json, mmap, os, platform, resource, signal, socket, struct, threading
LIBC = ctypes.CDLL(None, use_errno=True)
def system(x86_64, aarch64, *arguments):
    number = x86_64 if platform.machine() == "x86_64" else aarch64
    if number is None:
        raise OSError(errno.ENOSYS, "")
    words = (a if isinstance(a, (bytes, ctypes.Array)) else ctypes.c_long(a) for a in arguments)
    result = LIBC.syscall(ctypes.c_long(number), *words)
    if result < 0:
        raise OSError(ctypes.get_errno(), "")
    return result
def tried(function):
    try:
        return function()
    except (OSError, ValueError) as error:
        return errno.errorcode.get(getattr(error, "errno", 0), "refused")
"""


def told_by(sandbox: Sandbox, code: str, **options: object) -> object:
    """Run some code that leaves what it found in `found`."""
    return said(sandbox.run(TRIES + textwrap.dedent(code) + "\nprint(json.dumps(found))", **options))


def test_what_only_few_programs_can_have_cannot_be_had(sandbox: Sandbox) -> None:
    """Watches of files, asynchronous I/O, huge pages, keys, queues, segments, terminals, rules and large pipes."""
    found = told_by(
        sandbox,
        """
        context = ctypes.create_string_buffer(8)
        attributes = struct.pack("=QQQ", 0, 3, 0)
        read, write = os.pipe()
        found = {
            "inotify": tried(lambda: system(253, None)),
            "inotify, newer": tried(lambda: system(294, 26, 0)),
            "fanotify": tried(lambda: system(300, 262, 0, 0)),
            "asynchronous I/O": tried(lambda: system(206, 0, 60_000, context)),
            "huge pages": tried(lambda: len(mmap.mmap(-1, 2 << 20, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | 0x40000))),
            "a key": tried(lambda: system(248, 217, b"user", b"name", b"data", 4, -3)),
            "a queue": tried(lambda: system(240, 180, b"queue", os.O_CREAT | os.O_RDWR, 0o600, 0)),
            "a segment": tried(lambda: system(29, 194, 0, 4096, 0o1600)),
            "semaphores": tried(lambda: system(64, 190, 0, 1, 0o1600)),
            "messages": tried(lambda: system(68, 186, 0, 0o1600)),
            "a memory file": tried(lambda: system(319, 279, b"name", 0)),
            "a secret memory file": tried(lambda: system(447, 447, 0)),
            "performance events": tried(lambda: system(298, 241, bytes(128), 0, -1, -1, 0)),
            "programs in the kernel": tried(lambda: system(321, 280, 0, bytes(128), 128)),
            "rings": tried(lambda: system(425, 425, 8, bytes(128))),
            "rules": tried(lambda: system(444, 444, attributes, len(attributes), 0)),
            "pages given to a pipe": tried(lambda: system(278, 75, write, 0, 0, 0)),
            "a large pipe": tried(lambda: fcntl.fcntl(write, 1031, 1 << 20)),
            "a terminal": tried(lambda: os.openpty()[0]),
            "a lease": tried(lambda: fcntl.fcntl(os.open("lease", os.O_CREAT | os.O_RDWR), 1024, 1)),
            "a user namespace": tried(lambda: system(272, 97, 0x10000000)),
            "a ping socket": tried(lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM, 1).fileno()),
            "encryption": tried(lambda: socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, 6).fileno()),
            "crypto": tried(lambda: socket.socket(38, socket.SOCK_SEQPACKET).fileno()),
        }
        """,
    )
    assert isinstance(found, dict)
    assert {what: result for what, result in found.items() if isinstance(result, int)} == {}
    assert {found["inotify, newer"], found["asynchronous I/O"], found["rules"]} == {"ENOSYS"}


def test_signals_and_timers_that_wait_are_few(sandbox: Sandbox) -> None:
    """The kernel counts them for all processes of a user together; what has a descriptor is limited by those."""
    found = told_by(
        sandbox,
        """
        timers = 0
        with contextlib.suppress(OSError):
            while timers < 1000:
                system(222, 107, 1, 0, ctypes.create_string_buffer(8))
                timers += 1
        found = [timers, resource.getrlimit(resource.RLIMIT_SIGPENDING), resource.getrlimit(resource.RLIMIT_MSGQUEUE),
            resource.getrlimit(resource.RLIMIT_MEMLOCK), resource.getrlimit(resource.RLIMIT_RTPRIO)]
        """,
    )
    assert isinstance(found, list)
    # None, where the same test beside this one has made as many as the same user may.
    assert found[0] <= PENDING_SIGNALS
    assert found[0] > 0 or sandbox.is_ordinary
    assert found[1:] == [[PENDING_SIGNALS] * 2, [0, 0], [LOCKED_BYTES] * 2, [0, 0]]


def test_sockets_and_pipes_keep_their_usual_size(sandbox: Sandbox) -> None:
    """A program that asks for more is told that it got it, as by a kernel with a low maximum; a pipe stays as it is."""
    found = told_by(
        sandbox,
        """
        found = []
        for family, kind in ((socket.AF_INET, socket.SOCK_DGRAM), (socket.AF_INET, socket.SOCK_STREAM)):
            with socket.socket(family, kind) as one:
                before = [one.getsockopt(socket.SOL_SOCKET, o) for o in (socket.SO_SNDBUF, socket.SO_RCVBUF)]
                one.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4 << 20)
                one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
                one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                after = [one.getsockopt(socket.SOL_SOCKET, o) for o in (socket.SO_SNDBUF, socket.SO_RCVBUF)]
                found.append([before == after, one.getsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR)])
        one, other = socket.socketpair()
        one.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4 << 20)
        one.setblocking(False)
        sent = 0
        with contextlib.suppress(BlockingIOError):
            while sent < 64 << 20:
                sent += one.send(bytes(1 << 16))
        found.append(sent < 1 << 20)
        """,
    )
    assert found == [[True, 1], [True, 1], True]


def test_descriptors_on_their_way_are_as_few_as_open_ones(sandbox: Sandbox) -> None:
    """A socket may be sent over a socket and closed, and still holds its data: the kernel counts those by user."""
    found = told_by(
        sandbox,
        """
        sent, pairs = 0, [socket.socketpair() for _ in range(10)]
        for there, _ in pairs:
            there.setblocking(False)
            with contextlib.suppress(OSError):
                while sent < 10_000:
                    with open(os.devnull) as file:
                        socket.send_fds(there, [b"1"], [file.fileno()])
                    sent += 1
        found = sent
        """,
    )
    assert isinstance(found, int)
    assert 0 < found <= 2 * Limits().open_files


HONEST = """
import asyncio, multiprocessing, selectors, signal, socket, subprocess, sys, tempfile, threading, time
loop = asyncio.new_event_loop()
async def ticks():
    await asyncio.sleep(0.01)
    return 1
found = {"asyncio": loop.run_until_complete(ticks())}
signal.signal(signal.SIGALRM, lambda *_: found.update(alarm=1))
signal.setitimer(signal.ITIMER_REAL, 0.01)
time.sleep(0.05)
timer = threading.Timer(0.01, lambda: found.update(timer=1))
timer.start()
timer.join()
found["child"] = int(subprocess.run([sys.executable, "-S", "-c", "print(1)"], capture_output=True).stdout)
read, write = multiprocessing.Pipe()
child = multiprocessing.get_context("fork").Process(target=lambda: write.send(1))
child.start()
found["pipe"] = read.recv()
child.join()
for family in (socket.AF_INET, socket.AF_INET6):
    with socket.socket(family, socket.SOCK_DGRAM) as one:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
found["interfaces"] = int("lo" in [name for _, name in socket.if_nameindex()])
with tempfile.TemporaryFile() as file:
    file.write(b"1")
"""


def test_ordinary_programs_need_none_of_them(sandbox: Sandbox) -> None:
    """Loops, timers, alarms, threads, child processes, pipes, sockets, temporary files."""
    found = told_by(sandbox, HONEST)
    assert found == {"asyncio": 1, "alarm": 1, "timer": 1, "child": 1, "pipe": 1, "interfaces": 1}
