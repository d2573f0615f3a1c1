"""ROS domains: nobody else on this machine uses the one that is given out."""

from __future__ import annotations

import contextlib
import socket
from pathlib import Path
from typing import Any

import pytest
from side_by_side import rows_of
from tiers import LONG, NIGHTLY

from grader.runtime.domains import KEPT, UNUSUAL, USABLE, PrivateDomains, SharedDomains
from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import Trace
from grader.runtime.plan import Plan


def test_in_a_network_of_ones_own_no_two_scenarios_have_one_domain() -> None:
    """However long one of them takes; all others have a turn before a domain comes again."""
    domains = PrivateDomains()
    longest = domains.take()
    given = []
    for _ in range(3 * len(UNUSUAL)):
        given.append(domains.take())
        domains.give_back(given[-1])
    assert sorted({longest, *given}) == list(UNUSUAL)
    assert longest not in given
    assert given[: len(UNUSUAL) - 1] == given[len(UNUSUAL) - 1 : 2 * len(UNUSUAL) - 2]


def test_a_domain_that_a_program_may_choose_is_the_last_resort() -> None:
    """A node that is in such a domain by mistake would be right by chance."""
    domains = PrivateDomains()
    given = [domains.take() for _ in range(len(UNUSUAL) + 2)]
    assert given == [*UNUSUAL, *USABLE[:2]]
    for domain in reversed(given):
        domains.give_back(domain)
    assert domains.take() == UNUSUAL[-1]


def test_domains_that_are_shared_are_distinct_while_they_are_taken() -> None:
    """Of one grader and of two; others on this machine may use some of the first ones."""
    unusual, usable = range(215, 217), range(90, 96)
    given = []
    choice = (unusual, usable)
    with contextlib.suppress(EnvironmentFault), SharedDomains(choice) as one, SharedDomains(choice) as other:
        given = [source.take() for source in (one, other, one, other)]
    assert len(set(given)) == len(given)
    assert given == sorted(given, key=usable.__contains__)


def test_a_shared_domain_is_kept_for_a_while_after_it_is_given_back() -> None:
    """What has ended may still be known to others; and a long class does not run out of domains."""
    given = []
    with SharedDomains() as source:
        for _ in range(KEPT + 3):
            given.append(source.take())
            source.give_back(given[-1])
    for number in range(KEPT, len(given)):
        assert given[number] not in given[number - KEPT : number]


def test_a_domain_somebody_talks_on_is_not_given_out() -> None:
    """Its discovery port is in use, whoever uses it."""
    usable = range(90, 92)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as talker:
        free = [domain for domain in usable if bound(talker, domain)]
        if not free:
            pytest.skip("both domains are in use on this machine")
        (other,) = set(usable) - {free[0]}
        with SharedDomains((usable,)) as source:
            try:
                assert source.take() == other
            except EnvironmentFault:
                pytest.skip("the other domain is in use on this machine")


def bound(talker: socket.socket, domain: int) -> bool:
    """Take a domain's discovery port, if none has been taken yet; return whether it was."""
    try:
        talker.bind(("", 7400 + 250 * domain))
    except OSError:
        return False
    return True


@pytest.mark.parametrize("kind", [PrivateDomains, SharedDomains])
def test_no_free_domain_is_said(kind: type[PrivateDomains | SharedDomains]) -> None:
    """Instead of two graders hearing each other."""
    with pytest.raises(EnvironmentFault, match="expected a free one, found all in use"):
        kind(()).take()


def test_ports_of_domains_are_not_among_those_handed_out() -> None:
    """Linux hands out ports from 32768 to 60999, and there is none above 65535."""
    assert 7400 + 250 * max(USABLE) + 249 < 32768
    assert 7400 + 250 * min(UNUSUAL) > 60999
    assert 7400 + 250 * max(UNUSUAL) + 249 <= 65535


#: What a program does before it creates its node, and whether that is in the domain of everybody else.
CHOICES = {
    "": True,
    "domain = None": True,
    "domain = 0": True,
    "import numpy; domain = numpy.int64(0)": True,
    "domain = int(os.environ.get('ROS_DOMAIN_ID', '0'))": True,
    "os.environ['ROS_DOMAIN_ID'] = '0'": True,
    "os.environ['ROS_DOMAIN_ID'] = ''": True,
    "os.environ.pop('ROS_DOMAIN_ID', None)": True,
    "os.environ['ROS_DOMAIN_ID'] = '7'; domain = 0": True,
    "os.environ['ROS_DOMAIN_ID'] = '7'": False,
    "domain = 1": False,
    "domain = True": False,
}
CLOCKS: dict[str, dict[str, Any]] = {"virtual": {}, "wall": {"clock": "wall"}, "bare": {"clock": "wall", "bare": True}}
CHOOSER = """
import os
import rclpy
from std_msgs.msg import String

domain = None
{choice}
context = rclpy.context.Context()
context.init(domain_id=domain)
node = rclpy.create_node("chooser", context=context)
publisher = node.create_publisher(String, "/words", 10)
timer = node.create_timer(0.1, lambda: publisher.publish(String()))
executor = rclpy.executors.SingleThreadedExecutor(context=context)
executor.add_node(node)
executor.spin()
"""


#: Choices that ROS refuses.
NONE = ("domain = -1", "domain = 'a'", "os.environ['ROS_DOMAIN_ID'] = 'a'")
#: What runs by default; in virtual time all others run with `--long`, in real time every night.
DEFAULT = (
    ("domain = 0", "virtual"),
    ("os.environ['ROS_DOMAIN_ID'] = '7'; domain = 0", "bare"),
    ("os.environ['ROS_DOMAIN_ID'] = '7'", "wall"),
    ("domain = 1", "virtual"),
    ("domain = True", "virtual"),
    ("domain = -1", "virtual"),
)


def row(choice: str, clock: str, *values: Any) -> Any:
    tier = [] if (choice, clock) in DEFAULT else [LONG if clock == "virtual" else NIGHTLY]
    return pytest.param(choice, clock, *values, marks=tier)


def plan(folder: Path, choice: str, clock: str, **_: object) -> Plan:
    pytest.importorskip("rclpy")
    from hostile import planned

    return planned(folder, CHOOSER.format(choice=choice), duration_ns=2 * NS_PER_S, **CLOCKS[clock])


@pytest.mark.breadth(2, 4)
@pytest.mark.ros
@rows_of(plan)
@pytest.mark.parametrize(
    ("choice", "clock", "heard"), [row(choice, clock, heard) for choice, heard in CHOICES.items() for clock in CLOCKS]
)
def test_a_node_is_heard_in_domain_0(trace: Trace, choice: str, clock: str, *, heard: bool) -> None:
    """However the program chose it; in any other it is not."""
    assert trace.faults() == ()
    assert bool(trace.messages("/words")) == heard


@pytest.mark.ros
@rows_of(plan)
@pytest.mark.parametrize(("choice", "clock"), [row(choice, clock) for choice in NONE for clock in CLOCKS])
def test_a_domain_that_is_none_is_an_error(trace: Trace, choice: str, clock: str) -> None:
    """The one of ROS."""
    assert [fault.line for fault in trace.faults()] == [9]
