"""What Landlock and the wider filter hold back, without namespaces around the student."""

import contextlib
import os
import secrets
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from sandboxes import HOST, Sandbox, close, find_sandbox, said, sandbox_or_skip, start, user_start
from tiers import more, tiers

import grader
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.limits import Limits
from grader.runtime.ros_installation import RosInstallation
from grader.runtime.sandbox import seccomp as seccomp_flat
from grader.runtime.sandbox.protocol import StudentProcess
from grader.runtime.sandbox.start import OUTGROWN, SPARE
from grader.runtime.sandbox.tiers import WITH_SIGNALS, Landlock

pytestmark = pytest.mark.sandbox

MIB = 1 << 20
PACKAGE = Path(grader.__file__).resolve().parent


@pytest.fixture(params=[*more(["executed"]), "forked"])
def way(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(params=tiers("bubblewrap-flat", "bubblewrap-flat-user", "landlock", "landlock-user", usual="landlock"))
def sandbox(request: pytest.FixtureRequest, way: str, ros: RosInstallation, submission: Path) -> Sandbox:
    return replace(sandbox_or_skip(request.param, ros, submission), forks=way == "forked")


TRIES = """
import json, os
def works(function, *arguments):
    try:
        function(*arguments)
    except OSError:
        return False
    return True
"""


def test_a_student_opens_no_file_but_its_own_and_what_python_needs(sandbox: Sandbox, tmp_path: Path) -> None:
    """Files that anybody may read by their modes are closed, of the grader all but the host."""
    canary = sandbox.submission.parent / f"canary-{secrets.token_hex(8)}"
    canary.write_text("secret", encoding="utf-8")
    hidden = [
        canary,
        "/etc/resolv.conf",
        PACKAGE / "grading" / "judging" / "judge.py",
        PACKAGE / "cli.py",
        "/proc/1/cmdline",
        "/proc/stat",
    ]
    shown = [sandbox.submission / "node.py", HOST / "launcher.py", os.__file__, "/proc/self/status", "/dev/urandom"]
    code = f"""{TRIES}
def read(path): open(path, "rb").read(10)
groups = {[list(map(str, hidden)), list(map(str, shown))]}
print(json.dumps([[works(read, path) for path in paths] for paths in groups]))
"""
    try:
        closed, opened = said(sandbox.run(code))
    finally:
        canary.unlink()
    assert closed == [False] * len(hidden)
    assert opened == [True] * len(shown)


def test_a_student_changes_nothing_outside_its_folder(sandbox: Sandbox) -> None:
    """Neither content nor properties, which need no descriptor; every file of the submission is writable by mode."""
    file = sandbox.submission / "node.py"
    file.chmod(0o666)
    if sandbox.start_as:
        os.chown(file, 1000, 1000)
    code = f"""{TRIES}
import shutil
path = {str(file)!r}
attempts = {{
    "append": (open, path, "a"), "truncate": (os.truncate, path, 0), "empty": (os.open, path, os.O_RDONLY | os.O_TRUNC),
    "mode": (os.chmod, path, 0o777), "owner": (os.chown, path, os.getuid(), os.getgid()), "times": (os.utime, path),
    "attribute": (os.setxattr, path, "user.x", b"x"), "remove": (os.unlink, path),
    "rename": (os.rename, path, path + "2"), "folder": (os.mkdir, "/tmp/folder-of-a-student"),
    "link": (os.link, path, "link"), "make": (open, "/tmp/marker-of-a-student", "w"),
    "pipe": (os.mkfifo, "/tmp/pipe-of-a-student"), "memory": (open, "/dev/shm/marker-of-a-student", "w"),
}}
print(json.dumps([name for name, attempt in attempts.items() if works(*attempt)]))
"""
    assert said(sandbox.run(code)) == []
    assert file.read_text(encoding="utf-8") == "print('the node')\n"


def test_a_student_works_in_a_folder_of_its_own(sandbox: Sandbox) -> None:
    """Working directory, home and log folder take files, and are gone with the process."""
    code = """
import json, os, tempfile
places = [os.getcwd(), os.environ["HOME"], os.environ["ROS_LOG_DIR"]]
for place in places:
    open(os.path.join(place, "file"), "w").write("x")
os.symlink("file", "link"); os.mkdir("folder"); os.rename("file", "folder/file"); os.remove("folder/file")
print(json.dumps(places))
"""
    places = said(sandbox.run(code))
    parents = {Path(place).parent for place in places[:2]}
    assert len(parents) == 1
    assert _soon(lambda: not parents.pop().exists() if parents else True)


def test_links_lead_out_of_no_wall(sandbox: Sandbox) -> None:
    """A link in the student's own folder is judged by where it leads."""
    code = f"""{TRIES}
os.symlink("/etc/resolv.conf", "link")
os.symlink({str(PACKAGE)!r}, "folder")
print(json.dumps([works(open, "link"), works(open, "folder/cli.py"), works(os.listdir, "folder")]))
"""
    assert said(sandbox.run(code)) == [False, False, False]


def test_sockets_with_a_path_cannot_be_reached(sandbox: Sandbox) -> None:
    """Landlock has no say over them: the services of a desktop listen there."""
    place = sandbox.submission / "socket"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as service:
        service.bind(str(place))
        place.chmod(0o777)
        code = f"""{TRIES}
import socket
def pair_to(kind):
    one, other = socket.socketpair(socket.AF_UNIX, kind)
    one.sendto(b"x", {str(place)!r})
made = [works(socket.socket, socket.AF_UNIX, kind) for kind in (socket.SOCK_STREAM, socket.SOCK_DGRAM)]
one, other = socket.socketpair()
one.send(b"x")
sent = [works(pair_to, socket.SOCK_DGRAM), works(pair_to, socket.SOCK_STREAM)]
print(json.dumps([*made, *sent, other.recv(1).decode()]))
"""
        assert said(sandbox.run(code)) == [False, False, False, False, "x"]


def test_other_processes_are_out_of_reach(sandbox: Sandbox) -> None:
    """No signal, no limit, no priority and no scheduling for the worker; nor for this process."""
    code = f"""{TRIES}
import resource, signal
results = []
for other in (os.getppid(), {os.getpid()}):
    if other in (0, os.getpid()):
        continue
    results += [works(os.kill, other, 0), works(os.kill, other, signal.SIGURG), works(os.pidfd_open, other)]
    results += [works(resource.prlimit, other, resource.RLIMIT_CORE, (0, 0)), works(os.sched_setaffinity, other, {{0}})]
    if works(os.getpriority, os.PRIO_PROCESS, other):
        before = os.getpriority(os.PRIO_PROCESS, other)
        works(os.setpriority, os.PRIO_PROCESS, other, 19)
        results.append(os.getpriority(os.PRIO_PROCESS, other) != before)
print(json.dumps(results))
"""
    results = said(sandbox.run(code))
    assert results
    assert not any(results)


def test_a_student_signals_itself_and_its_children(sandbox: Sandbox) -> None:
    """Programs do that in earnest."""
    code = """
import os, signal, subprocess, sys
heard = []
signal.signal(signal.SIGUSR1, lambda *_: heard.append(1))
os.kill(os.getpid(), signal.SIGUSR1)
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
child.terminate()
print(heard, child.wait())
"""
    assert sandbox.run(code).stdout == f"[1] {-signal.SIGTERM}\n"


def test_where_landlock_has_no_say_over_signals_the_filter_has(ros: RosInstallation, submission: Path) -> None:
    """Older kernels: a process reaches itself and its group, and nobody else."""
    found = find_sandbox("landlock", ros, submission)
    if isinstance(found, str):
        pytest.skip(found)
    assert isinstance(found.isolation, Landlock)
    older = replace(found, isolation=replace(found.isolation, landlock=WITH_SIGNALS - 1))
    code = f"""{TRIES}
import signal, threading
signal.signal(signal.SIGUSR1, lambda *_: None)
own = [works(os.kill, os.getpid(), signal.SIGUSR1), works(os.killpg, os.getpid(), 0), works(os.kill, 0, 0)]
works(signal.pthread_kill, threading.get_ident(), signal.SIGUSR1)
print(json.dumps([own, [works(os.kill, other, 0) for other in (os.getppid(), -1, 1)]]))
"""
    assert said(older.run(code)) == [[True] * 3, [False] * 3]


def test_nobody_leaves_the_group_that_is_ended(sandbox: Sandbox) -> None:
    """A session of one's own would outlive the run."""
    code = f"{TRIES}\nchild = os.fork()\n" + "if not child: os._exit(works(os.setsid) + 2 * works(os.setpgid, 0, 0))\n"
    code += "print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))"
    assert sandbox.run(code).stdout == "0\n"


def test_what_a_student_leaves_behind_ends_with_it(sandbox: Sandbox) -> None:
    """Children that ignore every polite signal, in the background."""
    marker = f"left-{secrets.token_hex(8)}"
    code = f"""
import subprocess, sys
code = "import signal, time; [signal.signal(n, signal.SIG_IGN) for n in (1, 2, 15)]; print(1, flush=True)"
argv = [sys.executable, "-I", "-S", "-c", code + "; time.sleep(600)", {marker!r}]
child = subprocess.Popen(argv, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
child.stdout.readline()
"""
    assert sandbox.run(code).returncode == 0
    assert _soon(lambda: not _living(marker)), _living(marker)


def test_a_killed_worker_takes_its_students_with_it(sandbox: Sandbox) -> None:
    """And what they started."""
    marker = f"left-{secrets.token_hex(8)}"
    code = f"""
import subprocess, sys, time
for _ in range(3):
    subprocess.Popen([sys.executable, "-I", "-S", "-c", "import time; time.sleep(600)", {marker!r}])
print("ready", flush=True)
time.sleep(600)
"""
    student = sandbox.student(code)
    with start(sandbox.around(student)) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        assert _living(marker)
        process.kill()
    close(student)
    assert _soon(lambda: not _living(marker)), _living(marker)


def test_nobody_outlives_a_killed_worker_by_choice(sandbox: Sandbox) -> None:
    """The system's own signal to orphans can be declined; that is not what it rests on."""
    marker = f"left-{secrets.token_hex(8)}"
    code = (
        "import ctypes, time; ctypes.CDLL(None).prctl(1, 0); print('ready', flush=True); time.sleep(600)  # " + marker
    )
    student = sandbox.student(code)
    # The relay's own command line holds the code as well, with quotes around it.
    with start(sandbox.around(student)) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        assert code in _lines(marker)
        process.kill()
    close(student)
    assert _soon(lambda: not _lines(marker)), _lines(marker)


def test_a_scratch_folder_that_outgrows_its_size_ends_its_owner(sandbox: Sandbox) -> None:
    """However many files it is spread over, and whatever their names."""
    code = f"""
import time
for number in range(8):
    open(f"file-{{number}}", "wb").write(bytes({MIB}))
time.sleep(600)
"""
    done = sandbox.run(code, limits=Limits(scratch_bytes=4 * MIB))
    assert done.returncode in (-OUTGROWN, 128 + OUTGROWN, 256 - OUTGROWN)


def test_a_fork_bomb_is_bounded(sandbox: Sandbox) -> None:
    """What else the user runs is not counted against it, but some room is left for it."""
    code = """
import os
here, there = os.pipe()
count = 0
try:
    while count < 500:
        if not os.fork():
            os.close(there); os.read(here, 1); os._exit(0)
        count += 1
except BlockingIOError:
    pass
print(count)
"""
    allowed = 20 + (SPARE if sandbox.is_ordinary else 0)

    def started() -> int:
        return int(sandbox.run(code, limits=Limits(processes=20)).stdout)

    # An ordinary user's limit counts what else the user runs, such as the same test beside this one, which may end
    # between the count and the start. That happens in one run, but not in every one.
    assert any(0 < started() < allowed + 40 for _ in range(5))


def test_processes_outside_of_a_container_take_no_room(sandbox: Sandbox, ros: RosInstallation) -> None:
    """The kernel counts those of the same user in and outside of a container together; /proc shows those inside."""
    if not sandbox.start_as:
        pytest.skip("only root can hide a user's processes")
    limits = Limits(processes=64)
    others = f"""
import threading
for _ in range({limits.processes + SPARE + 100}):
    threading.Thread(target=threading.Event().wait, daemon=True).start()
print("ready", flush=True)
input()
"""
    code = """
import threading
done, count = threading.Event(), 0
try:
    while count < 1000:
        threading.Thread(target=done.wait).start()
        count += 1
except RuntimeError:
    pass
print(count)
done.set()
"""
    outside = [*sandbox.start_as, sys.executable, "-I", "-S", "-c", others]
    inside = replace(sandbox, start_as=user_start(ros, "--pid", "--fork", "--kill-child", "--mount-proc"))
    with subprocess.Popen(outside, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        started = int(inside.run(code, limits=limits).stdout)
        process.kill()
    # What ends meanwhile, such as threads of the same test beside this one, makes room for as many more.
    assert limits.processes / 2 < started < 1000


def test_a_student_has_no_privilege_over_files_that_it_needs_none_for(sandbox: Sandbox) -> None:
    """At most the one to enter folders that are closed to its user, and only where such a folder is on the way."""
    code = """
import json, os
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
names = ("CapInh", "CapPrm", "CapEff", "CapAmb")
privileges = max(status[name].strip() for name in names)
print(json.dumps([os.getuid(), status["NoNewPrivs"].strip(), status["Seccomp"].strip(), privileges]))
"""
    user, no_new, seccomp, privileges = said(sandbox.run(code))
    assert (user != 0, no_new, seccomp) == (True, "1", "2")
    assert int(privileges, 16) in ((0,) if sandbox.start_as else (0, 1 << 2))


def test_on_a_shared_network_a_domain_must_be_given(ros: RosInstallation, submission: Path) -> None:
    """A default would let the nodes of two runs talk to each other."""
    with pytest.raises(HarnessError, match="ROS_DOMAIN_ID"):
        Landlock(as_root=False).student_command(StudentProcess(ros.runtime, HOST, submission, (), {}, ()), Limits())


def test_the_wider_filter_refuses_what_the_other_does() -> None:
    """It adds calls and rules, and takes none away."""
    from grader.runtime.sandbox import seccomp

    assert set(seccomp.NUMBERS) < set(seccomp_flat.FLAT_NUMBERS)
    kept = {rule.call for rule in seccomp_flat.FLAT_RULES}
    assert {rule.call for rule in seccomp.ARGUMENT_RULES} < kept


def _lines(marker: str) -> list[str]:
    """Return the arguments, of all processes, that hold a marker."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            found += path.read_text(encoding="utf-8", errors="replace").split("\0")
    return [argument for argument in found if marker in argument]


def _living(marker: str) -> list[str]:
    """Return the arguments of all processes that are the marker."""
    return [argument for argument in _lines(marker) if argument == marker]


def _soon(true: Callable[[], object], seconds: float = 60.0) -> bool:
    import time

    deadline = time.monotonic() + seconds
    while not true():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.005)
    return True
