"""The tiers with nested bubblewrap: a private network for the worker, a private view of files for each student."""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import ClassVar

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.model.limits import Limits
from grader.runtime.sandbox import seccomp
from grader.runtime.sandbox.environment import PACKAGE, account_files, student_environment
from grader.runtime.sandbox.exposure import (
    STUDENT_GROUP,
    View,
    make_readable,
    parents_of,
    secrets_within,
    some_user,
    taken_users,
    view_of,
)
from grader.runtime.sandbox.properties import package_command
from grader.runtime.sandbox.protocol import (
    INSTALLED,
    Command,
    Placeholder,
    PreparedSandbox,
    StudentProcess,
    WorkerView,
    by_resource,
    start_request,
)

ROOT_NAME, USER_NAME = "bubblewrap-root", "bubblewrap"
SUBMISSION = Path("/submission")
HOST = Path("/grader_host/host")
#: The capabilities that setpriv needs to change the user; it drops them in the process.
TO_CHANGE_USER = ("CAP_SETUID", "CAP_SETGID", "CAP_SETPCAP")
#: Where the placeholder is in a sandbox; under its own name, because some systems have one program for many names.
PLACEHOLDER = Path("/grader_host/cat")
#: The first kernel with setns(2) for all namespaces of a process.
ENTERABLE = (5, 8)
HOME, WORK = Path("/tmp/home"), Path("/tmp/work")  # noqa: S108 -- a private tmpfs
SYSTEM_PROGRAMS = "/usr/bin:/bin:/usr/sbin:/sbin:/usr/local/bin"


