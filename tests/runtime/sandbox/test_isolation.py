"""What the sandboxes prevent students' processes from doing, tried with real processes."""

import errno
import fcntl
import json
import os
import secrets
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from sandboxes import DOMAIN, HOST, Sandbox, close, finish, said, sandbox_or_skip, start
from tiers import tiers

import grader
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.limits import Limits
from grader.runtime.ros_installation import RosInstallation
from grader.runtime.sandbox.bubblewrap import Bubblewrap
from grader.runtime.sandbox.environment import account_files
from grader.runtime.sandbox.protocol import StudentProcess

pytestmark = pytest.mark.sandbox

MIB = 1 << 20
#: Where the worker has the host package as well, for its starter.
SEEN_AT = Path("/grader_host/host")


@pytest.fixture(params=tiers("bubblewrap-root", "bubblewrap"))
def sandbox(request: pytest.FixtureRequest, ros: RosInstallation, submission: Path) -> Sandbox:
    return sandbox_or_skip(request.param, ros, submission)


@pytest.fixture
def plain(ros: RosInstallation, submission: Path) -> Sandbox:
    return sandbox_or_skip("none", ros, submission)


@pytest.fixture(
    params=tiers(
        "bubblewrap-root",
        "bubblewrap",
        "bubblewrap-flat",
        "bubblewrap-flat-user",
        "landlock",
        "landlock-user",
        "none",
    )
)
def any_tier(request: pytest.FixtureRequest, ros: RosInstallation, submission: Path) -> Sandbox:
    return sandbox_or_skip(request.param, ros, submission)


# --- network ---


def test_a_student_has_no_network_but_lo(sandbox: Sandbox) -> None:
    """The only interface is lo, and the world is unreachable."""
    code = """
import json, socket
def reach(kind):
    with socket.socket(socket.AF_INET, kind) as there:
        there.settimeout(2)
        return there.connect_ex(("192.0.2.1", 80))
print(json.dumps([[name for _, name in socket.if_nameindex()], reach(socket.SOCK_STREAM), reach(socket.SOCK_DGRAM)]))
"""
    assert said(sandbox.run(code)) == [["lo"], errno.ENETUNREACH, errno.ENETUNREACH]


def test_a_student_shares_lo_with_its_worker(sandbox: Sandbox) -> None:
    """What the worker listens to on lo can be reached: DDS needs that."""
    relay = """
import json, socket, subprocess, sys
command = json.loads(sys.argv[1])
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here:
    here.bind(("127.0.0.1", 45671))
    here.settimeout(20)
    student = subprocess.run(command["argv"], env=command["environment"], pass_fds=command["pass_fds"])
    print(here.recv(100).decode())
"""
    student = sandbox.student(
        'import socket; socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b"hello", ("127.0.0.1", 45671))'
    )
    told = {"argv": student.argv, "environment": dict(student.environment), "pass_fds": student.pass_fds}
    argv = (sys.executable, "-I", "-S", "-c", relay, json.dumps(told))
    done = finish(sandbox.worker(argv, pass_fds=student.pass_fds))
    close(student)
    assert (done.returncode, done.stdout) == (0, "hello\n"), done.stderr


# --- files ---


def test_a_student_cannot_find_what_lies_outside(sandbox: Sandbox, tmp_path: Path) -> None:
    """Neither by its path nor by walking through everything that can be seen."""
    name = f"canary-{secrets.token_hex(8)}"
    canary = tmp_path / name
    canary.write_text("secret", encoding="utf-8")
    beside = sandbox.submission.parent / name
    beside.write_text("secret", encoding="utf-8")
    code = f"""
import json, os
def opens(path):
    try:
        return bool(open(path))
    except OSError:
        return False
seen = [name for folder, _, files in os.walk("/") if not folder.startswith("/proc") for name in files]
hidden = {[str(canary), str(beside), "/etc/resolv.conf", "/etc/shadow", "/proc/1/root" + str(canary)]!r}
print(json.dumps([[path for path in hidden if opens(path)], {name!r} in seen, len(seen) > 1000]))
"""
    try:
        assert said(sandbox.run(code)) == [[], False, True]
    finally:
        beside.unlink()


