"""Control groups for workers: made where the kernel and the user allow it, removed with the worker, never required."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from hostile import hostile, record, staging

from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import MIB
from grader.runtime.session import open_session
from grader.runtime.supervisor.memory_groups import PREFIX, MemoryGroup, _places, make_group

V1 = "35 31 0:32 {root} {at} rw - cgroup cgroup rw,memory\n36 31 0:33 / {at}/cpu rw - cgroup cgroup rw,cpu\n"
V2 = "40 31 0:40 / {at} rw - cgroup2 cgroup2 rw\n"


def process(folder: Path, groups: str, mounts: str) -> Path:
    proc = folder / "proc"
    proc.mkdir()
    (proc / "cgroup").write_text(groups)
    (proc / "mountinfo").write_text(mounts)
    return proc


def test_version_1_has_groups_below_that_of_this_process(tmp_path: Path) -> None:
    """Also in a container, which sees only a part of the hierarchy."""
    groups = "4:memory:/docker/abc/own\n1:cpu:/x\n0::/\n"
    proc = process(tmp_path, groups, V1.format(root="/docker/abc", at=tmp_path))
    assert _places(proc) == [(tmp_path / "own", "memory.limit_in_bytes")]


def test_version_2_has_groups_beside_that_of_this_process(tmp_path: Path) -> None:
    """If the group above passes limits of memory on: one that has processes cannot do that."""
    proc = process(tmp_path, "0::/app.slice/terminal.scope\n", V2.format(at=tmp_path))
    (tmp_path / "app.slice" / "terminal.scope").mkdir(parents=True)
    assert _places(proc) == []
    (tmp_path / "app.slice" / "cgroup.subtree_control").write_text("cpu memory pids\n")
    assert _places(proc) == [(tmp_path / "app.slice", "memory.max")]


def test_without_control_groups_there_is_none(tmp_path: Path) -> None:
    """No file of the kernel, no such mount, a folder that takes no group, or a group without a limit."""
    assert make_group(proc=tmp_path) is None
    proc = process(tmp_path, "4:memory:/own\n", V1.format(root="/", at=tmp_path))
    assert make_group(proc=proc) is None
    (tmp_path / "own").mkdir()
    assert make_group(proc=proc) is None
    assert list((tmp_path / "own").iterdir()) == []


def test_a_command_goes_on_where_the_group_is_gone(tmp_path: Path) -> None:
    """It becomes the command, with its arguments, in the same process."""
    argv = MemoryGroup(tmp_path / "gone", "memory.max", 1).inside(["sh", "-c", 'echo $$ "$1"', "sh", "a  b"])
    with subprocess.Popen(argv, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
        out, errors = run.communicate()
    assert (out, errors) == (f"{run.pid} a  b\n", "")


def test_the_limit_is_that_of_the_largest_plan(tmp_path: Path) -> None:
    """Of all workers together, each with its nodes, and it never shrinks: another fork may need more."""
    group = MemoryGroup(tmp_path, "memory.max", 3)
    group.make_room(Limits(memory_bytes=512 * MIB), 2)
    first = int((tmp_path / "memory.max").read_text())
    assert first > 3 * 2 * 512 * MIB
    group.make_room(Limits(memory_bytes=128 * MIB), 1)
    assert int((tmp_path / "memory.max").read_text()) == first
    group.make_room(Limits(memory_bytes=1024 * MIB), 2)
    assert int((tmp_path / "memory.max").read_text()) > first


@pytest.fixture
def parent() -> Path:
    group = make_group()
    if group is None:
        pytest.skip("this user can make no control group of memory here")
    group.remove()
    assert not group.folder.exists()
    return group.folder.parent


def test_the_kernel_counts_what_a_group_holds(parent: Path) -> None:
    """Also in sockets: the processes in the group are those of the command."""
    group = make_group()
    assert group is not None
    told = subprocess.run(group.inside(["cat", "/proc/self/cgroup"]), capture_output=True, text=True, check=True)
    assert group.folder.name in told.stdout
    group.remove()
    assert not group.folder.exists()


def test_a_group_of_a_killed_grader_is_removed_by_the_next(parent: Path) -> None:
    """It has the pid of a process that there is no more; that of a running one stays."""
    dead, alive = parent / f"{PREFIX}999999999-00", parent / f"{PREFIX}{os.getppid()}-00"
    dead.mkdir()
    alive.mkdir()
    try:
        group = make_group()
        assert group is not None
        group.remove()
        assert (dead.exists(), alive.exists()) == (False, True)
    finally:
        alive.rmdir()


@pytest.mark.ros
def test_a_session_leaves_no_group(parent: Path, tmp_path: Path) -> None:
    """Its workers and their nodes are in groups while it records."""
    tmp_path.chmod(0o755)
    before = {*parent.glob(f"{PREFIX}{os.getpid()}-*")}
    with open_session("auto", 1) as session:
        trace = record(staging(session), tmp_path / "s", hostile(), duration_ns=1_000_000_000)
        made = {*parent.glob(f"{PREFIX}{os.getpid()}-*")} - before
        assert made
        assert all((group / "cgroup.procs").read_text() for group in made)
    assert trace.messages("/cmd_vel")
    assert {*parent.glob(f"{PREFIX}{os.getpid()}-*")} == before
