"""Sends 400 packets of the wire protocol with one field changed, each in turn, always the same ones."""

import itertools
import struct

import rtps
from attempts import attempt, every_tick, run

EXTREMES = (0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
PER_TICK, MOST = 40, 400
STATE = {"here": None, "packets": [], "sent": 0}


@attempt
def listens(node):
    STATE["here"] = rtps.listen()
    return False


def patterns():
    """Return one packet of each kind of submessage, in the name of whoever was heard."""
    for prefix in sorted(rtps.prefixes(STATE["packets"])) or [bytes(range(12))]:
        for kind, size in ((0x06, 28), (0x07, 28), (0x08, 32), (0x09, 8), (0x0E, 12), (0x12, 28), (0x13, 32), (0x16, 40)):
            yield rtps.HEADER + prefix + rtps.submessage(kind, bytes(size))
        yield rtps.data(prefix, rtps.SPDP_READER, rtps.SPDP_WRITER, 1, b"\0\3\0\0" + bytes(60))
        yield rtps.data(prefix, rtps.SEDP_READER, rtps.SEDP_WRITER, 1, b"\0\3\0\0" + bytes(60))


def mutants():
    """Yield packets with each word, and each length, at its extremes."""
    patterns_ = [*patterns(), *STATE["packets"][:4]]
    for at in range(20, 120, 4):
        for packet, value in itertools.product(patterns_, EXTREMES):
            if at + 4 <= len(packet):
                yield packet[:at] + struct.pack("<I", value) + packet[at + 4 :]
    for packet in patterns_:
        yield packet[:-1]
        yield packet[:22] + b"\xff\xff" + packet[24:]


@every_tick
def send(node):
    STATE["packets"] = (STATE["packets"] + rtps.heard(STATE["here"]))[:20]
    if node.ticks < 3 or STATE["sent"] >= MOST:
        return
    for packet in itertools.islice(mutants(), STATE["sent"], STATE["sent"] + PER_TICK):
        rtps.everywhere(packet)
    STATE["sent"] += PER_TICK


run(rate_hz=5)