def test_a_student_reads_the_host_and_its_submission_and_nothing_else_of_the_grader(sandbox: Sandbox) -> None:
    """The rubrics and checks are not in view, wherever the grader is installed."""
    package = Path(grader.__file__).resolve().parent
    code = f"""
import json, os
found = [name for folder, _, files in os.walk("/") if not folder.startswith("/proc") for name in files]
host = sorted(name for name in os.listdir({sandbox.isolation.host_seen_at!r}) if name.endswith(".py"))
package = {str(package)!r}
print(json.dumps([host, os.listdir({sandbox.isolation.submission_seen_at!r}),
    os.listdir(package) if os.path.isdir(package) else [],
    [name for name in found if name in ("rubric.yaml", "rubric_file.py", "bubblewrap.py")]]))
"""
    host = sorted(path.name for path in HOST.glob("*.py"))
    assert said(sandbox.run(code)) == [host, ["node.py"], [], []]


def test_a_student_writes_to_its_scratch_folders_only(sandbox: Sandbox) -> None:
    """Home, log folder, working directory, /tmp and /dev/shm take files; nothing else does."""
    code = """
import json, os
def writes(folder):
    path = os.path.join(folder, "marker-of-a-student")
    try:
        open(path, "w").close()
    except OSError:
        return False
    os.remove(path)
    return True
everywhere = {folder for folder, _, _ in os.walk("/") if not folder.startswith(("/proc/", "/sys/"))}
print(json.dumps([sorted(filter(writes, everywhere)), os.getcwd(), os.environ["HOME"], os.environ["ROS_LOG_DIR"]]))
"""
    scratch = ["/dev/shm", "/tmp", "/tmp/home", "/tmp/home/log", "/tmp/work"]
    assert said(sandbox.run(code)) == [scratch, "/tmp/work", "/tmp/home", "/tmp/home/log"]


def test_the_working_directory_has_copies_that_a_student_may_change(any_tier: Sandbox) -> None:
    """The files that were handed in stay as they are, and the copies leave no descriptor open."""
    (any_tier.submission / "deep" / "er").mkdir(parents=True)
    for name, text in {"settings.txt": "20", "deep/er/table.csv": "1,2"}.items():
        (any_tier.submission / name).write_text(text)
    for path in (any_tier.submission / "deep", *any_tier.submission.rglob("*")):
        path.chmod(0o755 if path.is_dir() else 0o644)
    code = """
import json, os
before = [open(name).read() for name in ("settings.txt", "deep/er/table.csv")]
for name in ("settings.txt", "deep/er/table.csv", "deep/own.txt"):
    open(name, "w").write("changed")
print(json.dumps([before, sorted(os.listdir()), open("deep/er/table.csv").read(), len(os.listdir("/proc/self/fd"))]))
"""
    found = said(any_tier.run(code, copied=("deep/er/table.csv", "settings.txt")))
    assert found == [["20", "1,2"], ["deep", "settings.txt"], "changed", 4]
    assert (any_tier.submission / "settings.txt").read_text() == "20"


def test_nothing_a_student_writes_is_seen_outside(sandbox: Sandbox) -> None:
    """Scratch folders are private: a marker in /tmp and /dev/shm is not on the machine."""
    marker = f"marker-{secrets.token_hex(8)}"
    code = f"""
import os
for folder in ("/tmp", "/dev/shm"):
    open(os.path.join(folder, {marker!r}), "w").close()
    assert os.path.exists(os.path.join(folder, {marker!r}))
"""
    assert sandbox.run(code).returncode == 0
    assert not [folder for folder in ("/tmp", "/dev/shm") if (Path(folder) / marker).exists()]


def test_a_staged_copy_that_only_its_owner_can_read_can_be_run(sandbox: Sandbox) -> None:
    """Staging uses private folders; as root the student is another user."""
    (sandbox.submission / "node.py").chmod(0o600)
    if not sandbox.start_as:
        sandbox.submission.chmod(0o700)
    else:
        (sandbox.submission / "node.py").chmod(0o644)
    assert sandbox.run("print(open('/submission/node.py').read())").stdout == "print('the node')\n\n"


