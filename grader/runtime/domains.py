"""Finds ROS domains that no other program on this machine uses."""

from __future__ import annotations

import itertools
import random
import socket
from collections.abc import Iterator, Sequence

from grader.runtime.model.errors import EnvironmentFault

#: Domains whose ports lie above Linux's ephemeral port range. Nobody writes one of them into a program, so none that
#: chooses a domain of its own is by chance in the one that it should be in.
UNUSUAL = range(215, 232)
#: Domains whose ports lie below that range.
USABLE = range(10, 101)
#: How many reservations to keep: for the running scenarios, and for earlier ones whose endpoints have not yet expired.
HELD = 8
#: A domain, and the socket that keeps it from other graders.
Reservation = tuple[int, socket.socket]
#: The reservations that this process holds, oldest first.
_RESERVED: list[Reservation] = []


def private_domains() -> Iterator[int]:
    """Yield domains in a private network, a different one each time: a scenario sees no endpoints of the last one."""
    return itertools.cycle(UNUSUAL)


def shared_domains(
    usable: Sequence[Sequence[int]] = (UNUSUAL, USABLE), held: list[Reservation] = _RESERVED
) -> Iterator[int]:
    """Yield domains on a shared network; each is unused and reserved against other graders.

    Args:
        usable: Domains to choose from; the second ones if the first are in use.
        held: Where reservations are kept, at most `HELD`, oldest first; those of all callers by default.

    Raises:
        EnvironmentFault: No domain is free.
    """
    while True:
        held.append(_reserve(usable))
        for _, claim in held[:-HELD]:
            claim.close()
        del held[:-HELD]
        yield held[-1][0]


def _reserve(usable: Sequence[Sequence[int]]) -> Reservation:
    for domain in itertools.chain.from_iterable(random.sample(domains, len(domains)) for domains in usable):
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            claim.bind(f"\0rclpy-grader-domain-{domain}")
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                # RTPS 2.2, section 9.6.1.1: domain d discovers on port 7400 + 250 d.
                probe.bind(("", 7400 + 250 * domain))
        except OSError:
            claim.close()
            continue
        return domain, claim
    raise EnvironmentFault("ROS domains: expected a free one, found all in use", "wait for other gradings to end")
