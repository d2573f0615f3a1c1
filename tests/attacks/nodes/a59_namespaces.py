"""Makes namespaces of its own, in which it would be root."""

import os

from attempts import attempt, call, run

KINDS = {"user": 0x10000000, "network": 0x40000000, "mount": 0x00020000, "pid": 0x20000000, "ipc": 0x08000000}


@attempt
def unshares(node):
    return [name for name, flag in KINDS.items() if works("unshare", flag)]


@attempt
def unshares_as_root(node):
    return works("unshare", KINDS["user"] | KINDS["network"] | KINDS["mount"])


@attempt
def enters_those_of_others(node):
    entered = False
    for name in ("net", "mnt", "user", "pid"):
        try:
            descriptor = os.open(f"/proc/1/ns/{name}", os.O_RDONLY)
        except OSError:
            continue
        entered |= works("setns", descriptor, 0)
    return entered


@attempt
def clones(node):
    return works("clone3", 0, 0)


def works(*arguments):
    try:
        call(*arguments)
    except OSError:
        return False
    return True


run()
