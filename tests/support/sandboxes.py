"""Runs small programs inside the tiers of isolation, as the recording does: a worker, and a student inside it."""

from __future__ import annotations

import contextlib
import functools
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

import grader
from grader.runtime.domains import SharedDomains
from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.model.limits import Limits
from grader.runtime.recording.codec import to_json
from grader.runtime.ros_installation import RosInstallation
from grader.runtime.sandbox.bubblewrap import Bubblewrap
from grader.runtime.sandbox.environment import runtime_environment, worker_environment
from grader.runtime.sandbox.exposure import closed_folders, view_of, worker_view
from grader.runtime.sandbox.protocol import Command, Isolation, StudentProcess
from grader.runtime.sandbox.tiers import FlatBubblewrap, Landlock, isolation_from_name

HOST = Path(grader.__file__).resolve().parent / "runtime" / "host"
USER = 1000
#: Not every tier has a network of its own: neither tests that run side by side nor graders may use the same domain. It
#: is reserved until this process ends.
_DOMAINS = SharedDomains()
DOMAIN = str(_DOMAINS.take())

# The worker of these tests: starts the student's command that the test prepared, and ends as it ends.
RELAY = """
import json, subprocess, sys
command = json.loads(sys.argv[1])
student = subprocess.run(command["argv"], env=command["environment"], pass_fds=command["pass_fds"])
sys.exit(student.returncode)
"""


# Another one, which has the student's process forked.
FORKING_RELAY = """
import json, shutil, socket, sys, threading
from grader.runtime.recording.codec import from_json
from grader.runtime.ros_installation import PythonRuntime
from grader.runtime.sandbox.protocol import PreparedSandbox
from grader.runtime.sandbox.starter import Starter
told = json.loads(sys.argv[1])
starter = Starter("", from_json(PythonRuntime, told["runtime"]), told["host"])
ours, theirs = socket.socketpair()
sandbox = PreparedSandbox(told["restrictions"], told["environment"])
student = starter.start(sandbox, {}, tuple(told["command"]), theirs)
streams = (student.stdout, sys.stdout.buffer.raw), (student.stderr, sys.stderr.buffer.raw)
copying = [threading.Thread(target=shutil.copyfileobj, args=(*pair, 1)) for pair in streams]
for thread in copying:
    thread.start()
code = student.wait()
for thread in copying:
    thread.join()
student.close()
starter.close()
sys.exit(code)
"""


@dataclass(frozen=True)
class Sandbox:
    """A tier, with what starts its worker as another user where the tests run as root.

    Students' processes are executed, or if `forks`, which needs a tier without namespaces around them, forked.
    """

    isolation: Isolation
    ros: RosInstallation
    submission: Path
    start_as: tuple[str, ...] = ()
    forks: bool = False

    @property
    def is_ordinary(self) -> bool:
        """Whether its worker runs as an ordinary user, whose other programs count against the same limits."""
        return bool(self.start_as) or os.getuid() != 0

    def student(
        self,
        code: str,
        *,
        limits: Limits | None = None,
        pass_fds: tuple[int, ...] = (),
        copied: tuple[str, ...] = (),
        **variables: str,
    ) -> Command:
        """Return the command of a student's process that runs some code."""
        process = StudentProcess(
            runtime=self.ros.runtime,
            host_folder=HOST,
            submission=self.submission,
            arguments=("-s", "-u", "-c", code),
            environment={"ROS_DOMAIN_ID": DOMAIN, **variables},
            pass_fds=pass_fds,
            beside=self.submission,
            copied=copied,
        )
        if not self.forks:
            return self.isolation.student_command(process, limits or Limits())
        sandbox = self.isolation.prepared_sandbox(process, limits or Limits())
        told = {
            "runtime": to_json(self.ros.runtime),
            "host": self.isolation.host_seen_at,
            "restrictions": dict(sandbox.restrictions),
            "environment": dict(sandbox.environment),
            "command": (str(self.ros.runtime.executable), *process.arguments),
        }
        environment = worker_environment(self.ros.runtime, Path("/tmp"))
        return Command((sys.executable, "-s", "-B", "-c", FORKING_RELAY, json.dumps(told)), environment, ())

    def around(self, student: Command, **variables: str) -> Command:
        """Return the command of a worker that runs a student's command and ends as that ends."""
        if self.forks:  # it is that of a worker already
            return self.worker(student.argv, pass_fds=(), **{**student.environment, **variables})
        told = {"argv": student.argv, "environment": dict(student.environment), "pass_fds": student.pass_fds}
        argv = (sys.executable, "-I", "-S", "-c", RELAY, json.dumps(told))
        return self.worker(argv, pass_fds=student.pass_fds, **variables)

    def worker(self, argv: tuple[str, ...], *, pass_fds: tuple[int, ...] = (), **variables: str) -> Command:
        """Return the command of a worker."""
        environment = {**runtime_environment(self.ros.runtime), **variables}
        view = worker_view(self.ros.runtime, self.submission)
        command = self.isolation.worker_command(argv, environment, pass_fds, view)
        return replace(command, argv=(*self.start_as, *command.argv))

    def run(self, code: str, **options: Any) -> subprocess.CompletedProcess[str]:
        """Run some code as a student and return how it ended."""
        student = self.student(code, **options)
        try:
            return finish(self.around(student, GITHUB_TOKEN="canary-in-the-worker"))
        finally:
            close(student)


