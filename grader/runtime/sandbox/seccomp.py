"""Seccomp filters for student processes, as bytes for the kernel."""

from __future__ import annotations

import errno
import platform
import socket
import struct
from collections.abc import Mapping, Sequence
from functools import cache

from grader.runtime.model.dataclass import dataclass
from grader.runtime.sandbox.start import OWN_PROCESS

LOAD = 0x20  # BPF_LD | BPF_W | BPF_ABS
JUMP_IF_EQUAL = 0x15  # BPF_JMP | BPF_JEQ | BPF_K
JUMP_IF_ANY_BIT = 0x45  # BPF_JMP | BPF_JSET | BPF_K
RETURN = 0x06  # BPF_RET | BPF_K

ALLOW = 0x7FFF0000
FAIL_WITH = 0x00050000
KILL_PROCESS = 0x80000000

NUMBER_AT, ARCHITECTURE_AT, ARGUMENTS_AT = 0, 4, 16
X32_BIT = 0x40000000

AUDIT_ARCHITECTURES = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}

# Flags of clone and unshare: new mount, cgroup, uts, ipc, user, pid and network namespaces; unshare can also create a
# time namespace.
NEW_NAMESPACES = 0x00020000 | 0x02000000 | 0x04000000 | 0x08000000 | 0x10000000 | 0x20000000 | 0x40000000
NEW_TIME_NAMESPACE = 0x00000080

TIOCSTI, TIOCLINUX = 0x5412, 0x541C

# fcntl: locks of a process and of a descriptor, each with and without waiting; leases, directory notifications and
# the size of a pipe, which counts towards what all pipes of the user may hold
SET_LOCKS = (6, 7, 37, 38)
SET_LEASE, NOTIFY, SET_PIPE_SIZE = 1024, 1026, 1031
# setsockopt: the sizes of the two buffers of a socket, also for privileged callers (asm-generic/socket.h)
SOL_SOCKET = 1
BUFFER_SIZES = (7, 8, 32, 33)
#: mmap with huge pages, which come from a pool of the machine.
MAP_HUGETLB = 0x40000
#: The protocol of netlink that tells interfaces and addresses; others configure encryption or packet filters.
NETLINK_ROUTE = 0
# The two flags that a socket type may include: close on exec, and non-blocking.
KIND_FLAGS = (0, 0x800, 0x80000, 0x80800)
#: Kinds of sockets that send only to the one that they are connected to.
CONNECTED_KINDS = tuple(kind | flags for kind in (socket.SOCK_STREAM, socket.SOCK_SEQPACKET) for flags in KIND_FLAGS)
#: A call refused with this number does nothing but reports success.
NO_ERROR = 0


@dataclass(frozen=True, slots=True)
class Numbers:
    """The numbers of one system call; None if an architecture does not have it."""

    x86_64: int | None
    aarch64: int | None

    def on(self, machine: str) -> int | None:
        """Return the number on an architecture."""
        return self.x86_64 if machine == "x86_64" else self.aarch64


@dataclass(frozen=True, slots=True)
class ArgumentRule:
    """Refuses a system call depending on the low 32 bits of one argument, and where given on the value of another."""

    call: str  # key of `NUMBERS`
    argument: int  # index of the argument
    only: tuple[int, ...] = ()  # the values allowed; empty if all are
    never: tuple[int, ...] = ()  # the values refused
    never_bits: int = 0  # refused if any of these bits is set
    error: int = errno.EPERM  # the errno that the caller gets
    when: tuple[int, int] | None = None  # index and value of another argument without which nothing is refused


