"""The kinematics of a six-wheeled rover, with messages of its own."""

import pytest
from geometry_msgs.msg import Twist
from osr_interfaces.msg import CommandCorner, CommandDrive

PARAMETERS = {
    "rover_dimensions.d1": 0.184,
    "rover_dimensions.d2": 0.267,
    "rover_dimensions.d3": 0.267,
    "rover_dimensions.d4": 0.256,
    "rover_dimensions.wheel_radius": 0.075,
    "drive_no_load_rpm": 223.0,
    "enable_odometry": True,
    "publish_transform": True,
}


def command(x, z):
    twist = Twist()
    twist.linear.x, twist.angular.z = x, z
    return twist


@pytest.fixture
def rover(ros):
    return ros.run("osr_control/rover", parameters=PARAMETERS)


def test_straight(ros, rover):
    ros.publish("/cmd_vel", command(0.3, 0.0))
    ros.settle()
    drive = ros.messages("/cmd_drive", CommandDrive)[-1]
    assert drive.left_front_vel == -drive.right_front_vel == pytest.approx(0.3 / 0.075)


def test_turn(ros, rover):
    ros.publish("/cmd_vel", command(0.3, 0.3))
    ros.settle()
    corner = ros.messages("/cmd_corner", CommandCorner)[-1]
    drive = ros.messages("/cmd_drive")[-1]
    assert corner.left_front_pos * corner.left_back_pos < 0
    assert abs(drive.left_middle_vel) < abs(drive.right_middle_vel)


def test_backwards_is_mirrored(ros, rover):
    ros.publish("/cmd_vel", command(0.3, 0.0))
    ros.settle()
    ros.publish("/cmd_vel", command(-0.3, 0.0))
    ros.settle()
    first, second = ros.messages("/cmd_drive")
    assert first.left_middle_vel == -second.left_middle_vel
