"""Starts a program without the help of namespaces: limits, a throw-away folder, and walls that the kernel gives anyone.

Usage: start.py JSON PROGRAM [ARGUMENT ...]. The object has `folder`, the working directory; `made`, whether it is to be
made before the start and deleted after the end; `scratch`, the bytes it may hold then, 0 for any number; `limits`, by
their names in `resource`; `user`, [user, group] to become, or null; `processes`, how many processes and threads may be
added to those that the user has already, 0 for any number; and `walls`, null or an object of `read` and `devices`,
paths that may be read, or also written; `hidden`, folders among them that may not; `tcp`, whether TCP is allowed;
`reach`, whether folders that are closed to the user are on the way; `filter`, a seccomp program in hexadecimal.

It imports nothing of grader, since it runs before anything of it can be found. Landlock's calls and rights: Linux,
Documentation/userspace-api/landlock.rst; the filter: Documentation/userspace-api/seccomp_filter.rst.
"""

# It starts before every student process, and pathlib would be half of its imports.
# ruff: noqa: PTH102, PTH110, PTH112, PTH116, PTH118, PTH208

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import resource
import select
import shutil
import signal
import struct
import sys
from collections.abc import Iterator
from typing import Any

SET_PARENT_DEATH_SIGNAL = 1  # linux/prctl.h
KEEP_CAPABILITIES = 8
SET_SECCOMP, SECCOMP_FILTER = 22, 2
DROP_FROM_BOUNDING_SET, NO_NEW_PRIVILEGES, AMBIENT, AMBIENT_RAISE = 24, 38, 47, 2
LAST_CAPABILITY = 63
CAPABILITIES_VERSION_3 = 0x20080522  # linux/capability.h
CAP_DAC_READ_SEARCH = 2

# The same numbers on every architecture.
CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446
ASK_VERSION, PATH_BENEATH = 1, 1
EXECUTE, WRITE_FILE, READ_FILE, READ_DIR = 1 << 0, 1 << 1, 1 << 2, 1 << 3
MAKE_DEVICES = 1 << 6 | 1 << 11
TRUNCATE = 1 << 14
ALL_TCP, ALL_SCOPES = 0b11, 0b11
READ = EXECUTE | READ_FILE | READ_DIR
ON_FILES = EXECUTE | WRITE_FILE | READ_FILE | TRUNCATE
#: Rights on files that a version of Landlock knows.
KNOWN_RIGHTS = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1, 4: (1 << 15) - 1, 5: (1 << 16) - 1}

#: In a filter, stands for the number of the process that it is loaded into.
OWN_PROCESS = 0x7FFFFF01
#: A user's other programs may start so many threads meanwhile, before a student's process feels it.
SPARE = 256
#: Ends a process whose scratch folder outgrew its size: a signal that nobody else sends, and that Python leaves alone.
OUTGROWN = signal.SIGPWR
#: Seconds between two looks at the size of a scratch folder, and how many files a look counts at most.
LOOK_S, MOST_FILES = 0.05, 10_000


def main(arguments: list[str]) -> None:
    """Prepare this process and become the program."""
    request: dict[str, Any] = json.loads(arguments[0])
    system = ctypes.CDLL(None, use_errno=True)
    parent = os.getppid()
    if os.getsid(0) != os.getpid():
        # Fails for the leader of a group, whose group is then as good as a session of its own.
        with contextlib.suppress(PermissionError):
            os.setsid()
    enter_folder(request)
    for name, value in request["limits"].items():
        limit(getattr(resource, name), value)
    if request["processes"]:
        limit(resource.RLIMIT_NPROC, request["processes"] + (0 if request["user"] else running() + SPARE))
    walls = request["walls"]
    rules = ruleset(system, walls, request["folder"]) if walls else -1
    if request["user"]:
        become(system, *request["user"], reach=bool(walls and walls["reach"]))
    # Changing the user forgets this: it comes after.
    call(system.prctl, SET_PARENT_DEATH_SIGNAL, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)
    if walls:
        wall_in(system, rules, bytes.fromhex(walls["filter"]))
    os.execv(arguments[1], arguments[1:])  # noqa: S606 -- becoming the program is the purpose


# --- folder and limits ---