def test_a_link_in_the_submission_leads_nowhere(sandbox: Sandbox, tmp_path: Path) -> None:
    """A link is followed inside the sandbox, where its target does not exist."""
    (tmp_path / "secret").write_text("secret", encoding="utf-8")
    (sandbox.submission / "link").symlink_to(tmp_path / "secret")
    done = sandbox.run("open('/submission/link')")
    assert "FileNotFoundError" in done.stderr


# --- what is inherited ---


def test_a_student_sees_no_variable_of_its_callers(sandbox: Sandbox, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither in its own environment nor in that of the sandbox's first process."""
    monkeypatch.setenv("GITHUB_TOKEN", "canary-in-the-supervisor")
    code = """
import json
def environ(process):
    try:
        return open(f"/proc/{process}/environ").read()
    except OSError:
        return ""
print(json.dumps([environ("self"), environ(1)]))
"""
    own, first = said(sandbox.run(code, COLOUR="blue"))
    assert "COLOUR=blue" in own
    assert "canary" not in own
    assert first == ""


def test_the_environment_of_a_student_is_exact(sandbox: Sandbox) -> None:
    """What is there is what was decided here; discovery range is unset, since LOCALHOST breaks a private /dev/shm."""
    environment = said(sandbox.run("import json, os; print(json.dumps(dict(os.environ)))", COLOUR="blue"))
    expected = {
        "HOME": "/tmp/home",
        "TMPDIR": "/tmp",
        "USER": "student",
        "LOGNAME": "student",
        "SHELL": "/bin/bash",
        "TZ": "UTC",
        "PYTHON_GIL": "1",
        "ROS_LOG_DIR": "/tmp/home/log",
        "PATH": "/usr/bin",
        "PWD": "/tmp/work",
        "LANG": "C.UTF-8",
        "PYTHONUTF8": "1",
        "PYTHONDONTWRITEBYTECODE": "1",
        "ROS_PYTHON_CHECK_FIELDS": "1",
        "ROS_DOMAIN_ID": DOMAIN,
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
        "SKIP_DEFAULT_XML_FILE": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        "MKL_NUM_THREADS": "1",
        "MALLOC_ARENA_MAX": "2",
        "MPLBACKEND": "module://matplotlib.backends.backend_tkagg",
        "COLOUR": "blue",
        "LD_LIBRARY_PATH": ":".join(map(str, sandbox.ros.runtime.library_paths)),
        **({"PYTHONPATH": ":".join(map(str, paths))} if (paths := sandbox.ros.runtime.python_paths) else {}),
        **sandbox.ros.runtime.environment,
    }
    assert environment == expected


def test_a_student_has_no_descriptor_but_those_given(any_tier: Sandbox) -> None:
    """Standard input, output and error, and the line under the number it was given."""
    ours, theirs = socket.socketpair()
    line = theirs.fileno()
    code = f"""
import json, os
def is_open(number):
    try:
        return bool(os.fstat(number))
    except OSError:
        return False
os.write({line}, b"hello")
print(json.dumps([number for number in range(200) if is_open(number)]))
"""
    with Path(__file__).open("rb") as secret, ours, theirs:
        os.set_inheritable(secret.fileno(), True)
        assert said(any_tier.run(code, pass_fds=(line,))) == [0, 1, 2, line]
        assert ours.recv(10) == b"hello"


def test_an_exit_code_comes_through(any_tier: Sandbox) -> None:
    """The worker learns how a student's process ended."""
    assert any_tier.run("import sys; sys.exit(7)").returncode == 7


# --- processes and privileges ---


def test_a_student_sees_itself_and_the_first_process_of_its_sandbox_only(sandbox: Sandbox) -> None:
    """Grader, worker and other students are out of sight."""
    code = "import json, os; print(json.dumps([os.getpid(), [int(n) for n in os.listdir('/proc') if n.isdigit()]]))"
    own, seen = said(sandbox.run(code))
    assert sorted(seen) == [1, own]


def test_the_first_process_of_a_sandbox_is_out_of_reach(sandbox: Sandbox) -> None:
    """It runs without the filter of system calls: whoever wrote to its memory would be rid of the filter."""
    code = """
import json, os
names = ("mem", "maps", "environ", "cmdline", "task/1/mem", "root", "fd")
print(json.dumps([open("/proc/1/comm").read() if os.path.exists("/proc/1/comm") else "",
    [name for name in names if os.path.lexists(f"/proc/1/{name}")]]))
"""
    assert said(sandbox.run(code)) == ["", []]


def test_a_student_has_no_privileges(sandbox: Sandbox) -> None:
    """Not root, no capability in any set, no way to gain one, and another root's files stay another's."""
    code = """
import json, os
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
names = ("CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb", "NoNewPrivs", "Seccomp", "Groups")
print(json.dumps([os.getuid(), os.getgid(), {name: status[name].strip() for name in names}]))
"""
    user, group, sets = said(sandbox.run(code))
    assert 0 not in (user, group)
    assert sets["NoNewPrivs"] == "1"
    assert sets["Seccomp"] == "2"
    assert {sets[name] for name in sets if name.startswith("Cap")} == {"0" * 16}
    assert isinstance(sandbox.isolation, Bubblewrap)
    if sandbox.isolation.as_root:
        assert sets["Groups"] == ""


REFUSED = {
    "AF_VSOCK": "socket.socket(40, socket.SOCK_STREAM)",
    "AF_ALG": "socket.socket(38, socket.SOCK_SEQPACKET)",
    "AF_PACKET": "socket.socket(17, socket.SOCK_RAW)",
    "AF_BLUETOOTH": "socket.socket(31, socket.SOCK_RAW)",
    "raw socket": "socket.socket(socket.AF_INET, socket.SOCK_RAW, 1)",
    "unshare user": "call(272, 0x10000000)",
    "unshare network": "call(272, 0x40000000)",
    "clone user": "call(56, 0x10000000 | 17, 0, 0, 0, 0)",
    "clone3": "call(435, 0, 0)",
    "setns": "call(308, 0, 0)",
    "ptrace": "call(101, 16, os.getppid(), 0, 0)",
    "process_vm_readv": "call(310, 1, 0, 0, 0, 0, 0)",
    "keyctl": "call(250, 0, -3, 0)",
    "add_key": "call(248, 0, 0, 0, 0, 0)",
    "mount": "call(165, 0, 0, 0, 0x1020, 0)",
    "fsopen": "call(430, 0, 0)",
    "open_tree": "call(428, -100, 0, 0)",
    "chroot": "os.chroot('/tmp')",
    "bpf": "call(321, 0, 0, 0)",
    "perf_event_open": "call(298, 0, 0, -1, -1, 0)",
    "userfaultfd": "call(323, 0)",
    "io_uring": "call(425, 8, 0)",
    "shmget": "call(29, 0, 4096, 0o1600)",
    "prlimit of another process": "resource.prlimit(1, resource.RLIMIT_NOFILE, (3, 3))",
    "raise a limit": "resource.setrlimit(resource.RLIMIT_NPROC, (100000, 100000))",
    "TIOCSTI": "fcntl.ioctl(os.open('/dev/ptmx', os.O_RDWR), 0x5412, b'x')",
    "become root": "os.setuid(0)",
    "kill the grader": f"os.kill({os.getpid()}, 0)",
    "real-time priority": "os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))",
}


@pytest.mark.skipif(os.uname().machine != "x86_64", reason="the numbers of the calls are those of x86-64")
def test_a_student_cannot_make_dangerous_system_calls(sandbox: Sandbox) -> None:
    """Each attempt fails, whatever the way it is tried."""
    code = f"""
import ctypes, fcntl, json, os, resource, socket
libc = ctypes.CDLL(None, use_errno=True)
def call(*numbers):
    if libc.syscall(*(ctypes.c_long(number) for number in numbers)) < 0:
        raise OSError(ctypes.get_errno(), "refused")
succeeded = []
for name, attempt in {REFUSED!r}.items():
    try:
        eval(attempt)
    except (OSError, ValueError):
        continue
    succeeded.append(name)
print(json.dumps(succeeded))
"""
    assert said(sandbox.run(code)) == []


def test_a_student_may_do_what_ordinary_programs_do(sandbox: Sandbox) -> None:
    """Threads, forks, subprocesses, locks shared by processes, sockets on lo and temporary files work."""
    code = """
import multiprocessing, os, socket, subprocess, sys, tempfile, threading
thread = threading.Thread(target=len, args=("x",)); thread.start(); thread.join()
child = os.fork()
if not child: os._exit(5)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 5
assert subprocess.run([sys.executable, "-c", "pass"]).returncode == 0
with multiprocessing.get_context("fork").Lock(): pass
for family in (socket.AF_INET, socket.AF_INET6, socket.AF_NETLINK):
    socket.socket(family, socket.SOCK_DGRAM).close()
for end in socket.socketpair(): end.close()
with tempfile.TemporaryFile() as file: file.write(b"x")
print("fine")
"""
    assert sandbox.run(code).stdout == "fine\n"


# --- limits ---

FORK_BOMB = """
import os, time
try:
    while os.fork():
        pass
except OSError:
    print("full", flush=True)
time.sleep(60)
"""


def test_a_fork_bomb_is_bounded(sandbox: Sandbox) -> None:
    """No more processes than allowed exist at a time."""
    code = """
import os, signal
children = []
try:
    while len(children) < 500:
        child = os.fork()
        if not child:
            signal.pause()
        children.append(child)
except BlockingIOError:
    pass
print(len(children))
"""
    assert 0 < said(sandbox.run(code, limits=Limits(processes=20))) < 20


def test_one_students_fork_bomb_leaves_the_next_student_its_processes(sandbox: Sandbox) -> None:
    """Processes are counted for each student alone."""
    hog = sandbox.student(
        FORK_BOMB,
        limits=Limits(processes=10),
    )
    command = sandbox.around(hog)
    with start(command) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "full\n"
        other = sandbox.run("import os; os.fork() or os._exit(0); print(1)", limits=Limits(processes=3))
        process.kill()
    close(hog)
    assert other.stdout == "1\n", other.stderr


def test_memory_is_bounded(any_tier: Sandbox) -> None:
    """A process that wants more is told so by Python, not killed with the machine."""
    done = any_tier.run(f"bytearray({4096 * MIB})", limits=Limits(memory_bytes=400 * MIB))
    assert (done.returncode, "MemoryError" in done.stderr) == (1, True)


@pytest.mark.parametrize("folder", ["/tmp", "/dev/shm", "/tmp/work"])
def test_scratch_folders_are_bounded(sandbox: Sandbox, folder: str) -> None:
    """A full scratch folder is an error of the student's, not a full machine."""
    code = f"""
import errno
try:
    with open("{folder}/big", "wb") as file:
        for _ in range(8):
            file.write(bytes({MIB})); file.flush()
except OSError as error:
    print(errno.errorcode[error.errno])
"""
    assert sandbox.run(code, limits=Limits(scratch_bytes=2 * MIB)).stdout == "ENOSPC\n"


def test_file_sizes_descriptors_and_core_dumps_are_bounded(any_tier: Sandbox) -> None:
    """The limits given are those the process finds."""
    code = """
import json, resource
names = ("RLIMIT_AS", "RLIMIT_FSIZE", "RLIMIT_NOFILE", "RLIMIT_CORE")
print(json.dumps([resource.getrlimit(getattr(resource, name)) for name in names]))
"""
    limits = Limits(memory_bytes=500 * MIB, file_bytes=MIB, open_files=50)
    assert said(any_tier.run(code, limits=limits)) == [[2036 * MIB] * 2, [MIB] * 2, [50] * 2, [0] * 2]


@pytest.mark.breadth(1, 1)
def test_processor_time_is_bounded(any_tier: Sandbox) -> None:
    """A loop without end is ended by the kernel, as a last resort."""
    done = any_tier.run("while True: pass", limits=Limits(processor_ns=1_000_000_000))
    assert done.returncode in {128 + signal.SIGXCPU, 128 + signal.SIGKILL, 256 - signal.SIGXCPU, 256 - signal.SIGKILL}


# --- the end ---


def _living(marker: str) -> list[str]:
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            line = path.read_bytes()
        except OSError:
            continue
        if marker.encode() in line and path.parent.name != str(os.getpid()):
            found.append(path.parent.name)
    return found


def _wait_until(true: Callable[[], bool], seconds: float = 60.0) -> bool:
    deadline = time.monotonic() + seconds
    while not true():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.005)
    return True


