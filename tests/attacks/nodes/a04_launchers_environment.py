"""Reads the environment and the options of whatever started the sandbox."""

import os

from attempts import attempt, holds_canary, run


@attempt
def environment_of_the_first_process(node):
    with open("/proc/1/environ", "rb") as file:
        return holds_canary(file.read()) or False


@attempt
def environment_of_the_parent(node):
    with open(f"/proc/{os.getppid()}/environ", "rb") as file:
        return holds_canary(file.read())


@attempt
def options_of_the_first_process(node):
    with open("/proc/1/cmdline", "rb") as file:
        return b"bind" in file.read()


run()
