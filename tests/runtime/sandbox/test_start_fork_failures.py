"""A fork in which a part of the sandbox cannot be set up ends, before any of the student's code has run in it."""

from __future__ import annotations

import json
import secrets
from dataclasses import replace
from pathlib import Path

import pytest
from hostile import hostile, record
from sandboxes import DOMAIN, Sandbox, finish, said, sandbox_or_skip
from tiers import tiers

from grader.runtime.model.limits import Limits
from grader.runtime.recording.codec import to_json
from grader.runtime.ros_installation import RosInstallation
from grader.runtime.sandbox import start
from grader.runtime.sandbox.bubblewrap import Bubblewrap
from grader.runtime.sandbox.environment import worker_environment
from grader.runtime.session import RecordingSession

pytestmark = pytest.mark.ros

#: The module that sandboxes a process, where one of the calls that it and the starter make in a fork can fail. A file
#: names the process and the number of the call. Its failure is marked by a limit that the student's process would show.
INJECTING = """
import ctypes, errno, fcntl, importlib.util, os, resource
spec = importlib.util.spec_from_file_location("_start", {start!r})
real = importlib.util.module_from_spec(spec)
spec.loader.exec_module(real)
STARTER, set_limit = os.getpid(), resource.setrlimit
# w waits for the student's process s, whose folder g watches, a child of f
state = {{"owner": STARTER, "role": "", "count": 0, "wanted": None, "forked": False, "rules": 0}}
def fails(name):
    own = os.getpid()
    if own == STARTER or state["forked"]:
        return False
    if own != state["owner"]:
        state.update(owner=own, role={{"": "w", "w": "s", "s": "f", "f": "g"}}[state["role"]], count=0)
    state["count"] += 1
    if [state["role"], state["count"]] != state["wanted"]:
        return False
    set_limit(resource.RLIMIT_RTTIME, (4711, 4711))
    return True
def wrap(place, name):
    function = getattr(place, name)
    def call(*arguments, **named):
        is_rule = name == "call" and real.ADD_RULE in arguments[1:2]  # there are hundreds, all made in one place
        state["rules"] += is_rule
        if not (is_rule and state["rules"] > 3) and fails(name):
            if name == "call":
                ctypes.set_errno(errno.EPERM)
                return -1
            raise PermissionError(errno.EPERM, "injected")
        return function(*arguments, **named)
    setattr(place, name, call)
for name in (
    "setsid", "chdir", "mkdir", "chown", "setgroups", "setresgid", "setresuid", "pidfd_open", "dup2", "pipe", "fork"
):
    wrap(os, name)
wrapped = os.fork
def fork():
    if os.getpid() == STARTER:
        with open({failing!r}) as file:
            role, count = file.read().split()
        state["wanted"] = [role, int(count)]
    child = wrapped()
    state["forked"] = state["role"] == "w" and child > 0  # what comes later sets up nothing
    return child
os.fork = fork
wrap(fcntl, "fcntl")
wrap(resource, "setrlimit")
wrap(real, "call")
for name in dir(real):
    globals().setdefault(name, getattr(real, name))
"""

#: A worker that starts a program again and again, each time with another call that fails.
FAILING = """
import json, socket, sys
from itertools import count
from pathlib import Path
from grader.runtime.model.limits import Limits
from grader.runtime.recording.codec import from_json
from grader.runtime.ros_installation import PythonRuntime
from grader.runtime.sandbox import start
from grader.runtime.sandbox.protocol import StudentProcess
from grader.runtime.sandbox.tiers import HOST, isolation_from_name
told = json.loads(sys.argv[1])
start.__file__ = told["module"]
from grader.runtime.sandbox.starter import Starter
isolation, runtime = isolation_from_name(told["tier"]), from_json(PythonRuntime, told["runtime"])
arguments = ("-s", "-u", "-c", "import resource; print('ran', resource.getrlimit(resource.RLIMIT_RTTIME)[0])")
process = StudentProcess(runtime, HOST, Path(told["submission"]), arguments, {"ROS_DOMAIN_ID": told["domain"]}, ())
def run(role, number):
    Path(told["failing"]).write_text(f"{role} {number}")
    ours, theirs = socket.socketpair()
    try:
        started = starter.start(
            isolation.prepared_sandbox(process, Limits()), {}, (str(runtime.executable), *arguments), theirs
        )
    except OSError as error:
        return "", str(error), 1
    finally:
        ours.close()
        theirs.close()
    out = started.stdout.read().decode(), started.stderr.read().decode(), started.wait()
    started.close()
    return out
starter = Starter("", runtime, isolation.host_seen_at)
usual, results = run("s", 0), {}
for role in "ws":
    for number in count(1):
        result = run(role, number)
        if result == usual:  # there is no call with this number
            break
        results[f"{role} {number}"] = result
for role, most in told["beside"].items():
    results |= {f"{role} {number}": run(role, number) for number in range(1, most + 1)}
again = run("s", 0)
starter.close()
Path(told["failing"]).unlink()
print(json.dumps([usual, results, again]))
"""
#: How many calls are made by the two processes that watch a folder.
BESIDE = {"f": 2, "g": 7}
TIERS = ("bubblewrap-root", "bubblewrap", "bubblewrap-flat", "bubblewrap-flat-user", "landlock", "landlock-user")


@pytest.fixture(params=tiers(*TIERS))
def sandbox(request: pytest.FixtureRequest, ros: RosInstallation, submission: Path) -> Sandbox:
    return sandbox_or_skip(request.param, ros, submission)


@pytest.mark.breadth(0, 1)
def test_each_call_that_sets_up_a_fork_ends_it_when_it_fails(sandbox: Sandbox) -> None:
    """Sessions, descriptors, folders, limits, users, privileges, namespaces, Landlock and the filter, one by one."""
    module = sandbox.submission / "injecting.py"
    failing = f"/tmp/failing-{secrets.token_hex(8)}"  # the worker's own folder in most tiers
    module.write_text(INJECTING.format(start=start.__file__, failing=failing), encoding="utf-8")
    module.chmod(0o644)
    told = {
        "tier": sandbox.isolation.name,
        "runtime": to_json(sandbox.ros.runtime),
        "submission": str(sandbox.submission),
        "domain": DOMAIN,
        "module": str(module),
        "failing": failing,
        "beside": {} if isinstance(sandbox.isolation, Bubblewrap) else BESIDE,
    }
    argv = (str(sandbox.ros.runtime.executable), "-s", "-B", "-c", FAILING, json.dumps(told))
    try:
        variables = worker_environment(sandbox.ros.runtime, Path("/tmp"))
        usual, results, again = said(finish(sandbox.worker(argv, pass_fds=(), **variables)))
    finally:
        module.unlink()
    assert usual == again
    assert usual[::2] == ["ran -1\n", 0]
    assert {call: result for call, result in results.items() if result[0] or result[2] == 0} == {}
    assert {"w 1", "s 20", *(f"{role} {most}" for role, most in told["beside"].items())} <= set(results)


@pytest.mark.long
def test_a_fork_that_cannot_be_sandboxed_is_no_fault_of_the_node(session: RecordingSession, tmp_path: Path) -> None:
    """Nothing is judged; the reason is the grader's, and the next recording is as usual."""
    tmp_path.chmod(0o755)
    impossible = replace(Limits(), file_bytes="much")  # type: ignore[arg-type]  # no number for the kernel
    trace = record(session, tmp_path / "s", hostile(), limits=impossible)
    assert "a student's process did not start" in trace.harness_problem
    assert trace.observations == ()
    assert len(record(session, tmp_path / "s", hostile()).messages("/cmd_vel")) == 199
