"""Starts a program in a sandbox without namespaces: limits, a temporary folder, Landlock and seccomp.

Usage: start.py JSON PROGRAM [ARGUMENT ...]. The object has `folder`, the working directory; `made`, whether to create
it before the start and delete it after the end; `beside` and `copied`, a folder, and files in it that it gets copies of
when it is created; `into` and `working`, folders in it: that of the copies, and the working directory; `scratch`, its
maximum size in bytes if it is created, 0 for unlimited; `limits`, by their names in `resource`; `user`, [user, group]
to run as, or null; `processes`, how many processes and threads may be added to those that the user has already, 0 for
unlimited; and `confinement`, null or an object of `read` and `devices`, paths that may be read, or also written;
`hidden`, folders among them that may not be read; `tcp`, whether TCP is allowed; `reach`, whether the paths lead
through folders that are closed to the user; `filter`, a seccomp program in hexadecimal.

It does not import grader, because it runs before grader can be found. For Landlock's calls and rights see Linux,
Documentation/userspace-api/landlock.rst; for the filter Documentation/userspace-api/seccomp_filter.rst.
"""

# It starts before every student process, and pathlib would be half of its imports.
# ruff: noqa: PTH102, PTH110, PTH112, PTH116, PTH118, PTH123, PTH208

from __future__ import annotations

import contextlib
import ctypes
import errno
import fcntl
import json
import os
import re
import resource
import shutil
import signal
import struct
import sys
from bisect import bisect_left
from collections.abc import Iterator
from select import select  # the real one: in a starter, the host replaces that of the module later
from typing import Any

SET_PARENT_DEATH_SIGNAL = 1  # linux/prctl.h
SET_DUMPABLE = 4
KEEP_CAPABILITIES = 8
SET_SECCOMP, SECCOMP_FILTER = 22, 2
DROP_FROM_BOUNDING_SET, NO_NEW_PRIVILEGES, AMBIENT, AMBIENT_RAISE = 24, 38, 47, 2
LAST_CAPABILITY = 63
CAPABILITIES_VERSION_3 = 0x20080522  # linux/capability.h
CAP_DAC_READ_SEARCH = 2
#: From sys/mman.h.
PROT_READ, PROT_WRITE, MAP_PRIVATE_FIXED_ANONYMOUS, MAP_FAILED = 1, 2, 0x02 | 0x10 | 0x20, ctypes.c_void_p(-1).value
#: A line of /proc/PID/maps about memory that is shared with other processes.
SHARED_MEMORY = re.compile(rb"^([0-9a-f]+)-([0-9a-f]+) ...s ", re.MULTILINE)

#: Mount, control group, host name, IPC and process namespaces of linux/sched.h.
NAMESPACES = 0x00020000 | 0x02000000 | 0x04000000 | 0x08000000 | 0x20000000
USER_NAMESPACE = 0x10000000

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
#: Linux never has more threads: PID_MAX_LIMIT of include/linux/threads.h.
MOST_THREADS = 1 << 22
#: Ends a process whose scratch folder outgrew its size: a signal that nobody else sends, and that Python leaves alone.
OUTGROWN = signal.SIGPWR
#: Seconds between two looks at the size of a scratch folder, and how many files a look counts at most.
LOOK_S, MOST_FILES = 0.05, 10_000


def main(arguments: list[str]) -> None:
    """Prepare this process and execute the program."""
    prepare(json.loads(arguments[0]))
    os.execv(arguments[1], arguments[1:])  # noqa: S606 -- becoming the program is the purpose


