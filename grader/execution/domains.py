"""ROS domains that nobody else on this machine uses."""

from __future__ import annotations

import itertools
import random
import socket
from collections.abc import Iterator

from grader.core.errors import EnvironmentFault

#: Domains whose ports lie below the range that Linux hands out to others.
USABLE = range(10, 101)
#: So many claims are held: those of the scenarios under way, and of a few before them until their ghosts have gone.
HELD = 8


def private_domains() -> Iterator[int]:
    """Yield domains for a network of one's own: each scenario gets another one, and sees no ghost of the last."""
    return itertools.cycle(USABLE)


def shared_domains() -> Iterator[int]:
    """Yield domains on a network shared with others: each is reserved among graders and seen to be unused.

    Raises:
        EnvironmentFault: If none is free.
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


#: Claims that are still held, oldest first.
_RESERVED: list[tuple[int, socket.socket]] = []
