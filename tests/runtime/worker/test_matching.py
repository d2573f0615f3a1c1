"""Who is to be matched with whom: what each process is told to wait for, and when it is told again."""

from __future__ import annotations

from typing import Any

import pytest

from grader.runtime.host.protocol import NO_COUNTERPARTS, ORDINARY, Claim, Counterparts
from grader.runtime.stimuli.messages import PlannedMessages
from grader.runtime.worker.core import Agenda, Core, Process
from grader.runtime.worker.matching import Match, Matching

FLOAT, INT, TRIGGER = "std_msgs/msg/Float32", "std_msgs/msg/Int32", "std_srvs/srv/Trigger"


class Services:
    """The grader's servers and clients, by their kinds and names."""

    def __init__(self, *ends: tuple[str, str]) -> None:
        self.ends = ends

    def serves(self, service: str, interface: str) -> bool:
        return ("service", service) in self.ends and interface == TRIGGER

    def ends_of(self, kind: str, service: str) -> int:
        return self.ends.count((kind, service))


class Endpoints:
    """Some processes with their endpoints, and the grader's."""

    def __init__(self, *graders: tuple[str, str], watched: tuple[str, ...] = (), **claims: list[Claim]) -> None:
        self.processes = {name: Process(name) for name in claims}
        self.core = Core([*self.processes.values()], Agenda([], {}, 0))
        watching = [False, True]
        self.matching = Matching(self.core, Services(*graders), lambda topic, _: watching if topic in watched else [])
        for name, own in claims.items():
            self.core.has(self.processes[name], own)

    def asked(self, *missing: tuple[str, str]) -> dict[str, Counterparts]:
        """Return what each process is told to wait for now; each then lacks some counterparts."""
        found: dict[str, Counterparts] = {}
        for question in self.matching.questions({}):
            found[question.process.name] = question.expected
            self.matching.matched(question.process, missing)
        return found


def claim(kind: str, name: str, interface: str = FLOAT, number: int = 0, **qos: Any) -> Claim:
    return Claim(kind, name, interface, number, ORDINARY._replace(**qos))


@pytest.mark.rule(13)
def test_each_end_waits_for_the_ends_that_it_will_talk_to() -> None:
    """Those of other processes, of its own, and the grader's; a type or a QoS that does not fit is none."""
    ends = Endpoints(
        watched=("/x",),
        talks=[claim("publisher", "/x", reliable=False), claim("publisher", "/alone")],
        hears=[claim("subscription", "/x", reliable=False), claim("subscription", "/x", reliable=False)],
        other=[claim("subscription", "/x", INT), claim("subscription", "/x", reliable=True)],
    )
    ends.matching.streams["/x"] = FLOAT
    # Of the two subscriptions that watch the topic, one asks for reliable messages.
    assert ends.asked() == {
        "talks": Counterparts(publisher={"/x": [3]}, refused={"0": 1}),
        "hears": Counterparts(subscription={"/x": [2, 2]}),
        "other": Counterparts(subscription={"/x": [1]}, refused={"0": 1}),
    }


@pytest.mark.rule(13)
def test_servers_and_clients_wait_for_each_other_and_for_the_graders() -> None:
    """A client waits for one server, whosever it is; every node has the services of parameters."""
    ends = Endpoints(
        ("client", "/s"),
        ("client", "/s"),
        ("service", "/graders"),
        server=[claim("service", "/s", TRIGGER), claim("node", "/server", "")],
        client=[
            claim("client", "/s", TRIGGER),
            claim("client", "/graders", TRIGGER),
            claim("client", "/nobodys", TRIGGER),
            claim("client", "/server/get_parameters", "rcl_interfaces/srv/GetParameters"),
        ],
    )
    assert ends.asked() == {
        "server": Counterparts(service={"/s": [3]}),
        "client": Counterparts(client={"/s": [1], "/graders": [1], "/server/get_parameters": [1]}),
    }


@pytest.mark.rule(13)
def test_a_client_whose_responses_do_not_come_waits_until_it_is_heard() -> None:
    """Its requests arrive, and a service that has left is to disappear."""
    asks_for_more = claim("client", "/s", TRIGGER)._replace(takes=ORDINARY._replace(deadline_ns=5))
    ends = Endpoints(server=[claim("service", "/s", TRIGGER)], client=[asks_for_more])
    asked = {"server": Counterparts(service={"/s": [1]}), "client": Counterparts(heard={"/s": 1})}
    assert ends.asked() == asked
    ends.core.has(ends.processes["client"], [claim("client", "/s", TRIGGER)])
    ends.asked()
    ends.core.ended(ends.processes["server"])
    assert [*ends.matching.questions({})] == [Match(ends.processes["client"], NO_COUNTERPARTS, ["/s"])]


@pytest.mark.rule(13)
def test_a_process_waits_again_only_if_something_has_changed() -> None:
    """Its endpoints, their counterparts, or that it has missed some; nobody waits for nothing."""
    ends = Endpoints(
        talks=[claim("publisher", "/x")], hears=[claim("subscription", "/x")], rests=[claim("publisher", "/y")]
    )
    assert ends.asked(("publisher", "/x")).keys() == {"talks", "hears"}
    assert ends.asked().keys() == {"talks", "hears"}
    assert ends.asked() == {}
    ends.core.has(ends.processes["talks"], [claim("publisher", "/x")])
    assert ends.asked().keys() == {"talks"}
    ends.core.ended(ends.processes["talks"])
    assert ends.asked() == {"hears": NO_COUNTERPARTS}
    assert ends.asked() == {}