def prepare(request: dict[str, Any]) -> None:
    """Sandbox and limit this process, irrevocably."""
    system = ctypes.CDLL(None, use_errno=True)
    parent = os.getppid()
    if os.getsid(0) != os.getpid():
        # Fails for the leader of a process group, but such a group serves the same purpose as a session.
        with contextlib.suppress(PermissionError):
            os.setsid()
    enter_folder(request)
    for name, value in request["limits"].items():
        limit(getattr(resource, name), *(value if isinstance(value, list) else (value,)))
    if request["processes"]:
        limit(resource.RLIMIT_NPROC, request["processes"] + (0 if request["user"] else running() + SPARE))
    confinement, program = request["confinement"], bytes.fromhex(request["filter"])
    rules = ruleset(system, confinement, request["folder"]) if confinement else None
    if request["user"]:
        become_user(system, *request["user"], reach=bool(confinement and confinement["reach"]))
    elif program and (not confinement or os.geteuid() == 0):  # an ordinary user has none, and may not drop any
        drop_capabilities(system)
    # Changing the user resets both, so they have to come afterwards.
    die_with(parent)
    checked(call(system.prctl, SET_DUMPABLE, 1, 0, 0, 0), "dumpable")
    if program:
        restrict(system, rules, program)
        require_restrictions(request["user"])


def require_restrictions(user: list[int] | None) -> None:
    """Raise OSError unless the kernel itself says that this process has its user, no privileges and a filter.

    Args:
        user: User and group that it runs as; None for any.
    """
    with open("/proc/self/status", "rb", buffering=0) as file:
        status = dict(line.split(b":", 1) for line in file.read().splitlines() if b":" in line)
    privileges = int(status[b"CapEff"], 16) | int(status[b"CapPrm"], 16)
    if status[b"NoNewPrivs"].strip() != b"1" or status[b"Seccomp"].strip() != str(SECCOMP_FILTER).encode():
        raise OSError(errno.EPERM, "the process has no filter")
    if privileges & ~(1 << CAP_DAC_READ_SEARCH):
        raise OSError(errno.EPERM, "the process has privileges")
    if user and [{*status[b"Uid"].split()}, {*status[b"Gid"].split()}] != [{str(number).encode()} for number in user]:
        raise OSError(errno.EPERM, "the process is another user")


def make_memory_private() -> None:
    """Replace memory that this process shares with others by pages of its own, with the same content.

    A fork shares two pages with the process that has loaded LTTng. It could not write to them, but wake the threads
    that wait on them. The pages stay mapped, because the library unmaps them at exit, and keep their content, because
    the C library reads its table of character sets there: `setlocale` divides by a number in it.
    """
    system = ctypes.CDLL(None, use_errno=True)
    system.mmap.restype = ctypes.c_void_p
    with open("/proc/self/maps", "rb") as file:
        shared = SHARED_MEMORY.findall(file.read())
    for begin, end in ((int(first, 16), int(last, 16)) for first, last in shared):
        content, at, length = content_of(begin, end - begin), ctypes.c_void_p(begin), ctypes.c_size_t(end - begin)
        writable = PROT_READ | PROT_WRITE
        if system.mmap(at, length, writable, MAP_PRIVATE_FIXED_ANONYMOUS, -1, ctypes.c_long(0)) == MAP_FAILED:
            raise OSError(ctypes.get_errno(), "memory of its own")
        ctypes.memmove(begin, content, len(content))
        if system.mprotect(at, length, PROT_READ):
            raise OSError(ctypes.get_errno(), "memory of its own")


def content_of(begin: int, length: int) -> bytes:
    """Return what this process has in its memory, up to the first page that nothing is behind."""
    # Whoever reads a page behind the end of its file is ended by a signal; the kernel, asked by a file, says so.
    with open("/proc/self/mem", "rb", buffering=0) as file, contextlib.suppress(OSError):
        return os.pread(file.fileno(), length, begin)
    return b""


def enter_folder(request: dict[str, Any]) -> None:
    """Create the folder, if requested, and change to it."""
    folder = request["folder"]
    if not request["made"]:
        os.chdir(folder)
        return
    for part in dict.fromkeys(("", "home", "home/log", "work", request["into"])):
        os.mkdir(os.path.join(folder, part), mode=0o700)
        if request["user"]:
            os.chown(os.path.join(folder, part), *request["user"])
    clean_up_after_end(folder, request["scratch"])
    os.chdir(os.path.join(folder, request["into"]))
    for file in request["copied"]:
        copy(os.path.join(request["beside"], file), file, request["user"])
    os.chdir(os.path.join(folder, request["working"]))