ARGUMENT_RULES = (
    ArgumentRule(
        "socket", 0, only=(socket.AF_UNIX, socket.AF_INET, socket.AF_INET6, socket.AF_NETLINK), error=errno.EAFNOSUPPORT
    ),
    # A datagram of AF_UNIX lies in a queue that nothing counts after its sender is gone; a stream has one sender.
    *(
        ArgumentRule(call, 1, only=CONNECTED_KINDS, error=errno.EPROTONOSUPPORT, when=(0, socket.AF_UNIX))
        for call in ("socket", "socketpair")
    ),
    # Rare protocols would load modules into the kernel; ROS, Python and the name resolver use none of them.
    *(
        ArgumentRule("socket", 2, only=only, error=errno.EPROTONOSUPPORT, when=(0, family))
        for family, only in (
            (socket.AF_INET, (0, socket.IPPROTO_TCP, socket.IPPROTO_UDP)),
            (socket.AF_INET6, (0, socket.IPPROTO_TCP, socket.IPPROTO_UDP)),
            (socket.AF_NETLINK, (NETLINK_ROUTE,)),
        )
    ),
    # A socket keeps its usual buffers, so that the number of sockets bounds the memory in them. The call succeeds
    # without effect, as the kernel itself cuts sizes without an error.
    ArgumentRule("setsockopt", 2, never=BUFFER_SIZES, error=NO_ERROR, when=(1, SOL_SOCKET)),
    ArgumentRule("mmap", 3, never_bits=MAP_HUGETLB, error=errno.ENOMEM),
    ArgumentRule("clone", 0, never_bits=NEW_NAMESPACES),
    ArgumentRule("unshare", 0, never_bits=NEW_NAMESPACES | NEW_TIME_NAMESPACE),
    ArgumentRule("ioctl", 1, never=(TIOCSTI, TIOCLINUX)),
    ArgumentRule("prlimit64", 0, only=(0,)),
    # Shared files must not carry data from one student to another. Locks succeed without effect: the processes that
    # they would exclude see different files anyway.
    ArgumentRule("flock", 1, never_bits=0xFFFFFFFF, error=NO_ERROR),
    ArgumentRule("fcntl", 1, never=SET_LOCKS, error=NO_ERROR),
    ArgumentRule("fcntl", 1, never=(SET_LEASE, NOTIFY, SET_PIPE_SIZE)),
)

# Grouped by purpose. A filter cannot read the struct that clone3 takes, so clone3 is reported as missing, and the C
# library uses clone instead.
NUMBERS = {
    "socket": Numbers(41, 198),
    "socketpair": Numbers(53, 199),
    "clone": Numbers(56, 220),
    "unshare": Numbers(272, 97),
    "ioctl": Numbers(16, 29),
    "prlimit64": Numbers(302, 261),
    "flock": Numbers(73, 32),
    "fcntl": Numbers(72, 25),
    "setsockopt": Numbers(54, 208),
    "mmap": Numbers(9, 222),
    "clone3": Numbers(435, 435),
    "setns": Numbers(308, 268),
    # other processes
    "ptrace": Numbers(101, 117),
    "process_vm_readv": Numbers(310, 270),
    "process_vm_writev": Numbers(311, 271),
    "process_madvise": Numbers(440, 440),
    "process_mrelease": Numbers(448, 448),
    "kcmp": Numbers(312, 272),
    "pidfd_getfd": Numbers(438, 438),
    # keyrings outlive the process and belong to the user
    "add_key": Numbers(248, 217),
    "request_key": Numbers(249, 218),
    "keyctl": Numbers(250, 219),
    # mounts
    "mount": Numbers(165, 40),
    "umount2": Numbers(166, 39),
    "pivot_root": Numbers(155, 41),
    "chroot": Numbers(161, 51),
    "open_tree": Numbers(428, 428),
    "open_tree_attr": Numbers(467, 467),
    "move_mount": Numbers(429, 429),
    "fsopen": Numbers(430, 430),
    "fsconfig": Numbers(431, 431),
    "fsmount": Numbers(432, 432),
    "fspick": Numbers(433, 433),
    "mount_setattr": Numbers(442, 442),
    "open_by_handle_at": Numbers(304, 265),
    "name_to_handle_at": Numbers(303, 264),
    "fanotify_init": Numbers(300, 262),
    "quotactl": Numbers(179, 60),
    "quotactl_fd": Numbers(443, 443),
    # large kernel interfaces
    "bpf": Numbers(321, 280),
    "perf_event_open": Numbers(298, 241),
    "userfaultfd": Numbers(323, 282),
    "io_uring_setup": Numbers(425, 425),
    "io_uring_enter": Numbers(426, 426),
    "io_uring_register": Numbers(427, 427),
    "modify_ldt": Numbers(154, None),
    "ioperm": Numbers(173, None),
    "iopl": Numbers(172, None),
    # counters that the user or the machine has only once: instances of inotify, and requests for asynchronous I/O
    "inotify_init": Numbers(253, None),
    "inotify_init1": Numbers(294, 26),
    "inotify_add_watch": Numbers(254, 27),
    "io_setup": Numbers(206, 0),
    # memory that no limit of a process counts; a set of Landlock rules may have any size
    "vmsplice": Numbers(278, 75),
    "landlock_create_ruleset": Numbers(444, 444),
    "landlock_add_rule": Numbers(445, 445),
    "landlock_restrict_self": Numbers(446, 446),
    "shmget": Numbers(29, 194),
    "msgget": Numbers(68, 186),
    "semget": Numbers(64, 190),
    "memfd_secret": Numbers(447, 447),
    "memfd_create": Numbers(319, 279),
    "mq_open": Numbers(240, 180),
    # the machine
    "kexec_load": Numbers(246, 104),
    "kexec_file_load": Numbers(320, 294),
    "init_module": Numbers(175, 105),
    "finit_module": Numbers(313, 273),
    "delete_module": Numbers(176, 106),
    "reboot": Numbers(169, 142),
    "swapon": Numbers(167, 224),
    "swapoff": Numbers(168, 225),
    "acct": Numbers(163, 89),
    "settimeofday": Numbers(164, 170),
    "clock_settime": Numbers(227, 112),
    "clock_adjtime": Numbers(305, 266),
    "syslog": Numbers(103, 116),
    "vhangup": Numbers(153, 58),
}
#: Calls that an older kernel may lack; programs then do without them.
ABSENT = (
    *("clone3", "memfd_create", "io_uring_setup", "io_uring_enter", "io_uring_register"),
    *("inotify_init", "inotify_init1", "inotify_add_watch", "io_setup", "vmsplice"),
    *("landlock_create_ruleset", "landlock_add_rule", "landlock_restrict_self"),
)


