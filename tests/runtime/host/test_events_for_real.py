"""Programs learn on both clocks what discovery finds of their endpoints: matches, and QoS that does not fit."""

import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tiers import NIGHTLY, more

from grader.runtime.model.trace import AssessedTrace, FaultKind, LogRecord, OutputLine, unmet_policy
from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from hostile import record

from grader.grading.reporting.graph import draw_graph
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.worker.virtual_runner import OUTSIDE

pytestmark = pytest.mark.ros

CLOCKS = pytest.mark.parametrize("clock", ["virtual", *more(["wall"])])
#: For what differs little from what runs on both clocks with `--long`.
MOSTLY_VIRTUAL = pytest.mark.parametrize("clock", ["virtual", *more(["wall"], NIGHTLY)])
BEFORE = """
import sys, time
import rclpy
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSPresetProfiles, QoSProfile, ReliabilityPolicy
from rclpy.qos import qos_policy_name_from_kind, qos_profile_sensor_data, qos_profile_system_default
from std_msgs.msg import Int32, String
from std_srvs.srv import Trigger

rclpy.init()

def say(text):
    sys.stdout.write(text + "\\n")
    sys.stdout.flush()

def qos(**fields):
    return QoSProfile(depth=10, **fields)

BEST_EFFORT = qos(reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = qos(durability=DurabilityPolicy.TRANSIENT_LOCAL)
OFFERED = {
    "usual": qos(),
    "lossy": BEST_EFFORT,
    "volatile": qos(),
    "no_deadline": qos(),
    "late": qos(deadline=Duration(seconds=2)),
    "in_time": qos(deadline=Duration(seconds=1)),
    "automatic": qos(),
    "no_lease": qos(),
    "long_lease": qos(liveliness_lease_duration=Duration(seconds=9)),
    "short_lease": qos(liveliness_lease_duration=Duration(seconds=5)),
    "default": qos_profile_system_default,
    "default_to_latched": qos_profile_system_default,
    "latched_to_default": LATCHED,
}
REQUESTED = {
    "usual": qos(),
    "lossy": qos(),
    "volatile": LATCHED,
    "no_deadline": qos(deadline=Duration(seconds=1)),
    "late": qos(deadline=Duration(seconds=1)),
    "in_time": qos(deadline=Duration(seconds=2)),
    "automatic": qos(liveliness=LivelinessPolicy.MANUAL_BY_TOPIC),
    "no_lease": qos(liveliness_lease_duration=Duration(seconds=5)),
    "long_lease": qos(liveliness_lease_duration=Duration(seconds=5)),
    "short_lease": qos(liveliness_lease_duration=Duration(seconds=9)),
    "default": qos_profile_system_default,
    "default_to_latched": LATCHED,
    "latched_to_default": qos_profile_system_default,
}

def saying(cls, name):
    return cls(
        matched=lambda e: say(f"{name} matched {e.current_count}"),
        incompatible_qos=lambda e: say(f"{name} {qos_policy_name_from_kind(e.last_policy_kind)} {e.total_count}"),
        incompatible_type=lambda e: say(f"{name} type"),
    )
"""
#: Publishes on a topic for each profile, and says what happens to the publishers.
OFFERING = """
node = Node("offering")
for topic, profile in OFFERED.items():
    node.create_publisher(String, topic, profile, event_callbacks=saying(PublisherEventCallbacks, topic))
node.create_publisher(String, "type", 10, event_callbacks=saying(PublisherEventCallbacks, "type"))
rclpy.spin(node)
"""
REQUESTING = """
node = Node("requesting")
for topic, profile in REQUESTED.items():
    events = saying(SubscriptionEventCallbacks, topic)
    node.create_subscription(String, topic, lambda _: None, profile, event_callbacks=events)
events = saying(SubscriptionEventCallbacks, "type")
node.create_subscription(Int32, "type", lambda _: None, 10, event_callbacks=events)
rclpy.spin(node)
"""
#: The policy that keeps the two ends of a topic apart.
UNMET = {
    "lossy": "RELIABILITY",
    "volatile": "DURABILITY",
    "no_deadline": "DEADLINE",
    "late": "DEADLINE",
    "automatic": "LIVELINESS",
    "no_lease": "LIVELINESS",
    "long_lease": "LIVELINESS",
}
MATCHED = {"usual", "in_time", "short_lease", "default", "default_to_latched", "latched_to_default"}
#: A listener with default callbacks, without a timer: only an event wakes it.
LISTENING = """
node = Node("listening")
node.create_subscription(Int32, "/count", lambda m: say(f"heard {m.data}"), 10)
rclpy.spin(node)
"""
OFFERS_LESS = "New publisher discovered on topic '/count', offering incompatible QoS"
ASKS_MORE = "New subscription discovered on topic '/count', requesting incompatible QoS"


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., AssessedTrace]:
    tmp_path.chmod(0o755)

    def run_all(*programs: str, clock: str, **fields: Any) -> AssessedTrace:
        whole = [BEFORE + textwrap.dedent(program) for program in programs]
        trace = record(session, tmp_path / "s", *whole, clock=clock, **{"duration_ns": 4 * NS_PER_S, **fields})
        assert (trace.harness_problem, trace.incomplete) == ("", False)
        assert [note for note in trace.notes if "in time" in note or "not seen" in note] == []
        return trace

    return run_all


