"""Runs as a student's process inside a sandbox, tries what must fail and what must work, and reports what succeeded.

Usage: python -c SOURCE JSON; the object is that of `trial.probe_command`. Prints one JSON line, an object of property
to what was achieved against it, empty if nothing was; then tries to outgrow its scratch folder, and prints `outgrown`
if it could. The source travels on the command line, since nothing of grader can be seen from inside.
"""

# Every run of the grader may wait for it, and pathlib would be half of its imports.
# ruff: noqa: PTH108, PTH112, PTH118, PTH120, PTH123, PTH208

from __future__ import annotations

import _thread
import contextlib
import ctypes
import fcntl
import json
import mmap
import os
import resource
import select
import signal
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

AF_VSOCK = 40
AT_ONCE = 2  # MNT_DETACH
READ_SEARCH_ONLY = 1 << 2  # CAP_DAC_READ_SEARCH: to enter folders that are closed to the student's user
SIOCGIFFLAGS = 0x8913  # linux/sockios.h
#: What the kernel puts into every network of its own accord, switched off.
TUNNELS = ("tunl0", "sit0", "ip6tnl0", "gre0", "gretap0", "erspan0", "ip_vti0", "ip6_vti0", "ip6gre0")
SMALL_STACK = 64 << 10
#: An address on the same machine answers at once, if it can be reached at all.
PATIENCE_S = 0.2
#: Whoever watches the scratch folder may be slow on a busy machine.
END_S = 4.0
MARK = (4711, 4711)


def main(request: dict[str, Any]) -> None:
    """Try everything and report."""
    achieved = {name: list(attempt(request)) for name, attempt in ATTEMPTS.items()}
    kept = exchange()
    print(json.dumps(achieved), flush=True)  # noqa: T201 -- the answer
    if outgrows(request["scratch"]):
        print("outgrown", flush=True)  # noqa: T201
    # Shutting ROS down takes longer than everything else here.
    os._exit(0 if kept else 1)


def works(attempt: Callable[..., Any], *arguments: Any) -> bool:
    """Return whether an attempt succeeds."""
    try:
        attempt(*arguments)
    except (OSError, ValueError, OverflowError):
        return False
    return True


def reads(request: dict[str, Any]) -> Iterator[str]:
    """Open hidden files."""
    for path in request["hidden"]:
        if works(os.listdir if os.path.isdir(path) else read, path):
            yield f"read {path}"


def writes(request: dict[str, Any]) -> Iterator[str]:
    """Make, empty and change files outside the scratch folders, mount something, or have a privilege that would."""
    for folder in (*request["closed"], os.path.dirname(os.__file__), os.path.dirname(sys.executable)):
        path = os.path.join(folder, ".probe")
        if works(make, path):
            os.unlink(path)
            yield f"wrote to {folder}"
    for path in request["files"]:
        for what, attempt, arguments in (
            ("opened", os.open, (path, os.O_WRONLY)),
            ("emptied", os.truncate, (path, 0)),
            ("emptied", os.open, (path, os.O_RDONLY | os.O_TRUNC)),
            ("changed the mode of", os.chmod, (path, 0o600)),
        ):
            if works(attempt, *arguments):
                yield f"{what} {path}"
    if ctypes.CDLL(None).mount(b"none", b".", b"tmpfs", 0, None) == 0:
        ctypes.CDLL(None).umount2(b".", AT_ONCE)
        yield "mounted a file system"
    if os.getuid() == 0 or (status("CapEff") | status("CapPrm")) & ~READ_SEARCH_ONLY:
        yield "has privileges"


def read(path: str) -> None:
    """Open a file to read it."""
    with open(path, "rb"):
        pass


def make(path: str) -> None:
    """Make a file."""
    with open(path, "xb"):
        pass


def status(name: str) -> int:
    """Return a hexadecimal entry of /proc/self/status."""
    with open("/proc/self/status", encoding="ascii", errors="replace") as lines:
        return next((int(line.split()[1], 16) for line in lines if line.startswith(name + ":")), 0)


def outgrows(size: int) -> bool:
    """Write more than the scratch folder may hold, in several files; does not return if the process is killed."""
    block = bytes(1 << 20)
    try:
        for number in range(2 * (size >> 20)):
            with open(f"scratch-{number}", "wb") as file:
                file.write(block)
    except OSError:
        return False
    time.sleep(END_S)
    return True


def others(request: dict[str, Any]) -> set[int]:
    """Return the pids that other processes may have."""
    seen = set()
    with contextlib.suppress(OSError):
        seen = {int(name) for name in os.listdir("/proc") if name.isdigit()}
    return {number for number in seen | {1, os.getppid(), request["worker"]} if number not in (0, os.getpid())}


def sees(request: dict[str, Any]) -> Iterator[str]:
    """Find the worker's secret, which is in its command line and environment."""
    secret = "".join(request["secret"]).encode()
    for process in sorted(others(request)):
        for name in ("cmdline", "environ"):
            with contextlib.suppress(OSError), open(f"/proc/{process}/{name}", "rb") as file:
                if secret in file.read():
                    yield f"read /proc/{process}/{name}"


def disturbs(request: dict[str, Any]) -> Iterator[str]:
    """Attack the worker, which checks itself whether anything had an effect."""
    worker = request["worker"]
    if worker == os.getpid():
        return
    for what, attempt, arguments in (
        ("signalled", os.kill, (worker, signal.SIGUSR1)),
        ("limited", resource.prlimit, (worker, resource.RLIMIT_MSGQUEUE, MARK)),
        ("opened", os.pidfd_open, (worker,)),
    ):
        if works(attempt, *arguments):
            yield f"{what} the worker"
    works(os.setpriority, os.PRIO_PROCESS, worker, 15)
    works(os.sched_setaffinity, worker, {max(os.sched_getaffinity(0))})


