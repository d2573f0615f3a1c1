"""Repeats what it hears of the wire protocol with bytes changed, in the names of those who sent it."""

import random

import rtps
from attempts import attempt, every_tick, run

DICE = random.Random(38)
STATE = {"here": None, "packets": [rtps.HEADER + bytes(12) + rtps.submessage(kind, bytes(40)) for kind in range(1, 30)]}


@attempt
def listens(node):
    STATE["here"] = rtps.listen()
    return False


@every_tick
def fuzz(node):
    STATE["packets"] = (STATE["packets"] + rtps.heard(STATE["here"]))[-100:]
    for _ in range(20):
        packet = bytearray(DICE.choice(STATE["packets"]))
        for _ in range(DICE.randrange(1, 6)):
            packet[DICE.randrange(4, len(packet))] = DICE.randrange(256)
        rtps.everywhere(bytes(packet))


run(rate_hz=5)