@dataclass(frozen=True, slots=True)
class Bubblewrap:
    """The tiers `bubblewrap-root` and `bubblewrap`: bubblewrap, seccomp and resource limits."""

    shares_network: ClassVar[bool] = False
    submission_seen_at: ClassVar[str] = str(SUBMISSION)
    host_seen_at: ClassVar[str] = str(HOST)
    bwrap: Path
    prlimit: Path  # the program of util-linux that sets resource limits
    setpriv: Path  # the program of util-linux that changes the user; used only as root
    cat: Path  # the program of coreutils that is the placeholder in a sandbox
    can_fork: bool  # whether a process can enter all namespaces of another at once (Linux 5.8)
    as_root: bool  # whether this process is root; students then run as another user instead of in a user namespace
    can_forbid_userns: bool  # whether bubblewrap has `--disable-userns` (0.8 and newer); seccomp forbids them anyway

    @classmethod
    def here(cls) -> Bubblewrap:
        """Return the tier for this machine and user, without testing whether it works.

        Raises EnvironmentFault if a program is missing or this processor is unknown; the hint is a fix.
        """
        if not seccomp.supports(platform.machine()):
            raise EnvironmentFault(f"sandbox: expected x86_64 or aarch64, found {platform.machine()}")
        bwrap = _program("bwrap", package_command("bubblewrap"))
        told = subprocess.run([bwrap, "--help"], capture_output=True, check=False, env={})
        return cls(
            bwrap=bwrap,
            prlimit=_program("prlimit", package_command("util-linux")),
            setpriv=_program("setpriv", package_command("util-linux")),
            cat=_program("cat", package_command("coreutils")),
            can_fork=_kernel() >= ENTERABLE,
            as_root=os.geteuid() == 0,
            can_forbid_userns=b"--disable-userns" in told.stdout + told.stderr,
        )

    def submission_of(self, process: StudentProcess) -> str:
        """Return where a process sees its submission; see `Isolation.submission_of`."""
        del process
        return self.submission_seen_at

    @property
    def name(self) -> str:
        """Short name that reports show."""
        return ROOT_NAME if self.as_root else USER_NAME

    def worker_command(
        self,
        argv: Sequence[str],
        environment: Mapping[str, str],
        pass_fds: tuple[int, ...],
        view: WorkerView | None = None,
    ) -> Command:
        """Return the command that starts the trusted worker.

        The worker has a private network with only `lo`, a private process namespace and a private /dev/shm, which all
        disappear with it. It is killed when the caller dies.
        """
        # In the tier `bubblewrap-flat` students' processes see them too.
        accounts, opened = ([], []) if view is None else _account_files(os.getuid(), os.getgid())
        options = [
            *("--die-with-parent", "--new-session", "--unshare-net", "--unshare-pid", "--unshare-ipc"),
            *(() if self.as_root else ("--unshare-user",)),
            *(("--dev-bind", "/", "/", "--proc", "/proc") if view is None else self._workers_files(view)),
            *("--perms", "1777", "--tmpfs", "/dev/shm", "--chdir", "/"),  # noqa: S108
            *accounts,
            *(() if view is None else ("--remount-ro", "/")),
        ]
        return Command((str(self.bwrap), *options, "--", *argv), dict(environment), (*pass_fds, *opened), tuple(opened))

    def _workers_files(self, view: WorkerView) -> list[str]:
        """Return the options that make visible what a worker needs, including the programs that start students."""
        shared = taken_users() if self.as_root else ()
        read = view_of((*view.read, self.bwrap, self.prlimit, self.setpriv, self.cat))
        own = view_of(view.own)
        options = ["--proc", "/proc", "--dev", "/dev", "--perms", "1777", "--tmpfs", "/tmp"]  # noqa: S108
        for folder in parents_of((*read.bound, *(where for where, _ in read.links), *view.write, *shared)):
            options += ["--perms", "0755", "--dir", str(folder)]
        for path in read.bound:
            options += ["--ro-bind", str(path), str(path)]
        for where, target in read.links:
            options += ["--symlink", target, str(where)]
        for folder in view.hidden:
            options += ["--perms", "0755", "--tmpfs", str(folder)]
        for folder in parents_of(own.bound):
            # A parent folder that bubblewrap creates itself could not be entered by a student's other user.
            if not any(folder.is_relative_to(path) for path in read.bound):
                options += ["--perms", "0755", "--dir", str(folder)]
        for path in own.bound:
            options += ["--ro-bind", str(path), str(path)]
        for folder in view.hidden:
            options += ["--remount-ro", str(folder)]
        for path in (*view.write, *shared):
            options += ["--bind", str(path), str(path)]
        # Processes that are forked in the worker have loaded the host from where students' processes see it.
        return [
            *options,
            "--perms",
            "0755",
            "--dir",
            str(HOST.parent),
            "--ro-bind",
            str(PACKAGE / "runtime" / "host"),
            str(HOST),
        ]

    def student_command(self, process: StudentProcess, limits: Limits) -> Command:
        """Return the command that starts a student's process, from inside the worker.

        Options are passed through a descriptor, and bubblewrap starts without an environment, because a student could
        read both in /proc/1. As root, the staged copy is made readable for everyone, because the student is another
        user.
        """
        if self.as_root:
            make_readable(process.submission)
        environment = student_environment(process, HOME)
        filter_fd = _memory_file("filter", seccomp.student_filter())
        user = self._user()
        copies, copied_fds = _copies(process)
        accounts, account_fds = _account_files(*user)
        options = [
            *self._namespaces(TO_CHANGE_USER),
            *("--clearenv", "--chdir", str(_working(process)), "--seccomp", str(filter_fd)),
            *(word for setting in environment.items() for word in ("--setenv", *setting)),
            *self._files(process, limits, (*copies, *accounts)),
        ]
        options_fd = _memory_file("options", b"".join(os.fsencode(option) + b"\0" for option in options))
        argv = (str(self.bwrap), "--args", str(options_fd), "--", *self._entry(limits, user))
        argv += (str(process.runtime.executable), *process.arguments)
        opened = (filter_fd, options_fd, *copied_fds, *account_fds)
        return Command(argv, {}, (*process.pass_fds, *opened), opened)

    def prepared_sandbox(self, process: StudentProcess, limits: Limits) -> PreparedSandbox:
        """Return the sandbox that `student_command` builds, for a process that is forked into it."""
        if self.as_root:
            make_readable(process.submission)
        status_read, status_write = os.pipe()
        user = self._user()
        copies, copied_fds = _copies(process)
        accounts, account_fds = _account_files(*user)
        options = [
            *self._namespaces(()),
            *("--clearenv", "--as-pid-1", "--json-status-fd", str(status_write), "--seccomp"),
            str(filter_fd := _memory_file("filter", seccomp.student_filter())),
            *self._files(process, limits, (*copies, *accounts, "--ro-bind", str(self.cat), str(PLACEHOLDER))),
        ]
        options_fd = _memory_file("options", b"".join(os.fsencode(option) + b"\0" for option in options))
        opened = (filter_fd, options_fd, status_write, *copied_fds, *account_fds)
        argv = (str(self.bwrap), "--args", str(options_fd), "--", str(PLACEHOLDER))
        own = {"RLIMIT_NPROC": limits.processes, "RLIMIT_CPU": [limits.processor_s, 1]}
        restrictions = start_request(
            str(_working(process)),
            limits={**by_resource(limits), **own},
            user=list(user) if self.as_root else None,
            filter=seccomp.student_filter().hex(),
        )
        environment = {**student_environment(process, HOME), "PWD": str(_working(process))}  # bubblewrap sets it
        placeholder = Placeholder(Command(argv, {}, opened, opened), status_read)
        return PreparedSandbox(restrictions, environment, placeholder)

    def _namespaces(self, kept: Sequence[str]) -> list[str]:
        shared = ["--die-with-parent", "--new-session", "--unshare-pid", "--unshare-ipc", "--unshare-uts"]
        shared += ["--unshare-cgroup-try", "--hostname", "student", "--cap-drop", "ALL"]
        if self.as_root:
            return [*shared, *(word for capability in kept for word in ("--cap-add", capability))]
        return [*shared, "--unshare-user", *(("--disable-userns",) if self.can_forbid_userns else ())]

    def _user(self) -> tuple[int, int]:
        """Return user and group of a student's process."""
        return (some_user(), STUDENT_GROUP) if self.as_root else (os.getuid(), os.getgid())

    def _entry(self, limits: Limits, user: tuple[int, int]) -> list[str]:
        """Return the commands that set limits and, as root, change the user before Python starts.

        Limits come first: the number of processes must be limited inside the user namespace, where the kernel counts
        them.
        """
        seconds = limits.processor_s
        values = {**by_resource(limits), "RLIMIT_NPROC": limits.processes, "RLIMIT_CPU": f"{seconds}:{seconds + 1}"}
        entry = [str(self.prlimit)]
        entry += [f"--{name.removeprefix('RLIMIT_').lower()}={value}" for name, value in values.items()]
        if not self.as_root:
            return entry
        privileges = ["--clear-groups", "--bounding-set=-all", "--inh-caps=-all", "--no-new-privs"]
        return [*entry, str(self.setpriv), f"--reuid={user[0]}", f"--regid={user[1]}", *privileges]

    def _files(self, process: StudentProcess, limits: Limits, more: Sequence[str] = ()) -> list[str]:
        runtime = process.runtime
        view, hidden = _view(
            (*runtime.read_paths, runtime.executable, self.prlimit, self.setpriv), runtime.python_paths
        )
        size = str(limits.scratch_bytes)
        # Process 1 is bubblewrap, without the seccomp filter, or the placeholder: its memory must not be accessible.
        first = "/proc/1"
        options = ["--proc", "/proc", "--size", "4096", "--perms", "0555", "--tmpfs", first, "--remount-ro", first]
        # The terminals of all students would be counted with those of the machine.
        options += ["--dev", "/dev", "--size", "4096", "--perms", "0555", "--tmpfs", "/dev/pts"]
        options += ["--remount-ro", "/dev/pts"]
        # Scratch folders first: a mount on /tmp would hide anything that was bound below it before.
        for scratch in ("/dev/shm", "/tmp"):  # noqa: S108
            options += ["--perms", "1777", "--size", size, "--tmpfs", scratch]
        installed = (HOME / INSTALLED,) if process.installed else ()
        for folder in (HOME, HOME / "log", WORK, *installed):
            options += ["--perms", "0777", "--dir", str(folder)]
        # A folder with the shared files: whoever goes up from it is still in the process's own folders.
        if process.installed:
            options += ["--symlink", str(process.installed / "share"), str(HOME / INSTALLED / "share")]
        host_at = process.host_at or HOST
        needed = (host_at, *(() if process.host_at else (PLACEHOLDER,))) if process.host_folder else ()
        for folder in (*view.parents(), *parents_of(needed)):
            # If Python is installed below /tmp, these are in the scratch folder and belong to the student's user.
            options += ["--perms", "0555", "--dir", str(folder)]
        for path in view.bound:
            options += ["--ro-bind", str(path), str(path)]
        for where, target in view.links:
            options += ["--symlink", target, str(where)]
        for folder in hidden:
            options += ["--size", "4096", "--tmpfs", str(folder), "--remount-ro", str(folder)]
        if process.writable:
            options += ["--perms", "0777", "--size", size, "--tmpfs", str(SUBMISSION)]
        else:
            options += ["--ro-bind", str(process.submission), str(SUBMISSION)]
        options += ["--ro-bind", str(process.host_folder), str(host_at)] if process.host_folder else []
        options += more
        # bubblewrap's /dev is a tmpfs without a size limit, which its owner could fill.
        return [*options, "--remount-ro", "/dev", "--remount-ro", "/"]


