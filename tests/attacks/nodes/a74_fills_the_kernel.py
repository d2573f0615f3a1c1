"""Fills the kernel's memory where no process counts it: sockets in children, calls that nobody accepts, sockets sent away."""

import contextlib
import socket

from attempts import LIBC, attempt, run, spawn

ENOUGH = 400 << 20
KEPT = []


def fill(there):
    """Send until nothing more is taken; return how much was."""
    sent = 0
    there.setblocking(False)
    with contextlib.suppress(OSError):
        while True:
            sent += there.send(bytes(1 << 15))
    return sent


def filled_pair():
    KEPT.extend(socket.socketpair())
    return fill(KEPT[-1])


def hold_many():
    with contextlib.suppress(OSError):
        while True:
            filled_pair()
    LIBC.sleep(600)


@attempt
def is_let_in_peace_with_much_of_it(node):
    """Half a second of real time is twenty looks of a monitor."""
    with contextlib.suppress(OSError):
        for _ in range(20):
            spawn(hold_many)
    LIBC.usleep(500_000)
    calls = socket.socket(socket.AF_UNIX)
    calls.bind("\0kernel")
    calls.listen(4096)
    sent = 0
    with contextlib.suppress(OSError):
        while sent < ENOUGH:
            with socket.socket(socket.AF_UNIX) as caller:
                caller.connect("\0kernel")
                sent += fill(caller)
    LIBC.usleep(500_000)
    return sent >= ENOUGH


run()