def copy(source: str, file: str, user: list[int] | None) -> None:
    """Copy a file to a path below the working directory, for another user if one is given."""
    parts = file.split("/")
    for folder in ("/".join(parts[:number]) for number in range(1, len(parts))):
        with contextlib.suppress(FileExistsError):
            os.mkdir(folder, mode=0o700)
            if user:
                os.chown(folder, *user)
    shutil.copyfile(source, file, follow_symlinks=False)
    if user:
        os.chown(file, *user)


def limit(which: int, value: int, beyond: int = 0) -> None:
    """Lower a limit, unless it is already lower; the hard one is `beyond` above it."""
    _, most = resource.getrlimit(which)
    hard = value + beyond if most == resource.RLIM_INFINITY else min(value + beyond, most)
    resource.setrlimit(which, (min(value, hard), hard))


def running() -> int:
    """Return how many processes and threads this user has, which the kernel counts together.

    In a container the kernel also counts those that the same user has outside, and /proc does not show them: then it is
    asked.
    """
    count, (_, hard) = visible(), resource.getrlimit(resource.RLIMIT_NPROC)
    most = MOST_THREADS if hard == resource.RLIM_INFINITY else min(hard, MOST_THREADS)
    if count + SPARE >= most or may_start(count + SPARE):
        return count
    return bisect_left(range(most), x=True, lo=count + SPARE, key=may_start) - 1


def may_start(most_processes: int) -> bool:
    """Set the soft limit of processes, and return whether this process may start another one under it."""
    _, hard = resource.getrlimit(resource.RLIMIT_NPROC)
    resource.setrlimit(resource.RLIMIT_NPROC, (most_processes, hard))
    try:
        os.posix_spawn("", ["no program"], {})
    except BlockingIOError:
        return False
    except FileNotFoundError:  # the process was started, and then found no program
        return True
    raise OSError(errno.EINVAL, "a process without a program was started")


def visible() -> int:
    """Return how many processes and threads of this user /proc shows."""
    count, user = 0, os.getuid()
    for process in filter(str.isdigit, os.listdir("/proc")):
        with contextlib.suppress(OSError):
            if os.stat(f"/proc/{process}").st_uid == user:
                count += len(os.listdir(f"/proc/{process}/task"))
    return count


def clean_up_after_end(folder: str, scratch: int) -> None:
    """Start a small process that kills what this one has started and deletes the folder, however this one ends.

    It also kills this process when its parent ends, even if the program tries to prevent that, and when the folder
    exceeds its size, if that is not 0.
    """
    process = os.getpid()
    watched = [os.pidfd_open(process), os.pidfd_open(os.getppid())]
    told, ready = os.pipe()
    middle = os.fork()
    if not middle:
        with contextlib.suppress(BaseException):
            # It has its own session and another parent, so that killing the others does not prevent it from deleting
            # the folder.
            os.setsid()
            if not os.fork():
                watch_folder(process, watched, ready, folder, scratch)
        os._exit(1)
    os.waitpid(middle, 0)
    os.close(ready)
    begun = os.read(told, 1)
    for descriptor in (*watched, told):
        os.close(descriptor)
    if not begun:
        raise OSError(errno.ECHILD, "nothing watches the folder of the process")


def watch_folder(process: int, watched: list[int], ready: int, folder: str, scratch: int) -> None:
    """Write to `ready`, wait for the end of a process or of its parent, kill its group and delete its folder."""
    os.chdir("/")
    for number, descriptor in enumerate([fcntl.fcntl(d, fcntl.F_DUPFD_CLOEXEC, 3) for d in (*watched, ready)]):
        os.dup2(descriptor, number)
    os.closerange(3, os.sysconf("SC_OPEN_MAX"))
    os.write(2, b"1")
    os.close(2)
    while not select([0, 1], [], [], LOOK_S if scratch else None)[0]:
        if outgrown(folder, scratch):
            # The signal distinguishes this end from all others; a program gains nothing by catching it.
            with contextlib.suppress(OSError):
                os.kill(process, OUTGROWN)
            select([0, 1], [], [], LOOK_S)
            end_group(process)
    end_group(process)
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(0)


