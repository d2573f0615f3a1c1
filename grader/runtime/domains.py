"""Lends ROS domains that no other program on this machine uses."""

from __future__ import annotations

import itertools
import random
import socket
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Sequence
from typing import Self

from grader.runtime.model.errors import EnvironmentFault

#: Domains whose ports lie above Linux's ephemeral port range. Nobody writes one of them into a program, so none that
#: chooses a domain of its own is by chance in the one that it should be in.
UNUSUAL = range(215, 232)
#: Domains whose ports lie below that range.
USABLE = range(10, 101)
#: How many reservations to keep of domains that were given back, whose endpoints may not have expired yet.
KEPT = 4
#: A domain, and the socket that keeps it from other graders.
Reservation = tuple[int, socket.socket]


class Domains(ABC):
    """Lends ROS domains to scenarios, none of them to two at a time, until the end of a block."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @abstractmethod
    def close(self) -> None:
        """Let others have all domains."""

    @abstractmethod
    def take(self) -> int:
        """Return a domain that nobody else has; raises EnvironmentFault if there is none."""

    @abstractmethod
    def give_back(self, domain: int) -> None:
        """Let others have a domain."""


def domains_of(*, shared: bool) -> Domains:
    """Return the domains of a network that others use as well, or of a private one."""
    return SharedDomains() if shared else PrivateDomains()


class PrivateDomains(Domains):
    """The domains of a private network: the one that was given back first is the next to be taken.

    Args:
        usable: Domains to choose from; the second ones if the first are taken.
    """

    def __init__(self, usable: Sequence[Sequence[int]] = (UNUSUAL, USABLE)) -> None:
        self._usable = usable
        self._free = [deque(domains) for domains in usable]
        self._lock = threading.Lock()

    def take(self) -> int:
        """Return a domain that nobody else has; raises EnvironmentFault if there is none."""
        with self._lock:
            for free in self._free:
                if free:
                    return free.popleft()
        raise EnvironmentFault("ROS domains: expected a free one, found all in use", "record fewer scenarios at a time")

    def give_back(self, domain: int) -> None:
        """Let others have a domain."""
        with self._lock:
            self._free[[domain in domains for domains in self._usable].index(True)].append(domain)

    def close(self) -> None:
        """Let others have all domains: nobody else is in this network."""


class SharedDomains(Domains):
    """The domains of a network that other graders and other programs use as well.

    Args:
        usable: Domains to choose from; the second ones if the first are in use.
    """

    def __init__(self, usable: Sequence[Sequence[int]] = (UNUSUAL, USABLE)) -> None:
        self._usable = usable
        self._taken: dict[int, socket.socket] = {}
        self._kept: deque[socket.socket] = deque()
        self._lock = threading.Lock()

    def take(self) -> int:
        """Return a domain that nobody uses, and reserve it; raises EnvironmentFault if there is none."""
        domain, claim = _reserve(self._usable)
        with self._lock:
            self._taken[domain] = claim
        return domain

    def give_back(self, domain: int) -> None:
        """Let others have a domain, after some more have been given back."""
        with self._lock:
            self._kept.append(self._taken.pop(domain))
            while len(self._kept) > KEPT:
                self._kept.popleft().close()

    def close(self) -> None:
        """Let others have all domains."""
        for claim in (*self._taken.values(), *self._kept):
            claim.close()


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
