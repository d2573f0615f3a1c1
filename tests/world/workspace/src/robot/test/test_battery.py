"""The battery drains, and is charged at a station that it knows."""

import pytest
from robot_interfaces.msg import Battery
from robot_interfaces.srv import Dock
from tf2_msgs.msg import TFMessage


def test_it_drains_by_a_percent_a_second(ros):
    ros.run("robot/battery")
    ros.advance(20.0)
    assert ros.rate("/battery") == 1.0
    assert ros.messages("/battery", Battery)[-1].share == pytest.approx(0.8)


def test_it_is_charged_at_the_dock(ros):
    battery = ros.run("robot/battery")
    ros.advance(10.0)
    assert ros.call("/dock", Dock.Request(station="home")).accepted
    ros.wait_until(lambda: battery.logs[-1].text == "docked at home", timeout=1.0)
    ros.advance(5.0)
    assert ros.messages("/battery")[-1].share == pytest.approx(0.95)


def test_it_says_where_it_is(ros):
    ros.run("robot/battery")
    ros.settle()
    assert ros.messages("/tf_static", TFMessage)[0].transforms[0].child_frame_id == "battery"