def said(trace: AssessedTrace, process: str) -> list[tuple[float, str]]:
    """Return what a program printed, with the time in seconds."""
    lines = [o for o in trace.observations if isinstance(o, OutputLine) and o.process == process]
    return [(round(line.t_ns / NS_PER_S, 3), line.text) for line in lines if line.stream == "stdout"]


def last_of(trace: AssessedTrace, process: str) -> dict[str, str]:
    """Return the last that a program said of each topic and kind of event."""
    return {text.rpartition(" ")[0]: text.rpartition(" ")[2] for _, text in said(trace, process)}


def warnings(trace: AssessedTrace, process: str) -> list[tuple[float, str]]:
    """Return the warnings of rclpy in the log of a program, with the time in seconds."""
    found = [o for o in trace.observations if isinstance(o, LogRecord) and (o.process, o.severity) == (process, "WARN")]
    return [(round(o.t_ns / NS_PER_S, 3), o.text.partition(". ")[0]) for o in found]


@pytest.mark.rule(15)
@CLOCKS
@pytest.mark.parametrize("first", ["offering", *more(["requesting"])])
def test_both_ends_learn_which_policy_does_not_fit(run: Callable[..., AssessedTrace], clock: str, first: str) -> None:
    """In either order; matches are told beside it, of which a publisher has one more with the grader's own node.

    The middleware of Jazzy tells of no types that differ.
    """
    order = [OFFERING, REQUESTING] if first == "offering" else [REQUESTING, OFFERING]
    trace = run(*order, clock=clock)
    offering, requesting = ("a.py", "b.py") if first == "offering" else ("b.py", "a.py")
    refused = {f"{topic} {policy}": "1" for topic, policy in UNMET.items()}
    assert last_of(trace, requesting) == refused | {f"{topic} matched": "1" for topic in MATCHED}
    graders = {f"{topic} matched": "2" if topic in MATCHED else "1" for topic in (*MATCHED, *UNMET, "type")}
    assert last_of(trace, offering) == refused | graders
    assert warnings(trace, "a.py") == warnings(trace, "b.py") == []
    if clock == "virtual":
        assert {at for name in ("a.py", "b.py") for at, _ in said(trace, name)} == {0.0}


