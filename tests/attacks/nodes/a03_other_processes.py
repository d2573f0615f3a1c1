"""Looks into the memory, environment, command line, folder and descriptors of the grader's processes."""

import os

from attempts import attempt, holds_canary, run


def others():
    return [number for number in os.listdir("/proc") if number.isdigit() and number not in ("1", str(os.getpid()))]


@attempt
def sees_another_process(node):
    return others()


@attempt
def reads_a_command_line(node):
    return any([readable(number, name) for number in others() for name in ("cmdline", "environ", "maps")])


@attempt
def follows_a_link(node):
    return any([follows(number, name) for number in ["1", *others()] for name in ("cwd", "exe", "root")])


@attempt
def takes_files_from_descriptors(node):
    return [link for number in ["1", *others()] for link in descriptors(number) if opens(link)]


@attempt
def reads_memory(node):
    return any([in_memory(number) for number in ["1", *others()]])


@attempt
def writes_memory(node):
    return [number for number in ["1", *others()] if writes(number)]


def readable(number, name):
    try:
        with open(f"/proc/{number}/{name}", "rb") as file:
            return holds_canary(file.read(1 << 16)) or name != "environ"
    except OSError:
        return False


def descriptors(number):
    try:
        return [f"/proc/{number}/fd/{fd}" for fd in os.listdir(f"/proc/{number}/fd")]
    except OSError:
        return []


def opens(link):
    """Return whether there is a file or a folder behind a descriptor, other than a device or a pipe."""
    try:
        target = os.readlink(link)
        return target.startswith("/") and not target.startswith("/dev/") and os.path.exists(link)
    except OSError:
        return False


def regions(number):
    """Return the writable regions of a process: where they begin, where they end, and what they are."""
    with open(f"/proc/{number}/maps") as file:
        lines = [line.split() for line in file if " rw" in line]
    return [(*(int(part, 16) for part in line[0].split("-")), line[-1]) for line in lines]


def in_memory(number):
    found = False
    try:
        with open(f"/proc/{number}/mem", "rb", buffering=0) as memory:
            for start, stop, _ in regions(number):
                memory.seek(start)
                found |= holds_canary(memory.read(min(stop - start, 1 << 22)))
    except OSError:
        return found
    return found


def writes(number):
    """Return whether a process could be made to run something else: write to it what is there already."""
    try:
        with open(f"/proc/{number}/mem", "r+b", buffering=0) as memory:
            start = next(start for start, _, name in regions(number) if name == "[stack]")
            memory.seek(start)
            there = memory.read(8)
            memory.seek(start)
            return memory.write(there)
    except (OSError, StopIteration):
        return False


def follows(number, name):
    try:
        return os.readlink(f"/proc/{number}/{name}") and number != "1"
    except OSError:
        return False


run()