@contextlib.contextmanager
def start(command: Command) -> Iterator[subprocess.Popen[str]]:
    """Start a command as the grader does, and end it whatever happens."""
    with subprocess.Popen(
        command.argv,
        env=dict(command.environment),
        pass_fds=command.pass_fds,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def finish(command: Command) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    with start(command) as process:
        out, err = process.communicate(timeout=600)
        process.wait()
    return subprocess.CompletedProcess(command.argv, process.returncode, out, err)


def close(command: Command) -> None:
    """Free what the isolation opened for a start."""
    for descriptor in command.opened_fds:
        os.close(descriptor)


def find_sandbox(name: str, ros: RosInstallation, submission: Path) -> Sandbox | str:
    """Return the sandbox of a tier, or why this machine and user cannot have it.

    `landlock` and `bubblewrap-flat` are there twice: with `-user` behind the name as an ordinary user has them.
    """
    as_user = os.geteuid() == 0 and (name.endswith("-user") or name == "bubblewrap")
    try:
        isolation = _isolation(name.removesuffix("-user"), as_user=as_user)
    except EnvironmentFault as fault:
        return fault.message
    if not as_user:
        return Sandbox(isolation, ros, submission)
    start_as = user_start(ros)
    return unreachable(start_as, ros) or Sandbox(isolation, ros, submission, start_as)


def sandbox_or_skip(name: str, ros: RosInstallation, submission: Path) -> Sandbox:
    """Return the sandbox of a tier; skips the test if this machine and user cannot have it."""
    found = find_sandbox(name, ros, submission)
    if isinstance(found, str):
        pytest.skip(found)
    return found


def said(done: subprocess.CompletedProcess[str]) -> Any:
    """Return the JSON that a program printed."""
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def _isolation(name: str, *, as_user: bool) -> Isolation:
    if not as_user:
        return isolation_from_name(name)
    if name == "landlock":
        return Landlock(as_root=False)
    outer = replace(Bubblewrap.here(), as_root=False)
    return FlatBubblewrap(outer) if name == "bubblewrap-flat" else outer


def user_start(ros: RosInstallation, *further: str) -> tuple[str, ...]:
    """Return what starts a program as an ordinary user, who sees the interpreter even where root's home holds it.

    Args:
        ros: The installation with the interpreter.
        further: More options for `unshare`.
    """
    # Through env, since setpriv itself still finds programs with root's eyes.
    start = ("setpriv", f"--reuid={USER}", f"--regid={USER}", "--clear-groups", "env")
    return (*opened_start(ros, *further), *start)


def opened_start(ros: RosInstallation, *further: str) -> tuple[str, ...]:
    """Return what starts a program as root with closed folders on the way to the interpreter opened.

    In one process after another and not beside each other, as bubblewrap would: whoever has another user than its
    parent does not die with it.
    """
    paths = view_of((*ros.runtime.read_paths, ros.runtime.executable)).bound
    script = ""
    for folder in reversed(closed_folders((*paths, HOST))):
        inside = sorted({path.relative_to(folder).parts[0] for path in paths if folder in path.parents})
        script += "mount -t tmpfs -o mode=0755 opened /mnt; "
        script += "".join(f"mkdir /mnt/{name}; mount --rbind {folder / name} /mnt/{name}; " for name in inside)
        script += f"mount --move /mnt {folder}; "
    return ("unshare", "--mount", *further, "sh", "-e", "-c", f'{script} exec "$@"', "sh")


def unreachable(start_as: tuple[str, ...], ros: RosInstallation) -> str:
    """Return why another user cannot run the interpreter of these tests; empty if it can."""
    if shutil.which("setpriv") is None or shutil.which("unshare") is None:
        return "the programs of util-linux are not installed"
    libraries = ":".join(map(str, ros.runtime.library_paths))
    return (
        ""
        if _runs(start_as, ros.runtime.executable, libraries)
        else f"user {USER} cannot reach {ros.runtime.executable}"
    )


@functools.cache
def _runs(start_as: tuple[str, ...], executable: Path, libraries: str) -> bool:
    code = "import sys; open(sys.argv[1])"
    command = (*start_as, str(executable), "-I", "-S", "-c", code, str(HOST / "launcher.py"))
    tried = subprocess.run(command, env={"LD_LIBRARY_PATH": libraries}, capture_output=True, check=False)
    return tried.returncode == 0


def make_submission() -> Path:
    """Return a staged copy that any user may reach; the caller deletes it."""
    folder = Path(tempfile.mkdtemp(prefix="staged-"))
    folder.chmod(0o755)
    (folder / "node.py").write_text("print('the node')\n", encoding="utf-8")
    return folder
