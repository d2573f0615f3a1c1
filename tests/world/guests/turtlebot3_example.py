"""A node that stops before obstacles."""

from geometry_msgs.msg import Twist
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan


def test_waits_for_a_scan(ros):
    ros.run("turtlebot3_example/turtlebot3_obstacle_detection")
    ros.advance(1.0)
    assert ros.messages("/cmd_vel") == []


def test_stops(ros):
    ros.run("turtlebot3_example/turtlebot3_obstacle_detection")
    ros.publish("/scan", LaserScan(ranges=[2.0] * 360), rate=5)
    ros.advance(1.0)
    assert ros.messages("/cmd_vel")[-1].linear.x == 0.2
    ros.publish("/scan", LaserScan(ranges=[0.3] * 360), rate=5)
    ros.wait_until(lambda: ros.messages("/cmd_vel")[-1].linear.x == 0.0, timeout=0.5)


def test_teleop(ros):
    ros.run("turtlebot3_example/turtlebot3_obstacle_detection")
    ros.publish("/scan", LaserScan(ranges=[2.0] * 360), rate=5, qos=qos_profile_sensor_data)
    command = Twist()
    command.linear.x = 0.7
    ros.publish("/cmd_vel_raw", command)
    ros.advance(1.0)
    assert ros.messages("/cmd_vel")[-1].linear.x == 0.7