@pytest.mark.rule(14)
def test_nothing_is_announced_to_an_end_that_misses_its_counterpart() -> None:
    """Until the next wait has found it."""
    ends = Endpoints(talks=[claim("publisher", "/x")], hears=[claim("subscription", "/x")])
    talks, hears = ends.processes.values()
    ends.asked(("subscription", "/x"))
    ends.core.sent(talks, {"topic /x": 1})
    assert hears.arrivals == {}
    ends.asked()
    ends.core.sent(talks, {"topic /x": 1})
    assert hears.arrivals == {"topic /x": 1}


@pytest.mark.rule(15)
def test_a_match_and_a_refusal_wake_a_process() -> None:
    """Both are events; the counterparts that were refused count also when they have gone."""
    ends = Endpoints(
        talks=[claim("publisher", "/x", number=1, reliable=False)],
        hears=[claim("subscription", "/x", number=4, reliable=True)],
    )
    talks, hears = ends.processes.values()
    assert ends.asked() == {"talks": Counterparts(refused={"1": 1}), "hears": Counterparts(refused={"4": 1})}
    assert talks.nudged
    assert hears.nudged
    ends.core.has(hears, [claim("subscription", "/x", number=5, reliable=True)])
    assert ends.asked() == {"talks": Counterparts(refused={"1": 2}), "hears": Counterparts(refused={"5": 1})}


@pytest.mark.rule(19)
def test_what_a_process_leaves_lives_until_the_lease_of_who_hears_it() -> None:
    """It stays a counterpart of who was there until its participant has left; who comes later never sees it."""
    ends = Endpoints(
        dies=[claim("publisher", "/x", lease_ns=5)],
        hears=[claim("subscription", "/x", number=2, lease_ns=7)],
        late=[],
    )
    there = Counterparts(subscription={"/x": [1]}, alive={"2": [1, 0]})
    assert ends.asked() == {"dies": Counterparts(publisher={"/x": [1]}), "hears": there}
    ends.core.lost(ends.processes["dies"])
    ends.core.ended(ends.processes["dies"])
    ends.core.has(ends.processes["late"], [claim("subscription", "/x", number=3, lease_ns=7)])
    assert ends.asked() == {"late": Counterparts(alive={"3": [0, 0]})}
    ends.core.now_ns = 7
    assert ends.asked() == {"hears": there._replace(alive={"2": [0, 1]})}
    ends.core.remains.clear()
    assert ends.asked() == {"hears": Counterparts(alive={"2": [0, 0]})}


@pytest.mark.rule(19)
def test_only_the_middleware_times_who_has_to_show_that_it_lives() -> None:
    """One such publisher is enough: the numbers are told together."""
    ends = Endpoints(
        talks=[claim("publisher", "/x", lease_ns=5), claim("publisher", "/x", lease_ns=5, manual=True)],
        hears=[claim("subscription", "/x", number=2, lease_ns=7)],
    )
    assert ends.asked()["hears"] == Counterparts(subscription={"/x": [2]}, alive={"2": []})


def test_the_publisher_of_a_stimulus_is_matched_as_it_was_made() -> None:
    """Best effort where the rubric says so; the grader's own subscriptions to its topic count as well."""
    ends = Endpoints(
        watched=("/x",),
        reliable=[claim("subscription", "/x", reliable=True)],
        any=[claim("subscription", "/x", reliable=False)],
    )
    ends.matching.streams["/x"] = FLOAT
    assert ends.matching.readers("/x") == 4
    made = PlannedMessages("/x", FLOAT, 0, 0, 1, 0, values=(), best_effort=True, latched=False)
    ends.matching.fixed["/x"] = made
    assert ends.matching.readers("/x") == 2


def test_what_latched_publishers_keep_is_announced_once_to_each_new_subscription() -> None:
    """All that a stimulus has published, and one message of another process; a new subscription gets it again."""
    latched = claim("subscription", "/x", latched=True)
    ends = Endpoints(
        talks=[claim("publisher", "/x", latched=True)], hears=[latched], plain=[claim("subscription", "/x")]
    )
    hears = ends.processes["hears"]
    ends.core.kept["talks", "/x"] = 5
    ends.matching.streams["/x"], ends.matching.published["/x"] = FLOAT, 3
    ends.matching.fixed["/x"] = PlannedMessages("/x", FLOAT, 0, 0, 1, 0, values=(), best_effort=False, latched=True)
    for announced in ({"topic /x": 4}, {"topic /x": 4}):
        ends.matching.announce_kept()
        assert (hears.arrivals, ends.processes["plain"].arrivals) == (announced, {})
    ends.core.has(hears, [])
    ends.matching.announce_kept()
    ends.core.has(hears, [latched])
    ends.matching.announce_kept()
    assert hears.arrivals == {"topic /x": 8}
