"""Makes what it may only read writable, by mounting it again, and mounts what it does not see."""

import os

from attempts import LIBC, attempt, checked, run

REMOUNT_BIND, BIND, MOVE = 0x1020, 0x1000, 0x2000


@attempt
def remounts(node):
    return any([mounts(None, place, REMOUNT_BIND) for place in (b"/", b"/submission", b"/usr", b"/grader_host/host")])


@attempt
def binds(node):
    return mounts(b"/proc/1/root", b"/tmp/work", BIND) or mounts(b"/", b"/tmp/work", BIND)


@attempt
def unmounts(node):
    return any([LIBC.umount2(place, 2) == 0 for place in (b"/submission", b"/tmp", b"/proc", b"/dev")])


@attempt
def changes_root(node):
    return checked(LIBC.chroot(b"/tmp")) == 0 or checked(LIBC.pivot_root(b".", b".")) == 0


@attempt
def writes(node):
    return any([is_written(place) for place in ("/", "/usr/lib", "/grader_host/host", os.path.dirname(os.__file__))])


def is_written(place):
    try:
        with open(os.path.join(place, "written"), "w"):
            return True
    except OSError:
        return False


def mounts(source, target, flags):
    return LIBC.mount(source, target, None, flags, None) == 0


run()
