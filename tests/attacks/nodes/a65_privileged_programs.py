"""Runs programs that give privileges to whoever starts them."""

import os
import subprocess

from attempts import LIBC, attempt, run

PROGRAMS = ("su", "sudo", "mount", "umount", "pkexec", "newuidmap", "newgrp", "passwd", "chsh", "ping", "bwrap", "fusermount3")
PLACES = ("/usr/bin", "/bin", "/usr/sbin", "/usr/local/bin", "/usr/lib/openssh")
NO_NEW_PRIVILEGES = 39


@attempt
def may_gain_privileges(node):
    return LIBC.prctl(NO_NEW_PRIVILEGES, 0, 0, 0, 0) != 1


@attempt
def runs_as_another(node):
    return [path for path in programs() if runs(path)]


@attempt
def finds_one_with_the_bit(node):
    return [path for path in programs() if os.path.exists(path) and os.stat(path).st_mode & 0o6000 and runs(path)]


def programs():
    return [f"{place}/{name}" for place in PLACES for name in PROGRAMS]


def runs(path):
    arguments = [path, "-n", "id"] if path.endswith("sudo") else [path, "-c", "id"]
    try:
        done = subprocess.run(arguments, capture_output=True, stdin=subprocess.DEVNULL)
    except OSError:
        return False
    return b"uid=0" in done.stdout


run()