def end_group(leader: int) -> None:
    """Kill a process and everything in its group."""
    with contextlib.suppress(OSError):
        os.killpg(leader, signal.SIGKILL)


def outgrown(folder: str, size: int) -> bool:
    """Return whether the files in a folder exceed a size, or are too many to count."""
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


def become_user(system: Any, user: int, group: int, *, reach: bool) -> None:
    """Change to another user with a single group, without privileges.

    To `reach` is to keep the privilege to enter folders that are closed to the user; Landlock still restricts it.
    """
    limit_capabilities(system, CAP_DAC_READ_SEARCH if reach else None)
    if reach:
        checked(call(system.prctl, KEEP_CAPABILITIES, 1, 0, 0, 0), "capabilities")
    os.setgroups([])
    os.setresgid(group, group, group)
    os.setresuid(user, user, user)
    if reach:
        kept = 1 << CAP_DAC_READ_SEARCH
        header = struct.pack("=Ii", CAPABILITIES_VERSION_3, 0)
        checked(call(system.capset, header, struct.pack("=6I", kept, kept, kept, 0, 0, 0)), "capset")
        raised = call(system.prctl, AMBIENT, AMBIENT_RAISE, CAP_DAC_READ_SEARCH, 0, 0)
        checked(raised, "an ambient capability")


def limit_capabilities(system: Any, kept: int | None = None) -> None:
    """Forbid programs that are executed later every capability but one."""
    for capability in range(LAST_CAPABILITY + 1):
        if capability != kept and call(system.prctl, DROP_FROM_BOUNDING_SET, capability, 0, 0, 0) < 0:
            error = ctypes.get_errno()
            if error != errno.EINVAL:  # which says that the kernel does not know the capability
                raise OSError(error, f"capability {capability}: {os.strerror(error)}")


def drop_capabilities(system: Any) -> None:
    """Give up every capability, also for programs that are executed later."""
    limit_capabilities(system)
    checked(call(system.capset, struct.pack("=Ii", CAPABILITIES_VERSION_3, 0), bytes(24)), "capset")


def die_with(parent: int) -> None:
    """Make the kernel kill this process when its parent ends."""
    system = ctypes.CDLL(None, use_errno=True)
    checked(call(system.prctl, SET_PARENT_DEATH_SIGNAL, signal.SIGKILL, 0, 0, 0), "the end with the parent")
    if os.getppid() != parent:
        os._exit(1)


def enter(pid: int, parent: int) -> None:
    """Enter the namespaces of a process; the process namespace holds for children that are started from now on.

    Raises OSError if the process is no longer a child of the parent: its number may have been given to another one.
    """
    system = ctypes.CDLL(None, use_errno=True)
    process = os.pidfd_open(pid)
    with open(f"/proc/{pid}/stat", "rb", buffering=0) as file:
        if int(file.read().rpartition(b")")[2].split()[1]) != parent:
            raise OSError(errno.ESRCH, "the sandbox has ended")
    own, others = (os.stat(f"/proc/{who}/ns/user").st_ino for who in ("self", pid))
    kinds = NAMESPACES | (0 if own == others else USER_NAMESPACE)
    checked(call(system.setns, process, kinds), "namespaces")
    os.close(process)


def landlock_version(system: Any = None) -> int:
    """Return the Landlock version of this kernel; 0 if it has none or it is disabled."""
    system = system or ctypes.CDLL(None, use_errno=True)
    return max(0, call(system.syscall, CREATE_RULESET, None, 0, ASK_VERSION))