@lru_cache(maxsize=8)
def _view(paths: tuple[Path, ...], python_paths: tuple[Path, ...]) -> tuple[View, tuple[Path, ...]]:
    """Return what a student's process sees of the machine, and the folders in it that hold secrets.

    It is the same for all processes of a submission, and takes longer to find out than to build the sandbox.
    """
    view = view_of(paths)
    return view, tuple(secrets_within(view.bound, python_paths))


def _copies(process: StudentProcess) -> tuple[list[str], list[int]]:
    """Return the options that copy the files that a process may write to, and the descriptors that they name."""
    place = SUBMISSION if process.writable else WORK
    options: list[str] = []
    opened: list[int] = []
    for folder in sorted(
        {parent for file in process.copied for parent in PurePosixPath(file).parents} - {PurePosixPath()}
    ):
        options += ["--perms", "0777", "--dir", str(place / folder)]
    for file in process.copied:
        opened.append(os.open(process.beside / file, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC))
        options += ["--perms", "0666", "--file", str(opened[-1]), str(place / file)]
    return options, opened


def _working(process: StudentProcess) -> Path:
    """Return the working directory of a process, as it sees it."""
    return WORK if process.working is None else SUBMISSION / process.working


def _account_files(user: int, group: int, home: Path = HOME) -> tuple[list[str], list[int]]:
    """Return the options that create the files about users and hosts, and the descriptors that they name."""
    options: list[str] = []
    opened: list[int] = []
    for name, content in account_files(user, group, home).items():
        opened.append(_memory_file(name, content))
        options += ["--perms", "0444", "--file", str(opened[-1]), f"/etc/{name}"]
    return options, opened


def _kernel() -> tuple[int, ...]:
    return tuple(int(number) for number in re.findall(r"\d+", platform.release())[:2])


def has_bubblewrap() -> bool:
    """Return whether this machine has the program bubblewrap."""
    return _found("bwrap") is not None


def _found(name: str) -> str | None:
    return shutil.which(name, path=SYSTEM_PROGRAMS) or shutil.which(name)


def _program(name: str, hint: str) -> Path:
    found = _found(name)
    if found is None:
        raise EnvironmentFault(f"sandbox: expected the program {name}, found none", hint)
    return Path(found).absolute()


def _memory_file(name: str, content: bytes) -> int:
    descriptor = os.memfd_create(name)
    with open(descriptor, "wb", closefd=False) as file:
        file.write(content)
    os.lseek(descriptor, 0, os.SEEK_SET)
    return descriptor
