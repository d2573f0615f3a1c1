"""Sends random bytes to every port on which participants of DDS listen."""

import random

import rtps
from attempts import attempt, every_tick, run

DICE = random.Random(37)


@attempt
def starts(node):
    return False


@every_tick
def send(node):
    for _ in range(20):
        rtps.everywhere(DICE.randbytes(DICE.randrange(1, 1400)))


run(rate_hz=5)
