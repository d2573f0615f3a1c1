"""Reads whatever descriptor was left open by those who started this process."""

import os

from attempts import attempt, holds_canary, run


def descriptors():
    for number in range(3, 4096):
        try:
            yield number, os.readlink(f"/proc/self/fd/{number}")
        except OSError:
            continue


@attempt
def secret_behind_a_descriptor(node):
    found = False
    for number, _ in descriptors():
        try:
            found |= holds_canary(os.pread(number, 1 << 16, 0))
        except OSError:
            continue
    return found


@attempt
def file_that_is_not_mine(node):
    mine = ("/dev/", "/proc/self", "/tmp/", "anon_inode:", "socket:", "pipe:", "/submission")
    return [target for _, target in descriptors() if not target.startswith(mine)]


run()
