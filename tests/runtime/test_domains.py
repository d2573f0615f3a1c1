"""ROS domains: nobody else on this machine uses the one that is given out."""

from __future__ import annotations

import itertools
import socket
from collections.abc import Iterator

import pytest

from grader.runtime.domains import HELD, USABLE, Reservation, private_domains, shared_domains
from grader.runtime.model.errors import EnvironmentFault


@pytest.fixture
def held() -> Iterator[list[Reservation]]:
    """Claims of one test, which are not held over the next."""
    held: list[Reservation] = []
    yield held
    for _, claim in held:
        claim.close()


def test_in_a_network_of_ones_own_every_scenario_gets_another_domain() -> None:
    """All of them before the first comes again: its ghosts have gone by then."""
    given = list(itertools.islice(private_domains(), len(USABLE) + 1))
    assert sorted(given[:-1]) == list(USABLE)
    assert given[-1] == given[0]


def test_domains_that_are_shared_are_distinct_while_they_are_held(held: list[Reservation]) -> None:
    """Of one grader and of two."""
    one, other = shared_domains(held=held), shared_domains(held=held)
    given = [next(source) for source in (one, other, one, other)]
    assert len(set(given)) == 4
    assert set(given) <= set(USABLE)


def test_a_domain_somebody_talks_on_is_not_given_out(held: list[Reservation]) -> None:
    """Its discovery port is in use, whoever uses it."""
    usable = range(90, 92)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as talker:
        free = [domain for domain in usable if bound(talker, domain)]
        if not free:
            pytest.skip("both domains are in use on this machine")
        source = shared_domains(usable, held)
        (other,) = set(usable) - {free[0]}
        try:
            assert next(source) == other
        except EnvironmentFault:
            pytest.skip("the other domain is in use on this machine")


def bound(talker: socket.socket, domain: int) -> bool:
    """Take a domain's discovery port, if none has been taken yet; return whether it was."""
    try:
        talker.bind(("", 7400 + 250 * domain))
    except OSError:
        return False
    return True


def test_no_free_domain_is_said() -> None:
    """Instead of two graders hearing each other."""
    with pytest.raises(EnvironmentFault, match="expected a free one, found all in use"):
        next(shared_domains(()))


def test_only_the_last_claims_are_held(held: list[Reservation]) -> None:
    """A long class does not run out of domains."""
    source = shared_domains(held=held)
    given = [next(source) for _ in range(HELD + 3)]
    assert [domain for domain, _ in held] == given[3:]
    assert all(claim.fileno() >= 0 for _, claim in held)


def test_ports_of_usable_domains_are_below_those_handed_out() -> None:
    """Linux hands out ports from 32768 on."""
    assert 7400 + 250 * max(USABLE) + 249 < 32768
