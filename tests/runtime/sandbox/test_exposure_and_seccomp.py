"""The parts of isolation that are pure: the filter of system calls and the view of files."""

import errno
import re
import socket
import struct
from pathlib import Path

import pytest

from grader.runtime.ros_installation import find_ros
from grader.runtime.sandbox import seccomp
from grader.runtime.sandbox.exposure import parents_of, view_of, worker_view

HEADERS = {
    "x86_64": Path("/usr/include/x86_64-linux-gnu/asm/unistd_64.h"),
    "aarch64": Path("/usr/include/asm-generic/unistd.h"),
}
MACHINES = sorted(seccomp.AUDIT_ARCHITECTURES)


def judged(machine: str, number: int, *arguments: int, architecture: int | None = None) -> int:
    """Run the filter as the kernel would and return its verdict."""
    architecture = seccomp.AUDIT_ARCHITECTURES[machine] if architecture is None else architecture
    values = [argument & (1 << 64) - 1 for argument in (*arguments, 0, 0, 0, 0, 0, 0)[:6]]
    data = struct.pack("<IIQ6Q", number, architecture, 0, *values)
    program: list[tuple[int, int, int, int]] = list(struct.iter_unpack("<HBBI", seccomp.student_filter(machine)))
    at = accumulator = 0
    while True:
        code, if_true, if_false, operand = program[at]
        at += 1
        if code == seccomp.RETURN:
            return operand
        if code == seccomp.LOAD:
            accumulator = struct.unpack_from("<I", data, operand)[0]
        elif code == seccomp.JUMP_IF_EQUAL:
            at += if_true if accumulator == operand else if_false
        elif code == seccomp.JUMP_IF_ANY_BIT:
            at += if_true if accumulator & operand else if_false
        else:
            raise AssertionError(code)


def number_of(machine: str, call: str) -> int:
    number: int | None = getattr(seccomp.NUMBERS[call], machine)
    assert number is not None
    return number


def refused(error: int) -> int:
    return seccomp.FAIL_WITH | error


@pytest.mark.parametrize("machine", MACHINES)
def test_the_numbers_are_those_of_the_kernels_headers(machine: str) -> None:
    """Each number in the table is the one the kernel gives the call."""
    if not HEADERS[machine].exists():
        pytest.skip("the kernel's headers are not installed")
    found = re.findall(r"#define __NR(?:3264)?_(\w+)\s+(\d+)", HEADERS[machine].read_text())
    known = {name: int(number) for name, number in found}
    ours = {name: getattr(numbers, machine) for name, numbers in seccomp.NUMBERS.items()}
    assert {name: number for name, number in ours.items() if name in known and known[name] != number} == {}
    unknown = {name for name, number in ours.items() if number is not None and name not in known}
    assert unknown <= {"open_tree_attr", "quotactl_fd", "memfd_secret", "process_mrelease"}, "newer than old headers"


@pytest.mark.parametrize("machine", MACHINES)
def test_calls_without_a_rule_for_arguments_are_refused(machine: str) -> None:
    """Every call of the table that no argument can excuse."""
    by_argument = {rule.call for rule in seccomp.ARGUMENT_RULES}
    for name, numbers in seccomp.NUMBERS.items():
        number = getattr(numbers, machine)
        if number is not None and name not in by_argument:
            error = errno.ENOSYS if name in seccomp.ABSENT else errno.EPERM
            assert judged(machine, number) == refused(error), name