DAEMONS = """
import os, subprocess, sys, time
for _ in range(5):
    subprocess.Popen([sys.executable, "-I", "-S", "-c", "import time; time.sleep(600)", {marker!r}],
        start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
print("ready", flush=True)
time.sleep(600)
"""


def test_killing_the_worker_leaves_no_process_of_a_student(sandbox: Sandbox) -> None:
    """Daemons in sessions of their own end too, without anybody looking for them."""
    marker = f"daemon-{secrets.token_hex(8)}"
    student = sandbox.student(DAEMONS.format(marker=marker))
    with start(sandbox.around(student)) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        assert len(_living(marker)) >= 5
        process.kill()
    close(student)
    assert _wait_until(lambda: not _living(marker)), _living(marker)


def test_a_worker_dies_with_the_grader(any_tier: Sandbox) -> None:
    """Killing the process that started the worker ends the worker."""
    marker = f"worker-{secrets.token_hex(8)}"
    argv = (sys.executable, "-I", "-S", "-c", "import time; print('ready', flush=True); time.sleep(600)", marker)
    command = any_tier.worker(argv)
    told = json.dumps({"argv": command.argv, "environment": dict(command.environment), "passed": command.pass_fds})
    starter = (
        "import json, subprocess, sys; c = json.loads(sys.argv[1]);"
        "subprocess.run(c['argv'], env=c['environment'], pass_fds=c['passed'], start_new_session=True)"
    )
    started = (sys.executable, "-I", "-S", "-c", starter, told)
    with subprocess.Popen(started, stdout=subprocess.PIPE, pass_fds=command.pass_fds) as supervisor:
        for descriptor in command.opened_fds:
            os.close(descriptor)
        assert supervisor.stdout is not None
        assert supervisor.stdout.readline() == b"ready\n"
        assert _living(marker)
        supervisor.kill()
    assert _wait_until(lambda: not _living(marker)), _living(marker)