def test_the_graph_knows_each_policy(run: Callable[..., AssessedTrace]) -> None:
    """What keeps two ends apart is told from their endpoints in the graph, for reports and drawings."""
    trace = run(OFFERING, REQUESTING, clock="virtual", duration_ns=NS_PER_S // 2)
    unmet = {
        publisher.topic[1:]: policy[0]
        for publisher in trace.endpoints("publisher")
        for subscription in trace.endpoints("subscription", publisher.topic)
        if (policy := unmet_policy(publisher, subscription))
    }
    assert unmet == {
        "lossy": "best_effort reliability",
        "volatile": "volatile durability",
        "no_deadline": "no deadline",
        "late": "a deadline of 2 s",
        "automatic": "automatic liveliness",
        "no_lease": "no liveliness lease",
        "long_lease": "a liveliness lease of 9 s",
    }


@MOSTLY_VIRTUAL
def test_rclpy_warns_at_both_ends(run: Callable[..., AssessedTrace], clock: str) -> None:
    """The warnings come at once, also in a program that nothing else wakes."""
    talking = """
    node = Node("talking")
    publisher = node.create_publisher(Int32, "/count", BEST_EFFORT)
    rclpy.spin(node)
    """
    trace = run(LISTENING, talking, clock=clock)
    assert [text for _, text in warnings(trace, "a.py")] == [OFFERS_LESS]
    assert [text for _, text in warnings(trace, "b.py")] == [ASKS_MORE]
    if clock == "virtual":
        assert [at for name in ("a.py", "b.py") for at, _ in warnings(trace, name)] == [0.0, 0.0]


@pytest.mark.long
@CLOCKS
def test_later_endpoints_are_told_when_they_appear(run: Callable[..., AssessedTrace], clock: str) -> None:
    """Each of three publishers at its time, and what has gone is still counted; a program may act on nothing else."""
    later = """
    node = Node("later")
    told = []
    node.create_subscription(Int32, "/refused", lambda m: told.append(m.data), 10)
    for number in range(3):
        time.sleep(1)
        publisher = node.create_publisher(Int32, "/count", BEST_EFFORT)
        time.sleep(0.5)
        while len(told) <= number:
            rclpy.spin_once(node, timeout_sec=0.01)
        node.destroy_publisher(publisher)
    """
    waiting = """
    node = Node("waiting")
    answer = node.create_publisher(Int32, "/refused", 10)
    events = SubscriptionEventCallbacks(incompatible_qos=lambda e: answer.publish(Int32(data=e.total_count)))
    while answer.get_subscription_count() < 2:
        time.sleep(0.01)
    node.create_subscription(Int32, "/count", lambda _: None, 10, event_callbacks=events)
    rclpy.spin(node)
    """
    trace = run(waiting, later, clock=clock, duration_ns=10 * NS_PER_S)
    assert [message.value["data"] for message in trace.messages("/refused")] == [1, 2, 3]
    if clock == "virtual":
        assert [round(message.t_ns / NS_PER_S, 3) for message in trace.messages("/refused")] == [1.0, 2.5, 4.0]


@pytest.mark.long
@MOSTLY_VIRTUAL
def test_of_three_ends_one_fits(run: Callable[..., AssessedTrace], clock: str) -> None:
    """Each message counts once, whatever QoS the publishers of the topic have; the grader's node is no stranger."""
    mixed = """
    node = Node("mixed")
    publishers = [node.create_publisher(Int32, "/count", BEST_EFFORT if lossy else 10) for lossy in (True, False, True)]

    def tick():
        for number, publisher in enumerate(publishers):
            publisher.publish(Int32(data=number))

    node.create_timer(0.5, tick)
    rclpy.spin(node)
    """
    alone = run(mixed, clock=clock)
    together = run(LISTENING, mixed, clock=clock)
    for trace in (alone, together):
        counts = [sum(m.value["data"] == number for m in trace.messages("/count")) for number in range(3)]
        assert len(set(counts)) == 1
        assert counts[0] >= 6
    assert warnings(alone, "a.py") == []
    assert {text for _, text in warnings(together, "b.py")} == {ASKS_MORE}
    assert {text for _, text in warnings(together, "a.py")} == {OFFERS_LESS}
    assert {text for _, text in said(together, "a.py")} == {"heard 1"}


@pytest.mark.long
@MOSTLY_VIRTUAL
def test_endpoints_of_one_process_are_told_of_each_other(run: Callable[..., AssessedTrace], clock: str) -> None:
    """Also in one node, and once it spins."""
    both = """
    node = Node("both")
    node.create_subscription(Int32, "/count", lambda _: None, 10)
    node.create_publisher(Int32, "/count", BEST_EFFORT)
    time.sleep(1)
    say("spins")
    rclpy.spin(node)
    """
    trace = run(both, clock=clock)
    assert sorted(text for _, text in warnings(trace, "a.py")) == [OFFERS_LESS, ASKS_MORE]
    if clock == "virtual":
        assert {at for at, _ in warnings(trace, "a.py")} == {1.0}


@pytest.mark.long
@CLOCKS
def test_who_goes_is_told(run: Callable[..., AssessedTrace], clock: str) -> None:
    """A program that waits for its counterpart to come and to go, and does nothing else."""
    leaving = """
    node = Node("leaving")
    time.sleep(1)
    node.create_publisher(Int32, "/count", 10)
    time.sleep(1)
    """
    waiting = """
    node = Node("waiting")
    events = SubscriptionEventCallbacks(matched=lambda e: say(f"{e.current_count} {e.current_count_change}"))
    node.create_subscription(Int32, "/count", lambda _: None, 10, event_callbacks=events)
    rclpy.spin(node)
    """
    found = said(run(waiting, leaving, clock=clock), "a.py")
    assert [text for _, text in found] == ["1 1", "0 -1"]
    if clock == "virtual":
        assert [at for at, _ in found] == [1.0, 2.0]


@pytest.mark.long
@MOSTLY_VIRTUAL
def test_nobody_is_told_who_does_not_want_to_know(run: Callable[..., AssessedTrace], clock: str) -> None:
    """Without default callbacks there are no events, and nothing is waited for."""
    deaf = """
    node = Node("deaf")
    quiet = SubscriptionEventCallbacks(use_default_callbacks=False)
    node.create_subscription(Int32, "/count", lambda _: None, 10, event_callbacks=quiet)
    silent = PublisherEventCallbacks(use_default_callbacks=False)
    node.create_publisher(Int32, "/count", BEST_EFFORT, event_callbacks=silent)
    rclpy.spin(node)
    """
    assert warnings(run(deaf, clock=clock), "a.py") == []


@CLOCKS
def test_services_see_each_other_if_both_ways_fit(run: Callable[..., AssessedTrace], clock: str) -> None:
    """A request may arrive and its answer not; rclpy has no events of services, and a client waits in vain."""
    serving = """
    node = Node("serving")

    def answer(request, response):
        say("asked")
        return response

    node.create_service(Trigger, "/lossy", answer, qos_profile=BEST_EFFORT)
    node.create_service(Trigger, "/usual", answer)
    rclpy.spin(node)
    """
    asking = """
    node = Node("asking")
    for name, profile in (("/lossy", qos()), ("/usual", BEST_EFFORT), ("/usual", qos())):
        client = node.create_client(Trigger, name, qos_profile=profile)
        found = client.wait_for_service(timeout_sec=0.6)
        future = client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(node, future, timeout_sec=0.5)
        say(f"{name} {found} {future.done()}")
        node.destroy_client(client)
    """
    trace = run(serving, asking, clock=clock, duration_ns=6 * NS_PER_S)
    assert [text for _, text in said(trace, "b.py")] == [
        "/lossy False False",
        "/usual False False",
        "/usual True True",
    ]
    assert [text for _, text in said(trace, "a.py")] == ["asked"] * 2
    drawn = [line.strip() for graph in trace.graphs() for line in draw_graph(graph, width=100)]
    assert "incompatible QoS: reliable client, best_effort server" in drawn
    assert "incompatible QoS: best_effort client, reliable server" in drawn


@pytest.mark.long
@MOSTLY_VIRTUAL
def test_best_available_takes_what_is_there(run: Callable[..., AssessedTrace], clock: str) -> None:
    """The profile that adapts to the endpoints that exist is the same whenever the middleware finds them."""
    talking = """
    node = Node("talking")
    publisher = node.create_publisher(Int32, "/count", BEST_EFFORT)
    node.create_timer(0.5, lambda: publisher.publish(Int32(data=1)))
    rclpy.spin(node)
    """
    adapting = """
    node = Node("adapting")
    time.sleep(1)
    best = QoSPresetProfiles.BEST_AVAILABLE.value
    node.create_subscription(Int32, "/count", lambda m: say(f"heard {m.data}"), best)
    rclpy.spin(node)
    """
    trace = run(talking, adapting, clock=clock)
    assert {text for _, text in said(trace, "b.py")} == {"heard 1"}
    assert [e.reliability for e in trace.endpoints("subscription", "/count")] == ["best_effort"]
    assert [fault.text for fault in trace.faults()] == []


@pytest.mark.long
def test_a_watched_lease_needs_the_wall_clock(run: Callable[..., AssessedTrace]) -> None:
    """The middleware times it, as it does deadlines; on its own clock it tells who lives and who does not."""
    program = """
    node = Node("leased")
    leased = qos(liveliness=LivelinessPolicy.MANUAL_BY_TOPIC, liveliness_lease_duration=Duration(seconds=0.5))
    events = SubscriptionEventCallbacks(liveliness=lambda e: say(f"{e.alive_count} {e.not_alive_count}"))
    node.create_subscription(Int32, "/x", lambda _: None, leased, event_callbacks=events)
    publisher = node.create_publisher(Int32, "/x", leased)
    publisher.publish(Int32())
    rclpy.spin(node)
    """
    virtual = run(program, clock="virtual")
    assert virtual.clock_reason.startswith(OUTSIDE)
    assert [fault.kind for fault in virtual.faults()] == [FaultKind.HUNG]
    assert said(run(program, clock="wall"), "a.py")[-1][1] == "0 1"
