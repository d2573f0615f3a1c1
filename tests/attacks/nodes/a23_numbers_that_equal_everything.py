"""Publishes numbers that say they equal whatever they are compared with, and numbers that are none."""

from attempts import attempt, every_tick, run
from geometry_msgs.msg import Twist


class Anything(float):
    def __eq__(self, other):
        return True

    def __le__(self, other):
        return True

    __ge__ = __lt__ = __gt__ = __le__
    __hash__ = float.__hash__

    def __sub__(self, other):
        return Anything(0.0)

    __rsub__ = __sub__


@attempt
def odd_numbers(node):
    for value in (float("nan"), float("inf"), -float("inf"), -0.0, 1e308):
        command = Twist()
        command.linear.x = value
        node.publisher.publish(command)
    return False


run(speed=Anything(0.1))