def leaves(request: dict[str, Any]) -> Iterator[str]:
    """Find a network besides the loopback, reach an address of this machine there, or a way to another one."""
    for _, name in socket.if_nameindex():
        if name != "lo" and (is_up(name) or (request["shared"] and name not in TUNNELS)):
            yield "a network besides the loopback"
    for host, port in request["sinks"]:
        for name, kind in (("TCP", socket.SOCK_STREAM), ("UDP", socket.SOCK_DGRAM)):
            if works(send, host, port, kind):
                yield f"{name} to an address beyond the loopback"
    for family, host in ((socket.AF_INET, "192.0.2.1"), (socket.AF_INET6, "2001:db8::1")):
        # Connecting a datagram socket asks for a route and sends nothing.
        if works(send, host, 9, socket.SOCK_DGRAM, family, b""):
            yield f"a route out of this machine ({family.name})"


def is_up(interface: str) -> bool:
    """Return whether a network interface is switched on."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        found = fcntl.ioctl(asked, SIOCGIFFLAGS, struct.pack("16sh14x", interface.encode(), 0))
    return bool(struct.unpack_from("16sh", found)[1] & 1)


def send(
    host: str, port: int, kind: socket.SocketKind, family: socket.AddressFamily = socket.AF_INET, text: bytes = b"probe"
) -> None:
    """Connect to an address and send something there."""
    with socket.socket(family, kind) as there:
        there.settimeout(PATIENCE_S)
        there.connect((host, port))
        if text:
            there.send(text)


def calls_out(request: dict[str, Any]) -> Iterator[str]:
    """Send to a listener on the loopback address outside, which checks itself whether anything arrived."""
    works(send, "127.0.0.1", request["loopback"], socket.SOCK_DGRAM)
    return iter(())


def opens_vsock(request: dict[str, Any]) -> Iterator[str]:
    """Open a socket to the machine's hypervisor, which a network namespace does not prevent."""
    del request
    if works(socket.socket, AF_VSOCK, socket.SOCK_STREAM):
        yield "opened AF_VSOCK"


def shares(request: dict[str, Any]) -> Iterator[str]:
    """Open segments of shared memory that others made, or make one that outlives this process."""
    for path in request["segments"]:
        if works(os.open, path, os.O_RDWR):
            yield f"opened {path}"
    segment = ctypes.CDLL(None).shmget(0, 4096, 0o1600)
    if segment >= 0:
        ctypes.CDLL(None).shmctl(segment, 0, None)
        yield "made a System V segment"


def raises(which: int) -> bool:
    """Return whether a limit is missing or can be raised."""
    _, most = resource.getrlimit(which)
    return most == resource.RLIM_INFINITY or works(resource.setrlimit, which, (most + 1, most + 1))


def hoards(request: dict[str, Any]) -> Iterator[str]:
    """Map more memory than the limit allows."""
    private = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | 0x4000  # MAP_NORESERVE: a small machine may refuse
    if raises(resource.RLIMIT_AS) or works(mmap.mmap, -1, request["memory"], private):
        yield f"mapped {request['memory'] >> 20} MiB"


def multiplies(request: dict[str, Any]) -> Iterator[str]:
    """Start threads until it is refused, or far too many: the kernel counts them and processes together."""
    here, there = os.pipe()
    usual = threading.stack_size(SMALL_STACK)
    started = 0
    try:
        while started < request["threads"]:
            _thread.start_new_thread(os.read, (here, 1))
            started += 1
        yield f"started {started} threads"
    except RuntimeError:
        pass
    finally:
        os.close(there)
        threading.stack_size(usual)
        while threads_left():
            time.sleep(0.001)
        os.close(here)


def threads_left() -> int:
    """Return how many other threads the system still counts: ROS is refused threads as long as it does."""
    try:
        return len(os.listdir("/proc/self/task")) - 1
    except OSError:
        return _thread._count()  # noqa: SLF001 -- they are not of the module threading


def computes(request: dict[str, Any]) -> Iterator[str]:
    """Compute without end: the limit is seen, and cannot be raised."""
    del request
    if raises(resource.RLIMIT_CPU):
        yield "has no limit of processor time"


def exchange() -> Any:
    """Send back what the worker's node sends, until it closes the connection; return the node."""
    import rclpy  # noqa: PLC0415 -- after the attempts: it starts threads
    from std_msgs.msg import String  # noqa: PLC0415

    rclpy.init()
    node = rclpy.create_node("probe", start_parameter_services=False, enable_rosout=False)
    back = node.create_publisher(String, "probe_back", 10)
    node.create_subscription(String, "probe_forth", back.publish, 10)
    while not select.select([0], [], [], 0)[0]:
        rclpy.spin_once(node, timeout_sec=0.01)
    return node


ATTEMPTS: dict[str, Callable[[dict[str, Any]], Iterator[str]]] = {
    "fs_read": reads,
    "fs_write": writes,
    "procs": sees,
    "signals": disturbs,
    "net_egress": leaves,
    "vsock": opens_vsock,
    "shm": shares,
    "mem": hoards,
    "pids": multiplies,
    "cpu": computes,
    "dds_private": calls_out,
}

if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