def enter_folder(request: dict[str, Any]) -> None:
    """Make the folder, if it is to be made, and go there."""
    folder = request["folder"]
    if not request["made"]:
        os.chdir(folder)
        return
    for part in ("", "home", "home/log", "work"):
        os.mkdir(os.path.join(folder, part), mode=0o700)
        if request["user"]:
            os.chown(os.path.join(folder, part), *request["user"])
    clean_up_after_end(folder, request["scratch"])
    os.chdir(os.path.join(folder, "work"))


def limit(which: int, value: int) -> None:
    """Lower a limit; one that is lower already stays."""
    _, most = resource.getrlimit(which)
    value = value if most == resource.RLIM_INFINITY else min(value, most)
    resource.setrlimit(which, (value, value))


def running() -> int:
    """Return how many processes and threads this user has: the kernel counts them together."""
    count, user = 0, os.getuid()
    for process in filter(str.isdigit, os.listdir("/proc")):
        with contextlib.suppress(OSError):
            if os.stat(f"/proc/{process}").st_uid == user:
                count += len(os.listdir(f"/proc/{process}/task"))
    return count


def clean_up_after_end(folder: str, scratch: int) -> None:
    """Leave a small process behind that ends what this one started and deletes the folder, however this one ends.

    It also ends this one after its parent, whatever the program thinks of that, and where the folder outgrows its size
    if that is not 0.
    """
    process = os.getpid()
    watched = [os.pidfd_open(process), os.pidfd_open(os.getppid())]
    middle = os.fork()
    if middle:
        os.waitpid(middle, 0)
        for descriptor in watched:
            os.close(descriptor)
        return
    # Nobody's child and in nobody's session: what kills the others must not keep the folder from being deleted.
    os.setsid()
    if os.fork():
        os._exit(0)
    os.chdir("/")
    os.dup2(os.dup(watched[0]), 0)
    os.dup2(os.dup(watched[1]), 1)
    os.closerange(2, os.sysconf("SC_OPEN_MAX"))
    while not select.select([0, 1], [], [], LOOK_S if scratch else None)[0]:
        if outgrown(folder, scratch):
            # Told apart from every other end; a program that catches it gains nothing.
            with contextlib.suppress(OSError):
                os.kill(process, OUTGROWN)
            select.select([0, 1], [], [], LOOK_S)
            end_group(process)
    end_group(process)
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(0)


def end_group(leader: int) -> None:
    """End a process and everything in its group."""
    with contextlib.suppress(OSError):
        os.killpg(leader, signal.SIGKILL)


def outgrown(folder: str, size: int) -> bool:
    """Return whether the files of a folder take more than so many bytes, or are too many to count."""
    used = 0
    for number, entry in enumerate(entries(folder)):
        with contextlib.suppress(OSError):
            used += entry.stat(follow_symlinks=False).st_blocks * 512
        if used > size or number >= MOST_FILES:
            return True
    return False


def entries(folder: str) -> Iterator[os.DirEntry[str]]:
    """Yield everything in a folder, without following links."""
    folders = [folder]
    while folders:
        with contextlib.suppress(OSError), os.scandir(folders.pop()) as found:
            for entry in found:
                yield entry
                if entry.is_dir(follow_symlinks=False):
                    folders.append(entry.path)


# --- user ---


def become(system: Any, user: int, group: int, *, reach: bool) -> None:
    """Become another user without privileges.

    Args:
        system: The C library.
        user: Its number.
        group: Its only group.
        reach: Whether to keep the privilege to enter folders that are closed to it; Landlock still says which.
    """
    for capability in range(LAST_CAPABILITY + 1):
        if capability != CAP_DAC_READ_SEARCH or not reach:
            call(system.prctl, DROP_FROM_BOUNDING_SET, capability, 0, 0, 0)
    if reach:
        call(system.prctl, KEEP_CAPABILITIES, 1, 0, 0, 0)
    os.setgroups([])
    os.setresgid(group, group, group)
    os.setresuid(user, user, user)
    if reach:
        kept = 1 << CAP_DAC_READ_SEARCH
        header = struct.pack("=Ii", CAPABILITIES_VERSION_3, 0)
        checked(call(system.capset, header, struct.pack("=6I", kept, kept, kept, 0, 0, 0)), "capset")
        raised = call(system.prctl, AMBIENT, AMBIENT_RAISE, CAP_DAC_READ_SEARCH, 0, 0)
        checked(raised, "an ambient capability")


