"""The demo nodes of ROS 2."""

import pytest
from std_msgs.msg import String


def test_talker(ros):
    ros.run("demo_nodes_py/talker")
    ears = ros.run("demo_nodes_py/listener")
    ros.advance(5.0)
    assert ros.rate("/chatter") == pytest.approx(1)
    assert len(ears.logs) == len(ros.messages("/chatter"))


def test_qos(ros):
    ros.run("demo_nodes_py/talker_qos", arguments=["-n", "5"])
    ears = ros.run("demo_nodes_py/listener_qos", arguments=["--reliable"])
    ros.advance(10.0)
    assert not any("I heard" in log.text for log in ears.logs)


def test_serialized(ros):
    ears = ros.run("demo_nodes_py/listener_serialized")
    ros.publish("/chatter", String(data="x"))
    ros.advance(1.0)
    assert any("I heard" in log.text for log in ears.logs)


def test_server(ros):
    ros.run("demo_nodes_py/add_two_ints_server")
    client = ros.run("demo_nodes_py/add_two_ints_client")
    ros.advance(2.0)
    assert client.logs[-1].text == "Result of add_two_ints: 5"


def test_server_async(ros):
    client = ros.run("demo_nodes_py/add_two_ints_client_async")
    ros.advance(2.0)
    ros.run("demo_nodes_py/add_two_ints_server")
    ros.advance(2.0)
    assert client.logs[-1].text == "Result of add_two_ints: 5"


def test_parameters(ros):
    ros.run("demo_nodes_py/set_parameters_callback")
    ros.set_parameter("/set_parameters_callback", "param1", 2.0)
    from rcl_interfaces.srv import GetParameters

    got = ros.call("/set_parameters_callback/get_parameters", GetParameters.Request(names=["param2"]))
    assert got.values[0].double_value == 4.0


def test_matched(ros):
    node = ros.run("demo_nodes_py/matched_event_detect")
    ros.advance(10.0)
    assert any("First subscription is connected." in log.text for log in node.logs)


def test_logger_service(ros):
    node = ros.run("demo_nodes_py/use_logger_service")
    ros.advance(10.0)
    assert node.logs


def test_introspection(ros):
    ros.run("demo_nodes_py/introspection")
    ros.advance(3.0)
    assert ros.nodes()


def test_async_param(ros):
    with ros.expects_failure("parameter_blackboard is not available"):
        ros.run("demo_nodes_py/async_param_client")
        ros.advance(5.0)
