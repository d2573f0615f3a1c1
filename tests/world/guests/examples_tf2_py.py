"""The examples of tf2 for rclpy."""

import pytest


def test_dynamic(ros):
    ros.run("examples_tf2_py/dynamic_broadcaster")
    ros.advance(2.0)
    assert ros.rate("/tf") == pytest.approx(30, abs=0.01)


def test_static(ros):
    ros.run("examples_tf2_py/static_broadcaster")
    ros.settle()
    assert len(ros.messages("/tf_static")) == 1


def test_waits(ros):
    waiter = ros.run("examples_tf2_py/waits_for_transform")
    ros.advance(1.0)
    ros.run("examples_tf2_py/static_broadcaster")
    ros.run("examples_tf2_py/dynamic_broadcaster")
    ros.advance(3.0)
    assert any("Got" in log.text for log in waiter.logs), [log.text for log in waiter.logs]