def ruleset(system: Any, confinement: dict[str, Any], folder: str) -> int:
    """Create the Landlock rules, with readable paths and the writable folder, and return their descriptor."""
    version = landlock_version(system)
    if version < 1:
        raise OSError("Landlock: expected version 1 or newer, found none")
    handled = KNOWN_RIGHTS[min(version, max(KNOWN_RIGHTS))]
    tcp = ALL_TCP if version >= 4 and not confinement["tcp"] else 0
    scopes = ALL_SCOPES if version >= 6 else 0
    attributes = struct.pack("=QQQ", handled, tcp, scopes)[: 24 if version >= 6 else 16 if version >= 4 else 8]
    rules = checked(call(system.syscall, CREATE_RULESET, attributes, len(attributes), 0), "Landlock")
    for path in (*confinement["read"], "/proc/self"):
        allow(system, rules, path, READ, tuple(confinement["hidden"]))
    for path in confinement["devices"]:
        allow(system, rules, path, (READ_FILE | WRITE_FILE), ())
    allow(system, rules, folder, handled & ~EXECUTE & ~MAKE_DEVICES, ())
    return int(rules)


def allow(system: Any, rules: int, path: str, rights: int, hidden: tuple[str, ...]) -> None:
    """Allow rights on a file, or on a folder and everything below it except the hidden folders."""
    if not os.path.exists(path) or path in hidden:
        return
    is_folder = os.path.isdir(path)
    if is_folder and any(place.startswith(path.rstrip("/") + "/") for place in hidden):
        # Rights extend to everything below; file names are not secret.
        add_rule(system, rules, path, rights & READ_DIR)
        with os.scandir(path) as found:
            for entry in found:
                if not entry.is_symlink():
                    allow(system, rules, entry.path, rights, hidden)
        return
    add_rule(system, rules, path, rights if is_folder else rights & ON_FILES)


def add_rule(system: Any, rules: int, path: str, rights: int) -> None:
    """Add one rule; links in the path are followed."""
    place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    try:
        rule = struct.pack("=Qi", rights, place)
        checked(call(system.syscall, ADD_RULE, rules, PATH_BENEATH, rule, 0), f"Landlock on {path}")
    finally:
        os.close(place)


def restrict(system: Any, rules: int | None, program: bytes) -> None:
    """Apply the Landlock rules, if any, and the seccomp filter to this process, irrevocably."""
    checked(call(system.prctl, NO_NEW_PRIVILEGES, 1, 0, 0, 0), "no new privileges")
    if rules is not None:
        checked(call(system.syscall, RESTRICT_SELF, rules, 0), "Landlock")
        os.close(rules)
    load_filter(system, program)


def load_filter(system: Any, program: bytes) -> None:
    """Load a seccomp program, with its placeholder for the pid replaced by that of this process."""
    words = list(struct.iter_unpack("=HBBI", program))
    own = os.getpid()
    given = {OWN_PROCESS: own, -OWN_PROCESS & 0xFFFFFFFF: -own & 0xFFFFFFFF}
    filled = b"".join(struct.pack("=HBBI", *word[:3], given.get(word[3], word[3])) for word in words)
    code = ctypes.create_string_buffer(filled, len(filled))
    described = struct.pack("@HP", len(words), ctypes.addressof(code))
    checked(call(system.prctl, SET_SECCOMP, SECCOMP_FILTER, described, 0, 0), "seccomp")


def call(function: Any, *arguments: int | bytes | None) -> int:
    """Call the C library with register-sized integers, as variadic functions require."""
    return int(function(*(ctypes.c_long(value) if isinstance(value, int) else value for value in arguments)))


def checked(result: int, what: str) -> int:
    """Return the result of a call, or raise its errno as OSError."""
    if result < 0:
        error = ctypes.get_errno()
        raise OSError(error, f"{what}: {os.strerror(error)}")
    return result


if __name__ == "__main__":
    main(sys.argv[1:])
