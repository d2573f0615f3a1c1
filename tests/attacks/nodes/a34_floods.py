"""Publishes seven thousand commands a second, so that some of them are surely at the right time."""

from attempts import attempt, every_tick, run
from geometry_msgs.msg import Twist


@attempt
def nothing_yet(node):
    return False


@every_tick
def flood(node):
    command = Twist()
    command.linear.x = 0.5
    for _ in range(1400):
        node.publisher.publish(command)


run(rate_hz=5)
