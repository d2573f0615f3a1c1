"""Finds out how much memory of the kernel is in the sockets and pipes of processes, which counts as no process's."""

from __future__ import annotations

import os
import re
import socket
import struct
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import KIB

#: What a socket may hold in each direction, and a pipe: their usual sizes, which students' processes cannot change
#: (`sandbox/seccomp.py`). A socket takes in one last packet when it is nearly full.
SOCKET_BYTES, PIPE_BYTES = 272 * KIB, 64 * KIB
#: A network with so many sockets is looked at closely; a worker and three forks, each with two nodes, have about 120.
#: Fewer sockets hold too little to matter, unless they are TCP's, whose buffers grow.
MANY_SOCKETS = 200
#: Processes with so many descriptors are looked at closely; a node has about 22.
MANY_DESCRIPTORS = 300

# linux/netlink.h, linux/sock_diag.h, linux/unix_diag.h and linux/inet_diag.h
_NETLINK_SOCK_DIAG, _BY_FAMILY, _REQUEST_DUMP, _DONE, _ERROR = 4, 20, 0x301, 3, 2
_HEADER, _ATTRIBUTE, _LISTEN = struct.Struct("=IHHII"), struct.Struct("=HH"), 10
_UNIX_QUEUES, _UNIX_MEMORY, _SHOW = 4, 5, 0x10 | 0x20
_INET_MEMORY = 7
#: The families to ask about, each with its protocol.
_UNIX = (socket.AF_UNIX, 0)
_UDP = ((socket.AF_INET, socket.IPPROTO_UDP), (socket.AF_INET6, socket.IPPROTO_UDP))
_TCP = ((socket.AF_INET, socket.IPPROTO_TCP), (socket.AF_INET6, socket.IPPROTO_TCP))

_COUNTS = re.compile(rb"sockets: used (\d+)\nTCP: inuse (\d+) orphan (\d+)")
_LINK = re.compile(r"(socket|pipe):\[(\d+)\]")


@dataclass(frozen=True, slots=True)
class KernelMemory:
    """What some processes hold in the kernel: sockets and pipes, and the memory in them."""

    sockets: int = 0
    pipes: int = 0
    memory_bytes: int = 0


class SocketMemory:
    """Looks at the sockets and pipes of processes, closely only if there may be much in them.

    Args:
        shared: Whether the network is used by other programs as well; sockets that no process has open, such as
            connections that were not accepted, then belong to no process.
    """

    def __init__(self, *, shared: bool) -> None:
        self._shared = shared

    def may_be_much(self) -> tuple[bool, bool]:
        """Return whether there are many sockets in this network, and whether there are connections of TCP."""
        found = _COUNTS.match(_read("/proc/self/net/sockstat"))
        if found is None:
            return True, True
        used, connections, orphans = map(int, found.groups())
        return used >= MANY_SOCKETS, connections + orphans > 0

    def look(self, families: Iterable[Collection[int]], *, tcp: bool) -> list[KernelMemory]:
        """Return what each family of processes holds.

        Args:
            families: The processes of each.
            tcp: Whether to look at connections of TCP, which takes the kernel some milliseconds.
        """
        open_by = [objects(pids) for pids in families]
        bytes_of = socket_bytes((_UNIX, *_UDP, *(_TCP if tcp else ())))
        nobodys = 0
        if not self._shared:
            everybodys = objects(int(name) for name in os.listdir("/proc") if name.isdecimal())  # noqa: PTH208
            nobodys = sum(size for inode, size in bytes_of.items() if ("socket", inode) not in everybodys)
        found = []
        for own in open_by:
            sockets = [inode for kind, inode in own if kind == "socket"]
            pipes = len(own) - len(sockets)
            # A kernel without this interface tells of no socket: each may be full.
            in_sockets = sum(bytes_of.get(inode, 0) for inode in sockets) if bytes_of else SOCKET_BYTES * len(sockets)
            found.append(KernelMemory(len(sockets), pipes, in_sockets + nobodys + PIPE_BYTES * pipes))
        return found


