"""The example of the documentation, word for word."""

import pytest
from sensor_msgs.msg import LaserScan

from grader.world.world import World

pytestmark = pytest.mark.ros


def test_the_robot_stops_before_a_wall(ros: World) -> None:
    """A node with a timer of 20 Hz reacts to a stream of scans, and ends at Ctrl-C."""
    robot = ros.run("nodes/obstacle_stop.py", parameters={"distance": 0.5})
    ros.publish("/scan", LaserScan(ranges=[2.0] * 360), rate=10)
    ros.advance(5.0)
    assert ros.messages("/cmd_vel")[-1].linear.x == 0.2
    ros.publish("/scan", LaserScan(ranges=[0.4] * 360), rate=10)
    ros.wait_until(lambda: ros.messages("/cmd_vel")[-1].linear.x == 0.0, timeout=1.0)
    assert ros.rate("/cmd_vel") == pytest.approx(20, abs=0.1)
    robot.interrupt()
    assert robot.exit_code == 0