def supports(machine: str) -> bool:
    """Return whether there is a filter for an architecture, named as by `platform.machine()`."""
    return machine in AUDIT_ARCHITECTURES


@cache
def student_filter(machine: str | None = None) -> bytes:
    """Return the filter for student processes with their own namespaces, an array of `struct sock_filter`.

    Without a machine it is for this one. Raises KeyError for an unknown architecture; call `supports` first.
    """
    return assembled(NUMBERS, ARGUMENT_RULES, machine or platform.machine())


def assembled(table: Mapping[str, Numbers], rules: Sequence[ArgumentRule], machine: str) -> bytes:
    """Return a filter that refuses each call in a table; calls with rules are refused only for some arguments."""
    program = [
        _instruction(LOAD, ARCHITECTURE_AT),
        _instruction(JUMP_IF_EQUAL, AUDIT_ARCHITECTURES[machine], if_true=1),
        _instruction(RETURN, KILL_PROCESS),
        _instruction(LOAD, NUMBER_AT),
    ]
    if machine == "x86_64":
        # The x32 interface has the same architecture value but other call numbers, so it would bypass every rule.
        program += [_instruction(JUMP_IF_ANY_BIT, X32_BIT, if_false=1), _fail(errno.ENOSYS)]
    by_argument = {rule.call for rule in rules}
    for call, numbers in table.items():
        number = numbers.on(machine)
        if number is None or call in by_argument:
            continue
        error = errno.ENOSYS if call in ABSENT else errno.EPERM
        program += [_instruction(JUMP_IF_EQUAL, number, if_false=1), _fail(error)]
    for rule in rules:
        program += _argument_rule(rule, table[rule.call].on(machine))
    program.append(_instruction(RETURN, ALLOW))
    return b"".join(program)


def _argument_rule(rule: ArgumentRule, number: int | None) -> list[bytes]:
    """Return the instructions of a rule; if it does not refuse the call, it loads the call number for the next rule."""
    if number is None:
        return []
    refusals: list[bytes] = []
    for value in rule.never:
        refusals += [_instruction(JUMP_IF_EQUAL, value, if_false=1), _fail(rule.error)]
    if rule.never_bits:
        refusals += [_instruction(JUMP_IF_ANY_BIT, rule.never_bits, if_false=1), _fail(rule.error)]
    if rule.only:
        left = range(len(rule.only), 0, -1)
        refusals += [
            _instruction(JUMP_IF_EQUAL, value, if_true=jump) for value, jump in zip(rule.only, left, strict=True)
        ]
        refusals.append(_fail(rule.error))
    body = [_argument(rule.argument), *refusals]
    if rule.when is not None:
        argument, value = rule.when
        body = [_argument(argument), _instruction(JUMP_IF_EQUAL, value, if_false=len(body)), *body]
    body.append(_instruction(LOAD, NUMBER_AT))
    return [_instruction(JUMP_IF_EQUAL, number, if_false=len(body)), *body]


def _argument(index: int) -> bytes:
    """Return the instruction that loads the low half of an argument; it comes first on both architectures."""
    return _instruction(LOAD, ARGUMENTS_AT + 8 * index)


def _fail(error: int) -> bytes:
    return _instruction(RETURN, FAIL_WITH | error)


def _instruction(code: int, operand: int, *, if_true: int = 0, if_false: int = 0) -> bytes:
    return struct.pack("<HBBI", code, if_true, if_false, operand)


OWN_GROUP = -OWN_PROCESS & 0xFFFFFFFF
SET_OWNER, SET_SIGNAL, SET_OWNER_EXTENDED = 8, 10, 15  # fcntl
FIOSETOWN, SIOCSPGRP = 0x8901, 0x8902
IOPRIO_WHO_PROCESS = 1
PAIRS = tuple(socket.SOCK_STREAM | flags for flags in KIND_FLAGS)

