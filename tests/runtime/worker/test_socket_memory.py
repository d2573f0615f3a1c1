"""Memory of the kernel in sockets and pipes: found wherever it lies, and charged to the node that put it there."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hostile import hostile, record
from tiers import each

from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import KIB, MIB, NS_PER_S
from grader.runtime.model.trace import AssessedTrace, FaultKind
from grader.runtime.session import RecordingSession
from grader.runtime.worker.resource_monitor import IN_SOCKETS_BYTES
from grader.runtime.worker.socket_memory import SOCKET_BYTES, SocketMemory, descriptors, objects, socket_bytes

KINDS = {
    "local": ((socket.AF_UNIX, 0),),
    "UDP": ((socket.AF_INET, socket.IPPROTO_UDP),),
    "TCP": ((socket.AF_INET, socket.IPPROTO_TCP),),
}


def fill(there: socket.socket, block: bytes = bytes(1 << 15)) -> None:
    there.setblocking(False)
    with contextlib.suppress(OSError):
        for _ in range(4000):
            there.send(block)


def inode(one: socket.socket) -> int:
    return os.fstat(one.fileno()).st_ino


@pytest.fixture
def here() -> Iterator[contextlib.ExitStack]:
    with contextlib.ExitStack() as stack:
        if not socket_bytes(KINDS["local"]):
            pytest.skip("this kernel has no sock_diag")
        yield stack


def test_what_a_local_socket_has_sent_is_found(here: contextlib.ExitStack) -> None:
    """It is the sender's as long as that exists, and then the receiver's."""
    sends, receives = (here.enter_context(one) for one in socket.socketpair())
    own, other = inode(sends), inode(receives)
    fill(sends)
    found = socket_bytes(KINDS["local"])
    assert 128 * KIB < found[own] <= SOCKET_BYTES
    sends.close()
    assert 128 * KIB < socket_bytes(KINDS["local"])[other] <= SOCKET_BYTES


def test_connections_that_nobody_accepts_are_those_of_the_listener(here: contextlib.ExitStack) -> None:
    """The kernel tells only how many there are; each counts as full."""
    listens = here.enter_context(socket.socket(socket.AF_UNIX))
    listens.bind("\0" + os.urandom(8).hex())
    listens.listen(100)
    for _ in range(5):
        with socket.socket(socket.AF_UNIX) as calls:
            calls.connect(listens.getsockname())
            fill(calls)
    assert socket_bytes(KINDS["local"])[inode(listens)] == 5 * SOCKET_BYTES


def test_packets_that_nobody_takes_are_found(here: contextlib.ExitStack) -> None:
    """In the receiver, which may be in another process than the sender."""
    receives = here.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    receives.bind(("127.0.0.1", 0))
    sends = here.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    sends.connect(receives.getsockname())
    fill(sends)
    assert 64 * KIB < socket_bytes(KINDS["UDP"])[inode(receives)] <= SOCKET_BYTES


def test_connections_of_tcp_are_found_also_when_nobody_has_them(here: contextlib.ExitStack) -> None:
    """Their buffers grow to some MiB; what is left of a closed one has no inode."""
    listens = here.enter_context(socket.create_server(("127.0.0.1", 0)))
    calls = here.enter_context(socket.create_connection(listens.getsockname()))
    fill(calls)
    found = socket_bytes(KINDS["TCP"])
    assert found[inode(calls)] + found[0] > 256 * KIB


def test_what_is_shared_with_a_child_counts_once(here: contextlib.ExitStack) -> None:
    """A descriptor in several processes is one socket, or one pipe."""
    one, other = (here.enter_context(end) for end in socket.socketpair())
    assert (
        objects([os.getpid(), os.getpid()])
        == objects([os.getpid()])
        >= {
            ("socket", inode(one)),
            ("socket", inode(other)),
        }
    )
    assert descriptors([os.getpid()]) == sum(1 for _ in Path("/proc/self/fd").iterdir()) - 1


def test_each_family_has_its_own(here: contextlib.ExitStack) -> None:
    """Of another process's sockets a family has nothing, in a network that others use as well."""
    sends, _ = (here.enter_context(one) for one in socket.socketpair())
    fill(sends)
    mine, none = SocketMemory(shared=True).look([[os.getpid()], []], tcp=False)
    assert mine.memory_bytes > 128 * KIB
    assert mine.sockets >= 2
    assert (none.sockets, none.pipes, none.memory_bytes) == (0, 0, 0)


# --- for real ---

