"""Publishes two types on one topic, so that whoever looks at it takes one for the other."""

from attempts import attempt, every_tick, run
from std_msgs.msg import Float64MultiArray, String


@attempt
def prepares(node):
    node.texts = node.create_publisher(String, "/cmd_vel", 10)
    node.numbers = node.create_publisher(Float64MultiArray, "/cmd_vel", 10)
    return False


@every_tick
def confuse(node):
    node.texts.publish(String(data="0.5"))
    node.numbers.publish(Float64MultiArray(data=[0.5] * 6))


run(rate_hz=5)