FLAT_NUMBERS = {
    **NUMBERS,
    # attributes of files, which can be changed without a descriptor
    "chmod": Numbers(90, None),
    "fchmod": Numbers(91, 52),
    "fchmodat": Numbers(268, 53),
    "fchmodat2": Numbers(452, 452),
    "chown": Numbers(92, None),
    "lchown": Numbers(94, None),
    "fchown": Numbers(93, 55),
    "fchownat": Numbers(260, 54),
    "utime": Numbers(132, None),
    "utimes": Numbers(235, None),
    "futimesat": Numbers(261, None),
    "utimensat": Numbers(280, 88),
    "setxattr": Numbers(188, 5),
    "lsetxattr": Numbers(189, 6),
    "fsetxattr": Numbers(190, 7),
    "setxattrat": Numbers(463, 463),
    "removexattr": Numbers(197, 14),
    "lremovexattr": Numbers(198, 15),
    "fremovexattr": Numbers(199, 16),
    "removexattrat": Numbers(466, 466),
    "file_setattr": Numbers(469, 469),
    # other processes; a process that leaves the group would outlive it
    "setsid": Numbers(112, 157),
    "setpgid": Numbers(109, 154),
    "pidfd_open": Numbers(434, 434),
    "pidfd_send_signal": Numbers(424, 424),
    "migrate_pages": Numbers(256, 238),
    "move_pages": Numbers(279, 239),
    "sched_setaffinity": Numbers(203, 122),
    "sched_setscheduler": Numbers(144, 119),
    "sched_setparam": Numbers(142, 118),
    "sched_setattr": Numbers(314, 274),
    "setpriority": Numbers(141, 140),
    "ioprio_set": Numbers(251, 30),
}
FLAT_RULES = (
    *(rule for rule in ARGUMENT_RULES if (rule.call, rule.argument) != ("socket", 0) and rule.call != "ioctl"),
    # A pair of stream sockets stays connected; a datagram socket could send to any path.
    ArgumentRule("socket", 0, only=(socket.AF_INET, socket.AF_INET6, socket.AF_NETLINK), error=errno.EAFNOSUPPORT),
    ArgumentRule("socketpair", 1, only=PAIRS, error=errno.EOPNOTSUPP),
    *(
        ArgumentRule("ioctl", 1, never=(*rule.never, FIOSETOWN, SIOCSPGRP))
        for rule in ARGUMENT_RULES
        if rule.call == "ioctl"
    ),
    ArgumentRule("fcntl", 1, never=(SET_OWNER, SET_SIGNAL, SET_OWNER_EXTENDED)),
    *(ArgumentRule(call, 0, only=(0,)) for call in ("sched_setaffinity", "sched_setattr", "migrate_pages")),
    ArgumentRule("move_pages", 0, only=(0,)),
    # Fast DDS sets each of its threads, by number, to the scheduler that it already has: this succeeds without effect.
    *(ArgumentRule(call, 0, only=(0,), error=NO_ERROR) for call in ("sched_setscheduler", "sched_setparam")),
    # Only for the calling process: a user or a group has more members.
    *(ArgumentRule("setpriority", argument, only=(0,), error=NO_ERROR) for argument in (0, 1)),
    ArgumentRule("ioprio_set", 0, only=(IOPRIO_WHO_PROCESS,)),
    ArgumentRule("ioprio_set", 1, only=(0,)),
)

# If Landlock cannot restrict signals: only to the process itself and its group, also by calls that the C library does
# not use.
SIGNAL_NUMBERS = {
    "kill": Numbers(62, 129),
    "tkill": Numbers(200, 130),
    "tgkill": Numbers(234, 131),
    "rt_sigqueueinfo": Numbers(129, 138),
    "rt_tgsigqueueinfo": Numbers(297, 240),
}
SIGNAL_RULES = (
    ArgumentRule("kill", 0, only=(0, OWN_PROCESS, OWN_GROUP)),
    *(ArgumentRule(call, 0, only=(OWN_PROCESS,)) for call in ("tgkill", "rt_sigqueueinfo", "rt_tgsigqueueinfo")),
)


def flat_filter(*, signals: bool, machine: str | None = None) -> bytes:
    """Return the filter for student processes without their own namespaces, an array of `struct sock_filter`.

    With `signals` it refuses signals to other processes; `start.load_filter` then inserts the process's number.
    """
    numbers = {**FLAT_NUMBERS, **(SIGNAL_NUMBERS if signals else {})}
    return assembled(numbers, (*FLAT_RULES, *(SIGNAL_RULES if signals else ())), machine or platform.machine())