# --- walls ---


def landlock_version(system: Any = None) -> int:
    """Return which version of Landlock this kernel has; 0 if none, or if it is switched off."""
    system = system or ctypes.CDLL(None, use_errno=True)
    return max(0, call(system.syscall, CREATE_RULESET, None, 0, ASK_VERSION))


def ruleset(system: Any, walls: dict[str, Any], folder: str) -> int:
    """Return a descriptor of the rules: what may be read, and the folder that may be written to."""
    version = landlock_version(system)
    if version < 1:
        raise OSError("Landlock: expected version 1 or newer, found none")
    handled = KNOWN_RIGHTS[min(version, max(KNOWN_RIGHTS))]
    tcp = ALL_TCP if version >= 4 and not walls["tcp"] else 0
    scopes = ALL_SCOPES if version >= 6 else 0
    attributes = struct.pack("=QQQ", handled, tcp, scopes)[: 24 if version >= 6 else 16 if version >= 4 else 8]
    rules = checked(call(system.syscall, CREATE_RULESET, attributes, len(attributes), 0), "Landlock")
    for path in (*walls["read"], "/proc/self"):
        allow(system, rules, path, READ, tuple(walls["hidden"]))
    for path in walls["devices"]:
        allow(system, rules, path, (READ_FILE | WRITE_FILE), ())
    allow(system, rules, folder, handled & ~EXECUTE & ~MAKE_DEVICES, ())
    return int(rules)


def allow(system: Any, rules: int, path: str, rights: int, hidden: tuple[str, ...]) -> None:
    """Allow rights on a file, or on a folder and everything below it but the hidden folders."""
    if not os.path.exists(path) or path in hidden:
        return
    is_folder = os.path.isdir(path)
    if is_folder and any(place.startswith(path.rstrip("/") + "/") for place in hidden):
        # Rights go down to everything below, and names are no secret.
        add_rule(system, rules, path, rights & READ_DIR)
        with os.scandir(path) as found:
            for entry in found:
                if not entry.is_symlink():
                    allow(system, rules, entry.path, rights, hidden)
        return
    add_rule(system, rules, path, rights if is_folder else rights & ON_FILES)


def add_rule(system: Any, rules: int, path: str, rights: int) -> None:
    """Add one rule; the path is followed through links."""
    place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    try:
        rule = struct.pack("=Qi", rights, place)
        checked(call(system.syscall, ADD_RULE, rules, PATH_BENEATH, rule, 0), f"Landlock on {path}")
    finally:
        os.close(place)


def wall_in(system: Any, rules: int, program: bytes) -> None:
    """Put the walls around this process for good."""
    checked(call(system.prctl, NO_NEW_PRIVILEGES, 1, 0, 0, 0), "no new privileges")
    checked(call(system.syscall, RESTRICT_SELF, rules, 0), "Landlock")
    os.close(rules)
    load_filter(system, program)


def load_filter(system: Any, program: bytes) -> None:
    """Load a seccomp program, with the number of this process where it asks for it."""
    words = list(struct.iter_unpack("=HBBI", program))
    own = os.getpid()
    given = {OWN_PROCESS: own, -OWN_PROCESS & 0xFFFFFFFF: -own & 0xFFFFFFFF}
    filled = b"".join(struct.pack("=HBBI", *word[:3], given.get(word[3], word[3])) for word in words)
    code = ctypes.create_string_buffer(filled, len(filled))
    described = struct.pack("@HP", len(words), ctypes.addressof(code))
    checked(call(system.prctl, SET_SECCOMP, SECCOMP_FILTER, described, 0, 0), "seccomp")


def call(function: Any, *arguments: int | bytes | None) -> int:
    """Call the C library with numbers of the width of a register, as calls with any number of arguments need."""
    return int(function(*(ctypes.c_long(value) if isinstance(value, int) else value for value in arguments)))


def checked(result: int, what: str) -> int:
    """Return the result of a call, or raise what went wrong."""
    if result < 0:
        error = ctypes.get_errno()
        raise OSError(error, f"{what}: {os.strerror(error)}")
    return result


if __name__ == "__main__":
    main(sys.argv[1:])
