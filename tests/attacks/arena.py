"""Where attacks take place: secrets, listeners and a bystander around a real `grade`, and a look at them afterwards."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import json
import os
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from places import GRADE, ROOT
from process_table import segments_in_use

#: The user that stands for an ordinary one where the attacks are tried by root.
USER = 1000
#: Tiers in which the grader itself is an ordinary user.
UNPRIVILEGED = ("bubblewrap",)
#: Tiers that are meant for machines without a network, and what makes this machine one for a command.
WITHOUT_NETWORK = ("landlock",)
NO_NETWORK = ("bwrap", "--dev-bind", "/", "/", "--unshare-net", "--die-with-parent", "--")
#: Real seconds that one run of the grader may take before it counts as hanging.
RUN_S = 240.0
GROUP = "239.255.77.77"
_BECOME_SUBREAPER = 36


@dataclass(frozen=True)
class Ran:
    """What one run of `grade` came to; `report` is empty if it made none, `texts` holds everything that it wrote."""

    code: int
    report: Mapping[str, Any]
    out: str
    err: str
    texts: Mapping[str, bytes]


@dataclass(frozen=True)
class Finding:
    """Something that an attack achieved; `number` names the attack if only one could have done it."""

    text: str
    number: int | None = None


class Arena:
    """A place with things to steal, to disturb and to reach, for one tier of isolation.

    Args:
        tier: Name of the tier in which students' code is run.
    """

    _tcp: socket.socket
    _udp: socket.socket
    _multicast: socket.socket
    _abstract: socket.socket
    _unix: socket.socket

    def __init__(self, tier: str) -> None:
        self.tier = tier
        self.patience_s = 60.0  # how long processes may take to be ended, on a busy machine
        self.secret = f"canary-{secrets.token_hex(16)}"
        self.mark = f"mark-{secrets.token_hex(8)}"
        self._stack = contextlib.ExitStack()

    def __enter__(self) -> Arena:
        with contextlib.ExitStack() as stack:
            self.base = Path(tempfile.mkdtemp(prefix="arena-"))
            stack.callback(shutil.rmtree, self.base, ignore_errors=True)
            self.base.chmod(0o755)
            self._adopt_orphans(stack)
            self._plant()
            self._listen(stack)
            self._as_user = user_prefix() if self.tier in UNPRIVILEGED and os.geteuid() == 0 else ()
            self._inside = (*(NO_NETWORK if self.tier in WITHOUT_NETWORK else ()), *self._as_user)
            self._bystander = stack.enter_context(self._start_bystander())
            self._before = self._state_of_bystander()
            self._shm = _names("/dev/shm")
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def folder(self, name: str) -> Path:
        """Return a new folder for a submission, beside that of another student."""
        folder = self.base / "students" / name
        folder.mkdir()
        return folder

    def planted(self) -> str:
        """Return the module from which attacks learn where to look and where to send; the secret is not in it."""
        addresses = ["127.0.0.1", *_own_addresses()]
        ours = [ROOT / "reference_solutions" / "velocity_publisher.py", ROOT / "rubrics" / "exercise_1" / "rubric.yaml"]
        hidden = [self._hidden, *ours, self.base / "rubric.yaml", "/etc/resolv.conf", "/etc/shadow"]
        values = {
            "HIDDEN": [str(path) for path in hidden],
            "SIBLING": str(self.base / "students" / "sibling" / "velocity_publisher.py"),
            "EARLIER": str(self.base / "earlier.json"),
            "OUTSIDE": str(self.outside),
            "REPORT": str(self.base / "out" / "report.json"),
            "MARK": self.mark,
            "TCP": [(address, self._tcp.getsockname()[1]) for address in addresses],
            "UDP": [(address, self._udp.getsockname()[1]) for address in addresses],
            "MULTICAST": (GROUP, self._multicast.getsockname()[1]),
            "ABSTRACT": self.mark,
            "UNIX": str(self.base / "socket"),
            "BYSTANDER": self.bystander_pid,
            "SECRET_TO_SEND": self.mark.encode(),
        }
        lines = [f"{name} = {value!r}" for name, value in values.items()]
        return '"""Where to look and where to send."""\n\n' + "\n".join(lines) + "\n"

    def grade(
        self, submission: str | Path, *options: str, cwd: Path | None = None, more: Mapping[str, str] | None = None
    ) -> Ran:
        """Run the real command on a submission, as somebody would who has a token and an open file.

        Args:
            submission: What is graded.
            options: Further options.
            cwd: Where the command is started; the machine's root if not given.
            more: Further variables of its environment.
        """
        out = self.base / "out"
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir()
        self._give_away(self.base)
        outputs = [f"json={out}/report.json", f"text={out}/report.txt", f"evidence={out}/evidence"]
        arguments = [GRADE, str(submission), "--isolation", self.tier, *options]
        arguments += [word for output in outputs for word in ("-o", output)]
        environment = {
            "PATH": os.environ.get("PATH", "/usr/bin:/bin"),
            "HOME": str(self.base / "home"),
            "TMPDIR": str(self.base / "tmp"),
            "XDG_RUNTIME_DIR": str(self.base / "runtime"),
            "XDG_CACHE_HOME": str(self.base / "runtime"),  # the grader keeps message packages there
            "LANG": "C.UTF-8",
            "GITHUB_TOKEN": self.secret,
            "PYTHONDONTWRITEBYTECODE": "1",
            **(more or {}),
        }
        with self._hidden.open("rb") as open_file:
            os.set_inheritable(open_file.fileno(), True)
            done = _finished([*self._inside, *arguments], environment, (open_file.fileno(),), cwd or Path("/"))
        return Ran(done.returncode, _report(out / "report.json"), done.stdout, done.stderr, _contents(out))

    def findings(self, *runs: Ran) -> Iterator[Finding]:
        """Look at everything around the runs, and yield what is not as it was before."""
        yield from self._leaks(runs)
        yield from self._arrivals()
        yield from self._leftovers()
        if self._state_of_bystander() != self._before:
            yield Finding("a process of the instructor's was changed", 55)

    def _leaks(self, runs: Sequence[Ran]) -> Iterator[Finding]:
        for ran in runs:
            texts = {**ran.texts, "standard output": ran.out.encode(), "standard error": ran.err.encode()}
            for where, content in texts.items():
                if self.secret.encode() in content:
                    yield Finding(f"the secret is in {where}")
                if str(self.base / "tmp").encode() in content:
                    yield Finding(f"the place of the staged copy is in {where}")
        if self._hidden.read_text(encoding="utf-8") != self.secret:
            yield Finding("the secret was changed")

    def _arrivals(self) -> Iterator[Finding]:
        for listener, number in ((self._tcp, 64), (self._abstract, 63), (self._unix, 63)):
            with contextlib.suppress(BlockingIOError):
                listener.accept()[0].close()
                yield Finding("a connection arrived", number)
        for receiver, number in ((self._udp, 64), (self._multicast, 43)):
            with contextlib.suppress(BlockingIOError):
                receiver.recv(1000)
                yield Finding("a packet arrived", number)

    def _leftovers(self) -> Iterator[Finding]:
        for name in sorted(_names(self.outside)):
            digits = "".join(filter(str.isdigit, name))
            yield Finding(f"{name} was written outside", int(digits) if digits else None)
        left = sorted(
            name
            for name in _names("/dev/shm") - self._shm - segments_in_use()
            if name.startswith((self.mark, "fastrtps_port7411"))
        )
        if left:
            yield Finding(f"shared memory was left: {', '.join(left)}", 41)
        for place in (self.base / "tmp", self.base / "home"):
            if names := sorted(_names(place)):
                yield Finding(f"{place.name} holds {', '.join(names[:5])}")
        if cores := [
            name for name in (*_names("/"), *_names(Path.cwd())) if name == "core" or name.startswith("core.")
        ]:
            yield Finding(f"a core dump was left: {cores[0]}", 10)
        if processes := self.processes_left():
            yield Finding(f"processes were left: {', '.join(processes[:5])}", None)

    def processes_left(self) -> list[str]:
        """Return the command lines of processes that nobody waits for any more; they get a moment to be ended."""
        deadline = time.monotonic() + self.patience_s
        while processes := self._orphans():
            if time.monotonic() > deadline:
                for pid in processes:
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(pid, signal.SIGKILL)
                return list(processes.values())
            time.sleep(0.02)
        return []

    def _orphans(self) -> dict[int, str]:
        """Return what descends from the runs: it has become a child of this process, or carries the mark.

        What this process has started itself is none: other tests have workers, which are replaced at any moment.
        """
        found = {}
        started = {each.pid for each in gc.get_objects() if isinstance(each, subprocess.Popen)}
        for path in Path("/proc").glob("[0-9]*"):
            try:
                line = (path / "cmdline").read_bytes()
                parent = int((path / "stat").read_text().rpartition(")")[2].split()[1])
                state = (path / "stat").read_text().rpartition(")")[2].split()[0]
            except OSError:
                continue
            pid = int(path.name)
            if state == "Z" and parent == os.getpid() and pid not in self._mine | started:
                with contextlib.suppress(ChildProcessError):
                    os.waitpid(pid, os.WNOHANG)
            elif (parent == os.getpid() and pid not in self._mine | started) or self.mark.encode() in line:
                found[pid] = line.replace(b"\0", b" ").decode("utf-8", "replace")[:80]
        return found

    def _adopt_orphans(self, stack: contextlib.ExitStack) -> None:
        """Have processes whose parents are gone become children of this one, so that they can be seen."""
        libc = ctypes.CDLL(None)
        self._mine = {int(name) for name in _children()}
        libc.prctl(_BECOME_SUBREAPER, 1, 0, 0, 0)
        stack.callback(libc.prctl, _BECOME_SUBREAPER, 0, 0, 0, 0)

    def _plant(self) -> None:
        for name in ("instructor", "students/sibling", "outside", "tmp", "home", "runtime"):
            (self.base / name).mkdir(parents=True)
        self.outside = self.base / "outside"
        self.outside.chmod(0o777)
        self._hidden = self.base / "instructor" / "canary.txt"
        self._hidden.write_text(self.secret, encoding="utf-8")
        (self.base / "students" / "sibling" / "velocity_publisher.py").write_text(
            f"# {self.secret}\n", encoding="utf-8"
        )
        (self.base / "earlier.json").write_text(json.dumps({"token": self.secret}), encoding="utf-8")

    def _listen(self, stack: contextlib.ExitStack) -> None:
        kinds: dict[str, tuple[int, int, str | tuple[str, int]]] = {
            "_tcp": (socket.AF_INET, socket.SOCK_STREAM, ("0.0.0.0", 0)),
            "_udp": (socket.AF_INET, socket.SOCK_DGRAM, ("0.0.0.0", 0)),
            "_multicast": (socket.AF_INET, socket.SOCK_DGRAM, ("0.0.0.0", 0)),
            "_abstract": (socket.AF_UNIX, socket.SOCK_STREAM, "\0" + self.mark),
            "_unix": (socket.AF_UNIX, socket.SOCK_STREAM, str(self.base / "socket")),
        }
        for name, (family, kind, address) in kinds.items():
            listener = stack.enter_context(socket.socket(family, kind))
            listener.bind(address)
            listener.setblocking(False)
            if kind == socket.SOCK_STREAM:
                listener.listen()
            setattr(self, name, listener)
        for address in _own_addresses():
            membership = socket.inet_aton(GROUP) + socket.inet_aton(address)
            self._multicast.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        (self.base / "socket").chmod(0o777)

    @contextlib.contextmanager
    def _start_bystander(self) -> Iterator[subprocess.Popen[bytes]]:
        """Start a process of the same user as the grader, that no student may touch."""
        command = [
            *self._as_user,
            sys.executable,
            "-I",
            "-S",
            "-c",
            "import os, time; print(os.getpid(), flush=True); time.sleep(3600)",
        ]
        with subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True) as process:
            assert process.stdout is not None
            self.bystander_pid = int(process.stdout.readline())
            self._mine |= {process.pid, self.bystander_pid}
            try:
                yield process
            finally:
                # A program around it ends without it: who has changed the user does not die with its parent.
                with contextlib.suppress(ProcessLookupError):
                    os.kill(self.bystander_pid, signal.SIGKILL)
                process.kill()

    def _state_of_bystander(self) -> object:
        pid = self.bystander_pid
        try:
            stopped = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "TtZ"
            limits = Path(f"/proc/{pid}/limits").read_text()
            return (stopped, limits, os.getpriority(os.PRIO_PROCESS, pid), sorted(os.sched_getaffinity(pid)))
        except OSError:
            return "gone"

    def _give_away(self, folder: Path) -> None:
        """Let the ordinary user own what an ordinary user would own, if there is one."""
        if self._as_user:
            for path in (folder, *folder.rglob("*")):
                os.chown(path, USER, USER, follow_symlinks=False)


def user_prefix() -> tuple[str, ...]:
    """Return the command words that start a program as an ordinary user who can reach Python and the project.

    What lies in a folder that only root may enter is shown in a view of the files that has that folder opened; the
    machine's own files stay as they are.
    """
    needed = [Path(sys.base_prefix), Path(sys.prefix), ROOT]
    closed = {folder for path in needed for folder in path.parents if not folder.stat().st_mode & 0o001}
    view: list[str] = []
    for folder in sorted(closed):
        if closed.isdisjoint(folder.parents):
            view += ["--perms", "0755", "--tmpfs", str(folder)]
            inside = [path for path in needed if folder in path.parents]
            between = {parent for path in inside for parent in path.parents if folder in parent.parents}
            view += [word for parent in sorted(between) for word in ("--perms", "0755", "--dir", str(parent))]
            view += [word for path in inside for word in ("--bind", str(path), str(path))]
    setpriv = ("setpriv", f"--reuid={USER}", f"--regid={USER}", "--clear-groups", "env")
    return ("bwrap", "--dev-bind", "/", "/", *view, "--die-with-parent", "--", *setpriv) if view else setpriv


def _finished(
    command: Sequence[str], environment: Mapping[str, str], pass_fds: tuple[int, ...], cwd: Path
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command,
        env=dict(environment),
        pass_fds=pass_fds,
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        errors="backslashreplace",
        timeout=RUN_S,
        check=False,
    )


def _report(path: Path) -> Mapping[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def _names(folder: str | Path) -> set[str]:
    with contextlib.suppress(OSError):
        return {path.name for path in Path(folder).iterdir()}
    return set()


def _children() -> list[str]:
    return Path(f"/proc/self/task/{os.getpid()}/children").read_text(encoding="ascii").split()


def _own_addresses() -> list[str]:
    """Return the address that this machine would send from, if it has a network."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there:
        try:
            there.connect(("192.0.2.1", 9))
        except OSError:
            return []
        return [there.getsockname()[0]]
