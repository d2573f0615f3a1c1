"""Reaches for the memory, the descriptors and the interpreter of every other process, as siblings of one user can."""

import os
import sys

from attempts import LIBC, attempt, call, checked, run


def others():
    """Return every number that a process may have, but its own and those of its threads."""
    own = {os.getpid(), *map(int, os.listdir("/proc/self/task"))}
    return [number for number in {*range(1, 400), os.getppid()} if number > 0 and number not in own]


def any_other(function):
    """Return the first other process that a function succeeds with."""
    for number in others():
        try:
            if function(number):
                return number
        except (OSError, ValueError):
            continue
    return None


@attempt
def attaches_to_one(node):
    return any_other(lambda number: checked(LIBC.ptrace(16, number, 0, 0)) == 0)


@attempt
def seizes_one(node):
    return any_other(lambda number: checked(LIBC.ptrace(0x4206, number, 0, 0)) == 0)


@attempt
def reads_from_one(node):
    return any_other(lambda number: call("process_vm_readv", number, 0, 0, 0, 0, 0) >= 0)


@attempt
def writes_to_one(node):
    return any_other(lambda number: call("process_vm_writev", number, 0, 0, 0, 0, 0) >= 0)


@attempt
def takes_a_descriptor_of_one(node):
    def take(number):
        process = call("pidfd_open", number, 0)
        try:
            return call("pidfd_getfd", process, 0, 0) >= 0
        finally:
            os.close(process)

    return any_other(take)


@attempt
def opens_the_memory_of_one(node):
    def opened(number):
        with open(f"/proc/{number}/mem", "r+b", 0):
            return number != 1  # the first process of a sandbox is an empty folder

    return any_other(opened)


@attempt
def runs_python_in_one(node):
    """Only since Python 3.14; it needs to write to the memory of the other."""
    remote_exec = getattr(sys, "remote_exec", None)
    return remote_exec and any_other(lambda number: remote_exec(number, __file__) is None)


@attempt
def shares_memory_with_somebody(node):
    with open("/proc/self/maps") as lines:
        return [line for line in lines if line.split()[1].endswith("s")]


@attempt
def has_a_thread_or_a_descriptor_of_somebody(node):
    """The host opens one connection, and the interpreter has one thread until ROS starts."""
    with open("/proc/self/status") as lines:
        inherited = [line for line in lines if line.startswith(("CapEff", "CapPrm", "CapInh", "CapAmb"))]
    return [line for line in inherited if int(line.split()[1], 16) & ~(1 << 2)]


run()