LOCKS = {
    "flock": "fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)",
    "process": "fcntl.lockf(file, fcntl.LOCK_SH | fcntl.LOCK_NB)",
    "descriptor": "fcntl.fcntl(file, 37, struct.pack('hhqqi4x', fcntl.F_RDLCK, 0, 0, 0, 0))",
}


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_on_a_shared_file_is_felt_by_nobody(any_tier: Sandbox, submission: Path, lock: str) -> None:
    """Students who are graded at the same time could speak by it; the program believes that it has its lock.

    The file is this test's own: another test that holds its lock on a library's file would fail this one.
    """
    if any_tier.isolation.name == "none":
        pytest.skip("there is no filter")
    shared = submission / "shared"
    shared.touch()
    seen_at = Path(any_tier.isolation.submission_seen_at or submission)
    code = f"""
import fcntl, struct, sys, time
file = open({str(seen_at / "shared")!r}, "rb")
{LOCKS[lock]}
print("locked", flush=True)
time.sleep(60)
"""
    student = any_tier.student(code)
    with start(any_tier.around(student)) as process, shared.open("rb+") as file:
        close(student)
        assert process.stderr is not None
        assert process.stdout is not None
        assert process.stdout.readline() == "locked\n", process.stderr.read()
        (fcntl.flock if lock == "flock" else fcntl.lockf)(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def test_a_student_hears_nothing_of_who_opens_a_shared_file(any_tier: Sandbox) -> None:
    """Neither by a watch nor by a lease."""
    if any_tier.isolation.name == "none":
        pytest.skip("there is no filter")
    code = """
import ctypes, fcntl, os
system = ctypes.CDLL(None, use_errno=True)
watch = system.inotify_add_watch(system.inotify_init(), os.__file__.encode(), 0xFFF)
try:
    fcntl.fcntl(open(os.__file__), fcntl.F_SETLEASE, fcntl.F_RDLCK)
    lease = "lease"
except PermissionError:
    lease = ""
print([watch, lease])
"""
    assert any_tier.run(code).stdout == "[-1, '']\n"


# --- the worker ---


def test_a_worker_has_an_exact_environment_all_files_and_a_network_of_its_own(
    sandbox: Sandbox, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is trusted with files, but leaves nothing in /dev/shm and hears no other node."""
    monkeypatch.setenv("GITHUB_TOKEN", "canary")
    code = """
import json, os, socket
open("/dev/shm/marker-of-a-worker", "w").close()
print(json.dumps([dict(os.environ), [name for _, name in socket.if_nameindex()], os.getcwd(),
    os.path.exists("/etc/passwd"), sorted(n for n in os.listdir("/dev/shm")), os.getpid() < 10]))
"""
    command = sandbox.isolation.worker_command((sys.executable, "-I", "-S", "-c", code), {"COLOUR": "blue"}, ())
    command = replace(command, argv=(*sandbox.start_as, *command.argv))
    environment, network, folder, files, memory, first = said(finish(command))
    assert environment.items() <= {"COLOUR": "blue", "PWD": "/", "LC_CTYPE": "C.UTF-8"}.items()
    assert environment["COLOUR"] == "blue"
    assert (network, folder, files, memory, first) == (["lo"], "/", True, ["marker-of-a-worker"], True)
    assert not Path("/dev/shm/marker-of-a-worker").exists()


#: Prints every file that a worker can open, without those of the system, and every folder that it can write to.
LOOK_AROUND = """
import json, os, sys
readable, writable = [], []
for folder, folders, files in os.walk("/"):
    if folder in ("/proc", "/usr"):
        folders.clear()
        continue
    if os.access(folder, os.W_OK):
        writable.append(folder)
    for name in files:
        path = os.path.join(folder, name)
        try:
            os.close(os.open(path, os.O_RDONLY | os.O_NONBLOCK))
        except OSError:
            continue
        readable.append(path)
print(json.dumps([readable, writable]))
"""


@pytest.mark.nightly
@pytest.mark.breadth(0, 1)
def test_a_worker_opens_nothing_of_the_instructor(sandbox: Sandbox, tmp_path: Path, ros: RosInstallation) -> None:
    """It sees Python, ROS, its own modules and its folder: no other folder, no rubric, no key, no other submission."""
    beside = sandbox.submission.parent / "another-submission.py"
    beside.write_text("canary", encoding="utf-8")
    beside.chmod(0o644)
    command = sandbox.worker((sys.executable, "-I", "-S", "-c", LOOK_AROUND))
    readable, writable = (set(map(Path, found)) for found in said(finish(command)))
    package = HOST.parents[1]
    seen = {path.relative_to(package).parts[0] for path in readable if package in path.parents}
    assert seen == {"__init__.py", "api.py", "runtime"}
    needed = (*ros.runtime.read_paths, ros.runtime.executable, package, sandbox.submission, Path("/dev"), SEEN_AT)
    roots = {path.resolve() for path in needed} | set(needed)
    accounts = {Path("/etc", name) for name in account_files(0, 0, Path("/"))}  # the grader's own
    programs = {Path("/run/rclpy-grader.users"), *accounts}
    strangers = {p for p in readable - programs if roots.isdisjoint((p, *p.parents, p.resolve()))}
    assert strangers == set()
    assert beside not in readable
    ours = (sandbox.submission, Path("/tmp"), Path("/dev"))
    assert {path for path in writable if not any(own in (path, *path.parents) for own in ours)} == set()


def test_descriptors_and_exit_codes_of_a_worker_come_through(any_tier: Sandbox) -> None:
    """The supervisor's line is open under the number given."""
    ours, theirs = socket.socketpair()
    code = "import os, sys; os.write(int(sys.argv[1]), b'hello'); sys.exit(9)"
    argv = (sys.executable, "-I", "-S", "-c", code, str(theirs.fileno()))
    with ours, theirs:
        done = finish(any_tier.worker(argv, pass_fds=(theirs.fileno(),)))
        assert (done.returncode, ours.recv(10)) == (9, b"hello")


# --- the tier without a sandbox ---


def test_without_a_sandbox_the_environment_is_exact_as_well(plain: Sandbox, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing of the caller's environment; DDS keeps to the loopback address."""
    monkeypatch.setenv("GITHUB_TOKEN", "canary")
    environment = said(plain.run("import json, os; print(json.dumps(dict(os.environ)))"))
    assert "GITHUB_TOKEN" not in environment
    assert environment["FASTRTPS_DEFAULT_PROFILES_FILE"].endswith("loopback.xml")
    assert "ROS_AUTOMATIC_DISCOVERY_RANGE" not in environment


def test_without_a_sandbox_a_student_works_in_a_folder_that_is_thrown_away(plain: Sandbox) -> None:
    """Also when it is killed."""
    code = "import os, time; open('file', 'w').close(); print(os.getcwd(), os.environ['HOME'], flush=True); {}"
    ended, killed = plain.run(code.format("")), plain.student(code.format("time.sleep(600)"))
    with start(killed) as process:
        assert process.stdout is not None
        places = [*ended.stdout.split(), *process.stdout.readline().split()]
        assert Path(places[2], "file").exists()
        process.kill()
    assert len({Path(place).parent for place in places}) == 2
    assert _wait_until(lambda: not any(Path(place).exists() for place in places))


def test_without_a_sandbox_a_student_has_a_session_of_its_own(plain: Sandbox) -> None:
    """So that a signal to its group reaches it and its children, and nobody else."""
    with start(plain.student("import os; print(os.getsid(0), os.getpid())")) as process:
        assert process.stdout is not None
        session, own = process.stdout.readline().split()
    assert session == own == str(process.pid)


def test_without_a_sandbox_a_domain_must_be_given(plain: Sandbox) -> None:
    """A default would let the nodes of two runs talk to each other."""
    with pytest.raises(HarnessError, match="ROS_DOMAIN_ID"):
        plain.isolation.student_command(StudentProcess(plain.ros.runtime, HOST, plain.submission, (), {}, ()), Limits())


def test_without_a_sandbox_the_submission_is_seen_where_it_lies(plain: Sandbox) -> None:
    """An empty folder name says so."""
    assert plain.isolation.submission_seen_at == ""
    assert (Path(plain.isolation.host_seen_at) / "launcher.py").is_file()


# --- real nodes ---

ECHO_NODE = """
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("echo")
back = node.create_publisher(String, "back", 10)
node.create_subscription(String, "forth", back.publish, 10)
rclpy.spin(node)
"""

ECHO_WORKER = """
import json, subprocess, sys, time
import rclpy
from std_msgs.msg import String
command = json.loads(sys.argv[1])
rclpy.init()
node = rclpy.create_node("worker", start_parameter_services=False)
heard = []
node.create_subscription(String, "back", lambda message: heard.append(message.data), 30)
forth = node.create_publisher(String, "forth", 30)
student = subprocess.Popen(command["argv"], env=command["environment"], pass_fds=command["pass_fds"])
deadline = time.monotonic() + 300
def wait(true):
    while not true() and time.monotonic() < deadline and student.poll() is None:
        rclpy.spin_once(node, timeout_sec=0.02)
def exchange(text):
    count = len(heard)
    while len(heard) == count and time.monotonic() < deadline and student.poll() is None:
        # Whoever is not matched yet loses what is sent: the first message may have to be sent again.
        forth.publish(String(data=text))
        soon = time.monotonic() + 0.5
        wait(lambda: len(heard) > count or time.monotonic() > soon)
wait(lambda: forth.get_subscription_count() and node.count_publishers("back"))
for number in range(20):
    exchange(f"message {number}")
student.kill()
student.wait()
print(json.dumps(sorted(set(heard), key=heard.index)))
"""


@pytest.mark.breadth(1, 1)
@pytest.mark.ros
def test_nodes_on_both_sides_of_the_walls_talk(any_tier: Sandbox) -> None:
    """Twenty messages go from the worker's node to the student's and come back."""
    student = any_tier.student(ECHO_NODE)
    told = {"argv": student.argv, "environment": dict(student.environment), "pass_fds": student.pass_fds}
    argv = (sys.executable, "-c", ECHO_WORKER, json.dumps(told))
    logs = str(any_tier.submission / "logs")
    Path(logs).mkdir()
    Path(logs).chmod(0o777)
    done = finish(any_tier.worker(argv, pass_fds=student.pass_fds, ROS_DOMAIN_ID=DOMAIN, ROS_LOG_DIR=logs))
    close(student)
    assert said(done) == [f"message {number}" for number in range(20)]