@pytest.mark.parametrize("machine", MACHINES)
def test_other_calls_are_allowed(machine: str) -> None:
    """The filter is a list of what is refused."""
    listed = {getattr(numbers, machine) for numbers in seccomp.NUMBERS.values()}
    assert {judged(machine, number) for number in range(600) if number not in listed} == {seccomp.ALLOW}


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("family", range(64))
def test_only_four_families_of_sockets_exist(machine: str, family: int) -> None:
    """Unix, IPv4, IPv6 and netlink."""
    verdict = seccomp.ALLOW if family in (1, 2, 10, 16) else refused(errno.EAFNOSUPPORT)
    assert judged(machine, number_of(machine, "socket"), family, socket.SOCK_STREAM) == verdict


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("call", ["socket", "socketpair"])
def test_a_local_socket_is_always_connected(machine: str, call: str) -> None:
    """A stream or packets in sequence, with any flags; a datagram would lie in a queue that nothing counts."""
    kinds = {kind for kind in range(1 << 20) if kind & 0xF <= 6 and not kind & 0x7F7F0}
    number = number_of(machine, call)
    allowed = {kind for kind in kinds if judged(machine, number, socket.AF_UNIX, kind) == seccomp.ALLOW}
    assert allowed == {kind for kind in kinds if kind & 0xF in (1, 5)}
    assert judged(machine, number, socket.AF_INET, socket.SOCK_DGRAM) == seccomp.ALLOW


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("bit", range(32))
def test_clone_and_unshare_make_no_namespace(machine: str, bit: int) -> None:
    """A flag of a new namespace is refused, in any company; a thread and a fork are not."""
    namespaces = {17, 25, 26, 27, 28, 29, 30}
    clone = judged(machine, number_of(machine, "clone"), 1 << bit | 17)
    assert clone == (refused(errno.EPERM) if bit in namespaces else seccomp.ALLOW)
    unshare = judged(machine, number_of(machine, "unshare"), 1 << bit)
    assert unshare == (refused(errno.EPERM) if bit in namespaces | {7} else seccomp.ALLOW)


@pytest.mark.parametrize("machine", MACHINES)
def test_the_terminal_cannot_be_typed_to(machine: str) -> None:
    """The upper half of the argument, which the kernel ignores, does not help."""
    ioctl = number_of(machine, "ioctl")
    assert judged(machine, ioctl, 0, 0x5412) == refused(errno.EPERM)
    assert judged(machine, ioctl, 0, 0x5412 | 1 << 40) == refused(errno.EPERM)
    assert judged(machine, ioctl, 0, 0x541C) == refused(errno.EPERM)
    assert judged(machine, ioctl, 0, 0x5401) == seccomp.ALLOW


@pytest.mark.parametrize("machine", MACHINES)
def test_only_own_limits_can_be_set(machine: str) -> None:
    """The process itself is number 0."""
    prlimit = number_of(machine, "prlimit64")
    assert judged(machine, prlimit, 0) == seccomp.ALLOW
    assert judged(machine, prlimit, 1) == refused(errno.EPERM)


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize(("family", "allowed"), [(1, set(range(300))), (2, {0, 6, 17}), (10, {0, 6, 17}), (16, {0})])
def test_each_family_of_sockets_has_its_usual_protocols(machine: str, family: int, allowed: set[int]) -> None:
    """TCP and UDP, and the interfaces; not SCTP, MPTCP, or the configuration of encryption and packet filters."""
    number = number_of(machine, "socket")
    found = {protocol for protocol in range(300) if judged(machine, number, family, 1, protocol) == seccomp.ALLOW}
    assert found == allowed


@pytest.mark.parametrize("machine", MACHINES)
def test_a_socket_keeps_the_size_of_its_buffers(machine: str) -> None:
    """The call does nothing, and reports success; other options and levels are not touched."""
    number = number_of(machine, "setsockopt")
    refusals = {
        (level, option)
        for level in (0, 1, 6, 41)
        for option in range(80)
        if judged(machine, number, 9, level, option) != seccomp.ALLOW
    }
    assert refusals == {(1, 7), (1, 8), (1, 32), (1, 33)}
    assert judged(machine, number, 9, 1, 7) == refused(seccomp.NO_ERROR)


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("bit", range(32))
def test_no_memory_comes_from_the_machines_huge_pages(machine: str, bit: int) -> None:
    """The call fails as it does where there are none; every other flag is allowed."""
    verdict = judged(machine, number_of(machine, "mmap"), 0, 4096, 3, 1 << bit)
    assert verdict == (refused(errno.ENOMEM) if bit == 18 else seccomp.ALLOW)