def descriptors(pids: Iterable[int]) -> int:
    """Return how many descriptors processes have open, together."""
    count = 0
    for pid in pids:
        with suppress(OSError):
            # The size is the count since Linux 6.2, and 0 before.
            count += os.stat(f"/proc/{pid}/fd").st_size or len(os.listdir(f"/proc/{pid}/fd"))  # noqa: PTH116, PTH208
    return count


def objects(pids: Iterable[int]) -> set[tuple[str, int]]:
    """Return the sockets and pipes that processes have open, as kind and inode, each once."""
    found = set()
    for pid in pids:
        with suppress(OSError):
            for name in os.listdir(f"/proc/{pid}/fd"):  # noqa: PTH208
                with suppress(OSError):
                    link = _LINK.fullmatch(os.readlink(f"/proc/{pid}/fd/{name}"))  # noqa: PTH115
                    if link is not None:
                        found.add((link[1], int(link[2])))
    return found


def socket_bytes(kinds: Iterable[tuple[int, int]]) -> Counter[int]:
    """Return the memory in the sockets of this network by inode; 0 stands for all sockets that no process has open.

    Empty if the kernel does not offer sock_diag(7).
    """
    found: Counter[int] = Counter()
    with suppress(OSError), socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, _NETLINK_SOCK_DIAG) as asked:
        for family, protocol in kinds:
            if family == socket.AF_UNIX:
                request = struct.pack("=BBHIIIII", family, 0, 0, 0xFFFFFFFF, 0, _SHOW, 0xFFFFFFFF, 0xFFFFFFFF)
            else:
                request = struct.pack("=BBBBI48x", family, protocol, 1 << _INET_MEMORY - 1, 0, 0xFFFFFFFF)
            asked.send(_HEADER.pack(_HEADER.size + len(request), _BY_FAMILY, _REQUEST_DUMP, 1, 0) + request)
            for message in _messages(asked):
                inode, size = _unix(message) if family == socket.AF_UNIX else _inet(message)
                found[inode] += size
    return found


def _messages(asked: socket.socket) -> Iterator[bytes]:
    """Yield the answers to a request until the kernel says that there are no more, or that it does not know it."""
    while True:
        received = asked.recv(1 << 16)
        at = 0
        while at < len(received):
            length, kind, *_ = _HEADER.unpack_from(received, at)
            if kind in (_DONE, _ERROR):
                return
            yield received[at + _HEADER.size : at + length]
            at += _aligned(length)


def _unix(message: bytes) -> tuple[int, int]:
    _, _, state, _, inode = struct.unpack_from("=BBBBI", message)
    told = _attributes(message[16:])
    waiting, _ = struct.unpack("=II", told.get(_UNIX_QUEUES, bytes(8)))
    if state == _LISTEN:  # connections that wait to be accepted, each of which may be full
        return inode, waiting * SOCKET_BYTES
    # What was sent is charged to the sender; if that is gone, it is only in the queue of the receiver.
    return inode, max(waiting, _memory(told.get(_UNIX_MEMORY)))


def _inet(message: bytes) -> tuple[int, int]:
    (inode,) = struct.unpack_from("=I", message, 68)
    return inode, _memory(_attributes(message[72:]).get(_INET_MEMORY))


def _memory(told: bytes | None) -> int:
    """Return what a socket holds: received, sent, reserved, for options, and not yet processed."""
    if told is None or len(told) < 32:
        return 0
    numbers: tuple[int, ...] = struct.unpack_from("=8I", told)
    received, _, sent, _, reserved, queued, options, backlog = numbers
    return received + max(sent, queued) + reserved + options + backlog


def _attributes(data: bytes) -> dict[int, bytes]:
    found, at = {}, 0
    while at + _ATTRIBUTE.size <= len(data):
        length, kind = _ATTRIBUTE.unpack_from(data, at)
        found[kind] = data[at + _ATTRIBUTE.size : at + length]
        at += max(_ATTRIBUTE.size, _aligned(length))
    return found


def _aligned(length: int) -> int:
    return length + 3 & ~3


def _read(path: str) -> bytes:
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return b""
    try:
        return os.read(descriptor, 1 << 12)
    finally:
        os.close(descriptor)
