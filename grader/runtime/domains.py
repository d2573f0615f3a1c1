"""Finds ROS domains that no other program on this machine uses."""

from __future__ import annotations

import itertools
import random
import socket
from collections.abc import Iterator

from grader.runtime.model.errors import EnvironmentFault

#: Domains whose ports lie below Linux's ephemeral port range.
USABLE = range(10, 101)
#: How many reservations to keep: for the running scenarios, and for earlier ones whose endpoints have not yet expired.
HELD = 8


def private_domains() -> Iterator[int]:
    """Yield domains in a private network, a different one each time: a scenario sees no endpoints of the last one."""
    return itertools.cycle(USABLE)


def shared_domains() -> Iterator[int]:
    """Yield domains on a shared network; each is unused and reserved against other graders.

    Raises:
        EnvironmentFault: No domain is free.
    """
    while True:
        _RESERVED.append(_reserve())
        for _, claim in _RESERVED[:-HELD]:
            claim.close()
        del _RESERVED[:-HELD]
        yield _RESERVED[-1][0]


def _reserve() -> tuple[int, socket.socket]:
    for domain in random.sample(USABLE, len(USABLE)):
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


#: Reservations that are still held, oldest first.
_RESERVED: list[tuple[int, socket.socket]] = []
