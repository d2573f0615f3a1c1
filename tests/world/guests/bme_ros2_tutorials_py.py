"""Publisher, service and client of a course, with a message package of its own."""

from bme_ros2_tutorials_interfaces.srv import CustomCalc


def test_sum(ros):
    ros.run("bme_ros2_tutorials_py/py_service_server")
    assert ros.call("/custom_calc", CustomCalc.Request(a=2, b=3)).result == 5


def test_client(ros):
    client = ros.run("bme_ros2_tutorials_py/py_service_client", arguments=["4", "5"])
    ros.advance(2.5)
    assert [log.text for log in client.logs] == ["service not available, waiting again..."] * 2
    ros.run("bme_ros2_tutorials_py/py_service_server")
    ros.advance(1.0)
    assert client.logs[-1].text == "Result of custom_calc: for 4 + 5 = 9"
    assert client.exit_code == 0


def test_period(ros):
    ros.run("bme_ros2_tutorials_py/py_publisher_with_param", parameters={"published_text": "hi"})
    ros.advance(3.0)
    assert [m.data for m in ros.messages("/topic")] == ["hi: 0", "hi: 1", "hi: 2"]
    ros.set_parameter("/python_publisher_with_parameter", "timer_period", 0.1)
    ros.advance(1.0)
    assert len(ros.messages("/topic")) == 13
