"""Uses up what a user or the machine has only once, so that other programs get none of it."""

import contextlib
import ctypes
import fcntl
import mmap
import os
import socket
import struct

from attempts import LIBC, address, attempt, call, run

KEPT = []


def how_many(function, most):
    """Return how often a function succeeds, at most so often; what it returns stays open."""
    count = 0
    with contextlib.suppress(OSError, ValueError):
        while count < most:
            KEPT.append(function())
            count += 1
    return count


@attempt
def watches_files(node):
    return how_many(lambda: call("inotify_init1", 0), 200)


@attempt
def watches_files_in_the_old_way(node):
    return how_many(lambda: call("inotify_init"), 200)


@attempt
def submits_asynchronous_requests(node):
    here = bytearray(4096)
    return how_many(lambda: call("io_setup", 60_000, address(here)), 1)


@attempt
def keeps_timers_that_wait(node):
    here = bytearray(4096)
    return how_many(lambda: call("timer_create", 1, 0, address(here)), 2000) > 500


@attempt
def opens_terminals(node):
    return how_many(os.openpty, 50)


@attempt
def takes_huge_pages(node):
    return how_many(lambda: mmap.mmap(-1, 2 << 20, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | 0x40000), 1)


@attempt
def writes_rules(node):
    rules = bytearray(struct.pack("=QQQ", 1, 0, 0))
    return how_many(lambda: call("landlock_create_ruleset", address(rules), 8, 0), 1)


@attempt
def widens_pipes(node):
    here, there = os.pipe()
    KEPT.extend([here, there])
    return how_many(lambda: fcntl.fcntl(there, 1031, 1 << 20), 1)


@attempt
def widens_sockets(node):
    one, other = socket.socketpair()
    KEPT.extend([one, other])
    before = one.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF)
    one.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4 << 20)
    return one.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF) > before


@attempt
def leaves_datagrams(node):
    return how_many(lambda: socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM), 1)


@attempt
def gives_pages_to_a_pipe(node):
    here, there = os.pipe()
    KEPT.extend([here, there])
    return how_many(lambda: call("vmsplice", there, 0, 0, 0) + 1, 1)


@attempt
def locks_memory(node):
    room = mmap.mmap(-1, 8 << 20)
    KEPT.append(room)
    return LIBC.mlock(ctypes.c_void_p(address(room)), ctypes.c_size_t(8 << 20)) == 0


run()
