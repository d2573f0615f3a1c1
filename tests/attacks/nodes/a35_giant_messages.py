"""Publishes messages of five megabytes and sequences of a million elements."""

from attempts import attempt, every_tick, run
from std_msgs.msg import Float64MultiArray, String


@attempt
def prepares(node):
    node.text = node.create_publisher(String, "/text", 1)
    node.numbers = node.create_publisher(Float64MultiArray, "/numbers", 1)
    return False


@every_tick
def send(node):
    if node.ticks in (5, 15):
        node.text.publish(String(data="x" * 5_000_000))
    if node.ticks == 10:
        node.numbers.publish(Float64MultiArray(data=[0.0] * 300_000))


run()
