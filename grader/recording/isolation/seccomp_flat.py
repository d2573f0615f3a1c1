"""The wider seccomp filter of tiers without namespaces for the student: it shares processes and files with the grader.

Landlock decides which files are opened; it does not hold back calls that change a file by its path without opening it,
that aim at another process by its number, or that connect to a socket by its path. Namespaces did that elsewhere.
"""

from __future__ import annotations

import errno
import platform
import socket

from grader.recording.isolation.seccomp import ARGUMENT_RULES, NO_ERROR, NUMBERS, ArgumentRule, Numbers, assembled
from grader.recording.isolation.start import OWN_PROCESS

OWN_GROUP = -OWN_PROCESS & 0xFFFFFFFF
SET_OWNER, SET_SIGNAL, SET_OWNER_EXTENDED = 8, 10, 15  # fcntl
FIOSETOWN, SIOCSPGRP = 0x8901, 0x8902
IOPRIO_WHO_PROCESS = 1
# The two flags that a type of socket may carry: close on exec, and not to block.
PAIRS = tuple(socket.SOCK_STREAM | flags for flags in (0, 0x800, 0x80000, 0x80800))

FLAT_NUMBERS = {
    **NUMBERS,
    # properties of files, which need no descriptor
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
    # other processes; whoever left the group would outlive it
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
    # sockets with a path
    "socketpair": Numbers(53, 199),
}
FLAT_RULES = (
    *(rule for rule in ARGUMENT_RULES if rule.call not in ("socket", "ioctl")),
    # A pair of streams is connected for good; a datagram could be sent to any path.
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
    # Fast DDS gives each of its threads, by number, the scheduler that it has: done, and nothing is.
    *(ArgumentRule(call, 0, only=(0,), error=NO_ERROR) for call in ("sched_setscheduler", "sched_setparam")),
    # Of a process, and of the calling one: a user or a group has more members.
    *(ArgumentRule("setpriority", argument, only=(0,), error=NO_ERROR) for argument in (0, 1)),
    ArgumentRule("ioprio_set", 0, only=(IOPRIO_WHO_PROCESS,)),
    ArgumentRule("ioprio_set", 1, only=(0,)),
)

# Where Landlock has no say over signals: to itself and its group only, also by the ways the C library does not take.
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
    """Return the filter, an array of `struct sock_filter`.

    Args:
        signals: Whether to refuse signals to other processes; `start.load_filter` then fills in the own number.
        machine: Architecture as `platform.machine()` names it; the running one if None.
    """
    numbers = {**FLAT_NUMBERS, **(SIGNAL_NUMBERS if signals else {})}
    return assembled(numbers, (*FLAT_RULES, *(SIGNAL_RULES if signals else ())), machine or platform.machine())
