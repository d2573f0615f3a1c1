"""Publishes bytes that are no message: too short, too long, with lengths that lead out of them."""

import random

from attempts import attempt, every_tick, run
from geometry_msgs.msg import Twist
from std_msgs.msg import String

DICE = random.Random(36)
TEXTS = (b"\0\1\0\0" + b"\xff" * 8, b"\0\1\0\0\xff\xff\xff\x7fabc", b"\0\1\0\0\4\0\0\0\xff\xfe\xfd\xfc", b"\0", b"\0\1\0\0")


@attempt
def prepares(node):
    node.garbage = node.create_publisher(Twist, "/garbage", 10)
    node.text = node.create_publisher(String, "/text", 10)
    return False


@every_tick
def send(node):
    for text in (*TEXTS, b"\0\1\0\0" + DICE.randbytes(DICE.randrange(80))):
        for publisher in (node.text, node.garbage):
            try:
                publisher.publish(text)
            except RuntimeError:  # this one the middleware itself refuses
                continue


run()
