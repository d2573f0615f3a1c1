"""The examples for rclpy of ROS 2."""

import pytest
from example_interfaces.action import Fibonacci
from example_interfaces.srv import AddTwoInts
from std_msgs.msg import String

PUB = "examples_rclpy_minimal_publisher/publisher_"
SUB = "examples_rclpy_minimal_subscriber/subscriber_"


@pytest.mark.parametrize("how", ["local_function", "member_function", "old_school"])
def test_publisher(ros, how):
    ros.run(PUB + how)
    ros.advance(5.0)
    assert ros.rate("/topic") == pytest.approx(2, abs=0.01)
    assert [m.data for m in ros.messages("/topic")][:2] == ["Hello World: 0", "Hello World: 1"]


@pytest.mark.parametrize("how", ["lambda", "member_function", "old_school"])
def test_subscriber(ros, how):
    node = ros.run(SUB + how)
    ros.publish("/topic", String(data="hi"), rate=1)
    ros.advance(2.0)
    assert [log.text for log in node.logs] == ['I heard: "hi"'] * 3


@pytest.mark.parametrize("how", ["service", "service_member_function"])
def test_service(ros, how):
    ros.run("examples_rclpy_minimal_service/" + how)
    assert ros.call("/add_two_ints", AddTwoInts.Request(a=2, b=40)).sum == 42


@pytest.mark.parametrize("how", ["client", "client_async", "client_async_callback", "client_async_member_function"])
def test_client(ros, how):
    ros.serve("/add_two_ints", AddTwoInts, lambda request: AddTwoInts.Response(sum=request.a + request.b))
    client = ros.run("examples_rclpy_minimal_client/" + how)
    ros.wait_until(lambda: "Result of add_two_ints" in client.logs[-1].text, timeout=5.0)
    assert "41 + 1 = 42" in client.logs[-1].text
    ros.advance(2.0)
    assert client.exit_code == 0


@pytest.mark.parametrize(
    "how", ["server", "server_defer", "server_not_composable", "server_queue_goals", "server_single_goal"]
)
def test_action_server(ros, how):
    ros.run("examples_rclpy_minimal_action_server/" + how)
    if how == "server_defer":
        result = ros.send_goal("/fibonacci", Fibonacci.Goal(order=4))
    else:
        result = ros.send_goal("/fibonacci", Fibonacci.Goal(order=4))
    assert list(result.result.sequence)[:4] == [0, 1, 1, 2]


@pytest.mark.parametrize("how", ["client", "client_cancel", "client_not_composable", "client_asyncio"])
def test_action_client(ros, how):
    ros.run("examples_rclpy_minimal_action_server/server")
    client = ros.run("examples_rclpy_minimal_action_client/" + how)
    ros.advance(60.0)
    assert client.exit_code == 0


def test_executor_talker(ros):
    ros.run("examples_rclpy_executors/talker")
    ros.run("examples_rclpy_executors/listener")
    ros.advance(5.0)
    assert ros.rate("/chatter") == pytest.approx(1)


def test_executor_composed(ros):
    node = ros.run("examples_rclpy_executors/composed")
    ros.advance(3.0)
    assert any("I heard" in log.text for log in node.logs)


def test_executor_callback_group(ros):
    ros.run("examples_rclpy_executors/callback_group")
    ros.advance(5.0)
    assert ros.rate("/chatter") > 0.5


def test_executor_custom(ros):
    node = ros.run("examples_rclpy_executors/custom_executor")
    ros.publish("/estop", String(data="stop"))
    ros.advance(3.0)
    assert any('I heard: "stop"' in log.text for log in node.logs)


def test_guard(ros):
    node = ros.run("examples_rclpy_guard_conditions/trigger_guard_condition")
    ros.advance(3.0)
    assert node.exit_code == 0
    assert any("guard callback called shutdown" in log.text for log in node.logs)


def test_pointcloud(ros):
    ros.run("examples_rclpy_pointcloud_publisher/pointcloud_publisher")
    ros.advance(1.0)
    assert len(ros.messages("/test_cloud")) > 5
