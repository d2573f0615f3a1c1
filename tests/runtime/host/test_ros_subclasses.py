"""Classes that students derive from those of ROS are what they are derived from."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hostile import record
from tiers import NIGHTLY, each, more

from grader.runtime.model.trace import GraphSnapshot, Trace
from grader.runtime.session import RecordingSession

pytestmark = pytest.mark.ros

S = 1_000_000_000
Run = Callable[..., Trace]

MESSAGES = """
import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node
class Speed(Twist):
    def __init__(self, forward=0.0):
        super().__init__()
        self.linear.x = forward
class Quick(Speed):
    pass
class Meta(type(Twist)):
    pass
class Odd(Twist, metaclass=Meta):
    pass
rclpy.init()
node = Node("driver")
outs = [(kind, node.create_publisher(kind, f"/{kind.__name__.lower()}", 10)) for kind in (Speed, Quick, Odd, Twist)]
heard = []
node.create_subscription(Speed, "/quick", lambda m: heard.append(m), 10)
node.create_timer(0.1, lambda: [out.publish(kind()) for kind, out in outs])
node.create_timer(0.95, lambda: print(len(heard), type(heard[0]).__name__, flush=True))
rclpy.spin(node)
"""
SERVICES = """
import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger
class Status(Trigger):
    class Request(Trigger.Request):
        pass
    class Response(Trigger.Response):
        pass
rclpy.init()
node = Node("asker")
def answer(request, response):
    response.success, response.message = True, "42 %"
    return response
node.create_service(Status, "/status", answer)
client = node.create_client(Status, "/status")
def ask():
    client.call_async(Status.Request()).add_done_callback(lambda f: print(f.result().message, flush=True))
node.create_timer(0.2, ask)
rclpy.spin(node)
"""
ACTIONS = """
import rclpy
from rclpy.action import ActionClient, ActionServer
from rclpy.node import Node
from test_msgs.action import Fibonacci
class Counting(Fibonacci):
    pass
class Server(ActionServer):
    pass
class Asker(ActionClient):
    pass
rclpy.init()
node = Node("counter")
def execute(goal):
    goal.succeed()
    result = Counting.Result()
    result.sequence = [0, 1, 1]
    return result
server, client = Server(node, Counting, "count", execute), Asker(node, Counting, "count")
def answered(future):
    future.result().get_result_async().add_done_callback(lambda f: print(list(f.result().result.sequence), flush=True))
timer = None
def ask():
    timer.cancel()
    client.send_goal_async(Counting.Goal(order=3)).add_done_callback(answered)
timer = node.create_timer(0.1, ask)
rclpy.spin(node)
"""
REST = """
import rclpy
from geometry_msgs.msg import Twist
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.client import Client
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.timer import Timer
class Loud(Publisher):
    sent = 0
    def publish(self, msg):
        self.sent += 1
        super().publish(msg)
class Sensor(QoSProfile):
    def __init__(self, depth=3):
        super().__init__(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)
class Group(ReentrantCallbackGroup):
    pass
class Careful(EXECUTOR):
    def spin_once(self, timeout_sec=None):
        super().spin_once(timeout_sec)
class Base(Node):
    def create_publisher(self, *args, **kwargs):
        made = super().create_publisher(*args, **kwargs)
        if made.topic_name == "/cmd_vel":
            made.__class__ = Loud
        return made
class Driver(Base):
    def __init__(self):
        super().__init__("driver")
        self.out = self.create_publisher(Twist, "/cmd_vel", Sensor())
        self.heard = 0
        self.create_subscription(Twist, "/cmd_vel", self.hear, Sensor(), callback_group=Group())
        self.create_timer(0.1, self.tick, callback_group=Group())
        self.create_timer(0.95, lambda: print(self.out.sent, self.heard, flush=True))
    def tick(self):
        self.out.publish(Twist())
    def hear(self, msg):
        self.heard += 1
rclpy.init()
executor = Careful()
executor.add_node(Driver())
executor.spin()
"""


@pytest.fixture(params=["virtual", *more(["wall"], NIGHTLY)])
def run(request: pytest.FixtureRequest, one_worker: RecordingSession, tmp_path: Path) -> Run:
    def run_one(source: str, **fields: Any) -> Trace:
        duration_ns = S if request.param == "virtual" else 3 * S
        return record(one_worker, tmp_path / "s", source, duration_ns=duration_ns, clock=request.param, **fields)

    tmp_path.chmod(0o755)
    return run_one


def printed(trace: Trace) -> list[str]:
    assert [fault.text for fault in trace.faults()] == []
    assert [line.text for line in trace.lines() if line.stream == "stderr"] == []
    return [line.text for line in trace.lines()]


def test_messages(run: Run) -> None:
    """One of a class of the student's own is sent and heard, under the type that ROS knows."""
    trace = run(MESSAGES)
    count, kind = printed(trace)[0].split()
    assert int(count) >= 5
    assert kind in ("Speed", "Twist")
    assert {m.type for m in trace.messages("/speed")} == {"geometry_msgs/msg/Twist"}
    for topic in ("/speed", "/quick", "/odd", "/twist"):
        assert len(trace.messages(topic)) >= 5
    graph = trace.of(GraphSnapshot)[-1]
    assert {end.type for end in graph.endpoints} == {"geometry_msgs/msg/Twist"}


def test_services(run: Run) -> None:
    """A class derived from a service serves and asks."""
    trace = run(SERVICES)
    assert set(printed(trace)) == {"42 %"}
    assert trace.notes == ()


@pytest.mark.long
def test_actions(run: Run) -> None:
    """A class derived from an action, and classes derived from server and client."""
    trace = run(ACTIONS)
    assert printed(trace) == ["[0, 1, 1]"]
    assert trace.notes == ()


@pytest.mark.parametrize("executor", each(["SingleThreadedExecutor", "MultiThreadedExecutor"], 2))
def test_nodes_executors_publishers_groups_and_profiles(run: Run, executor: str) -> None:
    """Methods that call those of their base."""
    sent, heard = map(int, printed(run(REST.replace("EXECUTOR", executor)))[0].split())
    assert sent >= 5
    assert sent - 1 <= heard <= sent
