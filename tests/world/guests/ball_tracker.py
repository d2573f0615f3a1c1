"""A node that follows a ball, from images that another one has looked at."""

import pytest
from geometry_msgs.msg import Point


def test_searches(ros):
    ros.run("ball_tracker/follow_ball")
    ros.advance(2.0)
    assert ros.messages("/cmd_vel")[-1].angular.z == 0.5
    assert ros.rate("/cmd_vel") == pytest.approx(10)


def test_follows(ros):
    ros.run("ball_tracker/follow_ball", parameters={"filter_value": 0.0})
    ros.publish("/detected_ball", Point(x=0.5, z=0.05), rate=20)
    ros.advance(1.0)
    command = ros.messages("/cmd_vel")[-1]
    assert (command.linear.x, command.angular.z) == (0.1, pytest.approx(-0.35))


def test_loses(ros):
    node = ros.run("ball_tracker/follow_ball")
    ros.publish("/detected_ball", Point(x=0.5))
    ros.wait_until(lambda: node.logs[-1].text == "Target lost", timeout=2.0)
    assert ros.now == pytest.approx(1.0, abs=0.11)
