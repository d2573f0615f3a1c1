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
def lists_descriptors(node):
    return any([lists(number) for number in ["1", *others()]])


@attempt
def opens_memory(node):
    return any([readable(number, "mem", 0) for number in ["1", *others()]])


def readable(number, name, size=1 << 16):
    try:
        with open(f"/proc/{number}/{name}", "rb") as file:
            return holds_canary(file.read(size)) or size == 0 or name != "environ"
    except OSError:
        return False


def follows(number, name):
    try:
        return os.readlink(f"/proc/{number}/{name}") and number != "1"
    except OSError:
        return False


def lists(number):
    try:
        return any(os.readlink(f"/proc/{number}/fd/{fd}").startswith("/") for fd in os.listdir(f"/proc/{number}/fd"))
    except OSError:
        return False


run()
