"""Nodes that exchange messages, calls and goals of test_msgs with each other; a program for test_type_support.py.

`exchange.py OWN OTHER`: the process offers everything below /OWN and uses what the other one offers below /OTHER.
"""

import json
import os
import sys
import time
from typing import Any

import rclpy
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.service_introspection import ServiceIntrospectionState
from test_msgs.action import NestedMessage
from test_msgs.msg import BoundedSequences, Nested, WStrings
from test_msgs.srv import Arrays
from type_description_interfaces.srv import GetTypeDescription

#: The two ends of a topic discover each other at different moments: who comes later still gets what was sent.
KEPT = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
own, other = sys.argv[1:]
told: dict[str, Any] = {}
rclpy.init()
node = rclpy.create_node(own)
executor = SingleThreadedExecutor()
executor.add_node(node)
heard: dict[str, Any] = {}


def wait_for(condition: Any) -> None:
    deadline = time.monotonic() + 300
    while not condition():
        assert time.monotonic() < deadline, f"{own} waited in vain; it has {sorted(heard)}"
        executor.spin_once(timeout_sec=0.02)


def serve(request: Arrays.Request, response: Arrays.Response) -> Arrays.Response:
    response.string_values = [*reversed(request.string_values)]
    response.float64_values = request.float64_values * 2
    return response


def execute(goal: Any) -> NestedMessage.Result:
    feedback = NestedMessage.Feedback()
    feedback.nested_different_pkg.sec = 7
    goal.publish_feedback(feedback)
    goal.succeed()
    result = NestedMessage.Result()
    result.nested_field.int32_value = goal.request.nested_field_no_pkg.duration_value.sec + 1
    return result


types = (BoundedSequences, Nested, WStrings)
sent = []
publishers = []
for number, made in enumerate(types):
    message = made()
    if made is BoundedSequences:
        message.string_values, message.float64_values = ["ä", "b"], [1.5]
    elif made is Nested:
        message.basic_types_value.int64_value = -(2**60)
    else:
        message.wstring_value = "漢😀"
    sent.append(message)
    publishers.append(node.create_publisher(made, f"/{own}/topic{number}", KEPT))
    publishers[-1].publish(message)
    node.create_subscription(
        made, f"/{other}/topic{number}", lambda m, n=number: heard.__setitem__(f"topic{n}", m), KEPT
    )
service = node.create_service(Arrays, f"/{own}/service", serve)
service.configure_introspection(node.get_clock(), KEPT, ServiceIntrospectionState.CONTENTS)
node.create_subscription(
    Arrays.Event, f"/{own}/service/_service_event", lambda m: heard.setdefault("events", []).append(m), KEPT
)
client = node.create_client(Arrays, f"/{other}/service")
server = ActionServer(node, NestedMessage, f"/{own}/action", execute, feedback_pub_qos_profile=KEPT)
goals = ActionClient(node, NestedMessage, f"/{other}/action", feedback_sub_qos_profile=KEPT)
describer = node.create_client(GetTypeDescription, f"/{other}/get_type_description")

wait_for(lambda: all(p.get_subscription_count() for p in publishers))
wait_for(lambda: client.service_is_ready() and goals.server_is_ready() and describer.service_is_ready())
wait_for(lambda: all(f"topic{n}" in heard for n in range(3)))
told["topics"] = [heard[f"topic{n}"] == sent[n] for n in range(3)]

request = Arrays.Request(string_values=["x", "y", "z"], float64_values=[1.0, 2.0, 3.0])
call = client.call_async(request)
wait_for(call.done)
told["response"] = [list(call.result().string_values), list(call.result().float64_values)]

goal = NestedMessage.Goal()
goal.nested_field_no_pkg.duration_value.sec = 41
feedback: list[Any] = []
accepted = goals.send_goal_async(goal, feedback_callback=feedback.append)
wait_for(accepted.done)
result = accepted.result().get_result_async()
wait_for(lambda: result.done() and feedback)
told["result"] = [result.result().result.nested_field.int32_value, feedback[0].feedback.nested_different_pkg.sec]
told["cancel"] = accepted.result().cancel_goal_async() is not None

(info,) = node.get_publishers_info_by_topic(f"/{other}/topic1")
told["hash"] = str(info.topic_type_hash)
described = describer.call_async(GetTypeDescription.Request(type_name="test_msgs/msg/Nested", type_hash=told["hash"]))
wait_for(described.done)
answer = described.result()
told["described"] = [
    answer.successful,
    [each.name for each in answer.type_description.type_description.fields],
    [each.type_name for each in answer.type_description.referenced_type_descriptions],
]
wait_for(lambda: len(heard.get("events", ())) >= 2)
told["events"] = [[event.info.event_type, len(event.request), len(event.response)] for event in heard["events"][:2]]
# The other side may still need this one.
done = node.create_publisher(Nested, f"/{own}/done", KEPT)
node.create_subscription(Nested, f"/{other}/done", lambda m: heard.__setitem__("done", m), KEPT)
wait_for(done.get_subscription_count)
done.publish(Nested())
wait_for(lambda: "done" in heard)
done.wait_for_all_acked()
sys.stdout.write(json.dumps(told))
sys.stdout.flush()
node.destroy_node()
rclpy.shutdown()
# The middleware has been seen to hang while the interpreter ends, which is not what is tried here.
os._exit(0)
