"""ROS domains: nobody else on this machine uses the one that is given out."""

from __future__ import annotations

import itertools
import socket
from collections.abc import Iterator

import pytest

from grader.runtime import domains as module
from grader.runtime.domains import USABLE, private_domains, shared_domains
from grader.runtime.model.errors import EnvironmentFault


@pytest.fixture(autouse=True)
def give_back(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Claims of one test are not held over the next."""
    held: list[tuple[int, socket.socket]] = []
    monkeypatch.setattr(module, "_RESERVED", held)
    yield
    for _, claim in held:
        claim.close()


def test_in_a_network_of_ones_own_every_scenario_gets_another_domain() -> None:
    """All of them before the first comes again: its ghosts have gone by then."""
    given = list(itertools.islice(private_domains(), len(USABLE) + 1))
    assert sorted(given[:-1]) == list(USABLE)
    assert given[-1] == given[0]


def test_domains_that_are_shared_are_distinct_while_they_are_held() -> None:
    """Of one grader and of two."""
    one, other = shared_domains(), shared_domains()
    given = [next(source) for source in (one, other, one, other)]
    assert len(set(given)) == 4
    assert set(given) <= set(USABLE)


def test_a_domain_somebody_talks_on_is_not_given_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its discovery port is in use, whoever uses it."""
    monkeypatch.setattr(module, "USABLE", range(90, 92))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as talker:
        free = [domain for domain in module.USABLE if bound(talker, domain)]
        if not free:
            pytest.skip("both domains are in use on this machine")
        source = shared_domains()
        (other,) = set(module.USABLE) - {free[0]}
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


def test_no_free_domain_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """Instead of two graders hearing each other."""
    monkeypatch.setattr(module, "USABLE", range(0))
    with pytest.raises(EnvironmentFault, match="expected a free one, found all in use"):
        next(shared_domains())


def test_only_the_last_claims_are_held() -> None:
    """A long class does not run out of domains."""
    source = shared_domains()
    given = [next(source) for _ in range(module.HELD + 3)]
    assert [domain for domain, _ in module._RESERVED] == given[3:]
    assert all(claim.fileno() >= 0 for _, claim in module._RESERVED)


def test_ports_of_usable_domains_are_below_those_handed_out() -> None:
    """Linux hands out ports from 32768 on."""
    assert 7400 + 250 * max(USABLE) + 249 < 32768