@pytest.mark.parametrize("machine", MACHINES)
def test_another_architecture_is_the_end(machine: str) -> None:
    """32-bit calls have other numbers."""
    assert judged(machine, 1, architecture=0x40000003) == seccomp.KILL_PROCESS


def test_the_x32_numbers_do_not_exist() -> None:
    """They would walk around every rule."""
    assert judged("x86_64", 0x40000000 | 41, 40) == refused(errno.ENOSYS)


def test_a_filter_fits_into_the_kernel() -> None:
    """At most 4,096 instructions are loaded."""
    assert all(len(seccomp.student_filter(machine)) // 8 < 512 for machine in MACHINES)
    assert not seccomp.supports("riscv64")


# --- view ---


@pytest.fixture
def there(tmp_path: Path) -> Path:
    """A temporary folder without links on the way to it."""
    return tmp_path.resolve()


def test_every_link_on_the_way_is_in_the_view(there: Path) -> None:
    """An interpreter that is a link to a link in a folder that is a link, as uv and pyenv make them."""
    real = there / "python-3.12.5" / "bin" / "python3.12"
    real.parent.mkdir(parents=True)
    real.touch()
    (there / "python-3.12").symlink_to("python-3.12.5")
    (there / "venv" / "bin").mkdir(parents=True)
    (there / "venv" / "bin" / "python3").symlink_to(there / "python-3.12" / "bin" / "python3.12")
    (there / "venv" / "bin" / "python").symlink_to("python3")
    view = view_of([there / "venv" / "bin" / "python"])
    assert view.bound == (real,)
    assert dict(view.links) == {
        there / "venv" / "bin" / "python": "python3",
        there / "venv" / "bin" / "python3": str(there / "python-3.12" / "bin" / "python3.12"),
        there / "python-3.12": "python-3.12.5",
    }
    assert {there, there / "venv", there / "venv" / "bin", real.parent} <= set(view.parents())


def test_what_lies_in_a_bound_folder_is_bound_once(there: Path) -> None:
    """Nested paths and links inside need nothing of their own."""
    (there / "lib" / "python").mkdir(parents=True)
    (there / "lib" / "link").symlink_to("python")
    view = view_of([there / "lib" / "python", there / "lib", there / "lib" / "link"])
    assert (view.bound, view.links) == ((there / "lib",), ())


def test_a_neighbour_with_a_longer_name_is_no_child(there: Path) -> None:
    """/lib64 is not inside /lib."""
    for name in ("lib", "lib64", "lib-extra"):
        (there / name).mkdir()
    assert len(view_of([there / "lib", there / "lib64", there / "lib-extra"]).bound) == 3


def test_what_leads_nowhere_is_left_out(there: Path) -> None:
    """Missing paths, dangling links and links in a circle."""
    (there / "dangling").symlink_to("nowhere")
    (there / "round").symlink_to("about")
    (there / "about").symlink_to("round")
    view = view_of([there / "missing", there / "dangling", there / "round"])
    assert (view.bound, view.links) == ((), ())


def test_a_link_upwards_is_followed(there: Path) -> None:
    """Relative targets with two dots."""
    (there / "a" / "b").mkdir(parents=True)
    (there / "c").mkdir()
    (there / "a" / "b" / "up").symlink_to("../../c")
    assert view_of([there / "a" / "b" / "up"]).bound == (there / "c",)


def test_parents_come_before_their_children() -> None:
    """In this order they can be made."""
    folders = parents_of([Path("/a/b/c/d"), Path("/a/x")])
    assert folders == (Path("/a"), Path("/a/b"), Path("/a/b/c"))


def test_what_a_worker_has_of_the_grader_is_there(tmp_path: Path) -> None:
    """A part that has moved would be left out without a word."""
    own = worker_view(find_ros().runtime, tmp_path).own
    assert [path for path in own if not path.exists()] == []