#: Keeps what it opens; each way to fill the kernel's memory begins at the 40th tick.
KEEPS = """
import contextlib, os, socket, subprocess, sys, textwrap
kept = []
def fill(there, block=bytes(1 << 15)):
    there.setblocking(False)
    with contextlib.suppress(OSError):
        for _ in range(4000):
            there.send(block)
def children(code, count):
    code = "import contextlib, os, socket, time\\nkept = []\\n" + textwrap.dedent(code) + "\\ntime.sleep(60)"
    kept.extend(subprocess.Popen([sys.executable, "-I", "-S", "-c", code]) for _ in range(count))
"""
PAIRS_IN_CHILDREN = """
children('''
for _ in range(55):
    kept.extend(socket.socketpair())
    kept[-1].setblocking(False)
    with contextlib.suppress(OSError):
        while True:
            kept[-1].send(bytes(1 << 15))
''', 12)
"""
NOT_ACCEPTED = """
listens = socket.socket(socket.AF_UNIX)
listens.bind(chr(0) + "never")
listens.listen(4096)
kept.append(listens)
for _ in range(1200):
    with socket.socket(socket.AF_UNIX) as calls:
        calls.connect(chr(0) + "never")
        fill(calls)
"""
PIPES = """
children('''
for _ in range(50):
    here, there = os.pipe()
    os.set_blocking(there, False)
    with contextlib.suppress(OSError):
        while True:
            os.write(there, bytes(4096))
''', 12)
"""
UDP = """
children('''
for _ in range(100):
    kept.append(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    kept[-1].bind(("127.0.0.1", 0))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sends:
        for _ in range(10):
            sends.sendto(bytes(1 << 15), kept[-1].getsockname())
''', 12)
"""
TCP = """
listens = socket.create_server(("127.0.0.1", 0))
kept.append(listens)
for _ in range(50):
    calls = socket.create_connection(listens.getsockname())
    kept.extend([calls, listens.accept()[0]])
    for _ in range(20):
        fill(calls)
"""


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., AssessedTrace]:
    tmp_path.chmod(0o755)

    def run_one(harm: str, *others: str, **fields: Any) -> AssessedTrace:
        indented = "\n".join(f"    {line}" for line in harm.splitlines())
        harms = f"{KEEPS}\ndef harm():\n{indented}\n"
        program = hostile(before=harms, later="if self.count == 40: harm()")
        return record(session, tmp_path / "s", program, *others, clock="wall", **fields)

    return run_one


@pytest.mark.breadth(1, 1)
@pytest.mark.ros
@pytest.mark.parametrize(
    ("harm", "words"),
    each(
        [
            (PAIRS_IN_CHILDREN, ("128 MiB of memory in sockets and pipes", "500 open sockets")),
            (NOT_ACCEPTED, ("128 MiB of memory in sockets and pipes",)),
            (UDP, ("128 MiB of memory in sockets and pipes", "500 open sockets")),
            (PIPES, ("250 open pipes",)),
            (TCP, ("128 MiB of memory in sockets and pipes",)),
        ],
        5,
    ),
    ids=["pairs", "not accepted", "UDP", "pipes", "TCP"],
)
def test_memory_in_sockets_and_pipes_ends_the_node(
    run: Callable[..., AssessedTrace], harm: str, words: tuple[str, ...]
) -> None:
    """As filled memory does: in children, in connections that nobody accepts, in packets that nobody takes."""
    trace = run(
        harm, duration_ns=60 * NS_PER_S
    )  # it ends with the node, however long a busy machine takes to get there
    (fault,) = trace.faults()
    assert fault.kind is FaultKind.KILLED
    assert fault.text in {f"stopped at {limit}" for limit in words}
    assert not trace.harness_problem


@pytest.mark.nightly
@pytest.mark.ros
def test_a_node_beside_it_goes_on(run: Callable[..., AssessedTrace]) -> None:
    """Memory is charged to the one that holds it."""
    other = hostile().replace("/cmd_vel", "/other").replace("velocity_publisher", "other")
    trace = run(PAIRS_IN_CHILDREN, other, duration_ns=20 * NS_PER_S)
    assert {fault.process for fault in trace.faults()} == {"a.py"}
    assert len(trace.messages("/other")) > 60


@pytest.mark.ros
@pytest.mark.long
def test_what_a_large_honest_node_needs_is_far_from_the_limits(run: Callable[..., AssessedTrace]) -> None:
    """Loops, child processes with pipes, and a hundred sockets."""
    trace = run(
        """
import asyncio
kept.extend(asyncio.new_event_loop() for _ in range(10))
kept.extend(subprocess.Popen([sys.executable, "-I", "-S", "-c", "import time; time.sleep(60)"],
    stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) for _ in range(8))
for _ in range(20):
    kept.append(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
"""
    )
    assert trace.faults() == ()
    assert len(trace.messages("/cmd_vel")) > 60


def test_the_limits_are_within_the_limit_of_memory() -> None:
    """What a node may hold in sockets and pipes is a part of what it may hold."""
    assert 2 * IN_SOCKETS_BYTES <= Limits().memory_bytes == 512 * MIB
