"""Malformed packets of the wire protocol: they cost at most the node that sends them, and not the next submission."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from hostile import hostile, record

from grader.runtime.model.trace import AssessedTrace
from grader.runtime.session import RecordingSession

pytestmark = pytest.mark.ros

WRITER = b"<of>"
ONE = struct.pack("<iI", 0, 1)
#: Submessages by kind with a plausible body (DDSI-RTPS 2.3, 9.4.5): to every reader, from the sender's own writer.
BODIES = {
    0x06: bytes(4) + WRITER + ONE + struct.pack("<III", 32, 0xFFFFFFFF, 7),  # acknowledges
    0x07: bytes(4) + WRITER + ONE + struct.pack("<iII", 0, 50, 7),  # has messages 1 to 50
    0x09: struct.pack("<II", 1, 0),  # time stamp
    0x0E: b"<- the GUID>",  # destination
    0x12: bytes(4) + WRITER + ONE + struct.pack("<IIII", 1, 32, 0xFFFFFFFF, 7),  # lacks fragments
    0x13: bytes(4) + WRITER + ONE + struct.pack("<II", 4, 7),  # has fragments
    0x15: struct.pack("<HH", 0, 16) + bytes(4) + WRITER + struct.pack("<iI", 0, 300) + b"\0\1\0\0" + bytes(48),  # data
    0x16: struct.pack("<HH", 0, 28)
    + bytes(4)
    + WRITER
    + struct.pack("<iIIHHI", 0, 301, 1, 1, 16, 52)
    + b"\0\1\0\0"
    + bytes(12),  # a fragment
}
GAP = bytes(4) + WRITER + struct.pack("<iIiII", 0, 100, 0, 200, 0)  # messages 100 to 199 will never come
EXTREMES = (0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)


def packet(kind: int, body: bytes) -> bytes:
    """Return a packet in the name of the sender, who fills in its participant and its writer."""
    return b"RTPS\x02\x03\x01\x0f<- the GUID>" + struct.pack("<BBH", kind, 1 if kind != 0x15 else 5, len(body)) + body


def mutants(bodies: Mapping[int, bytes]) -> list[bytes]:
    """Return packets with each word, and each half of a word in the head, at its extremes, and with their ends cut."""
    found = []
    for kind, body in bodies.items():
        whole = packet(kind, body)
        for at in range(20, len(whole), 4):
            found += [whole[:at] + struct.pack("<I", value) + whole[at + 4 :] for value in EXTREMES]
        found += [whole[:22] + struct.pack("<H", length) + whole[24:] for length in (1, len(body) + 4, 0xFFFF)]
        found += [whole[:cut] for cut in (20, 23, 26, len(whole) - 1)]
    return found


#: Sends a tenth of the packets at each of ten ticks, to all participants of its domain.
SENDS = """
if 20 <= self.count < 30:
    import struct
    info = self.get_publishers_info_by_topic("/cmd_vel")[0]
    guid = bytes(info.endpoint_gid)
    base = 7400 + 250 * int(os.environ["ROS_DOMAIN_ID"])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there:
        for packet in PACKETS[self.count - 20 :: 10]:
            whole = packet.replace(b"<- the GUID>", guid[:12]).replace(b"<of>", guid[12:16])
            for port in (base, base + 1, *range(base + 10, base + 26)):
                there.sendto(whole, ("127.0.0.1", port))
"""


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., AssessedTrace]:
    tmp_path.chmod(0o755)
    numbers = itertools.count()
    return lambda *programs, **fields: record(session, tmp_path / f"s{next(numbers)}", *programs, **fields)


def sender(packets: list[bytes]) -> str:
    return hostile(before=f"PACKETS = {packets!r}", later=SENDS)


@pytest.mark.long
def test_malformed_packets_cost_only_their_sender(run: Callable[..., Any]) -> None:
    """It may lose its own messages, or end at a limit; the next submission gets what it deserves."""
    packets = mutants(BODIES)
    assert 300 <= len(packets) <= 500
    trace = run(sender(packets))
    assert not trace.harness_problem
    assert len(trace.messages("/cmd_vel")) <= 199
    after = run(hostile())
    assert (after.harness_problem, after.faults(), len(after.messages("/cmd_vel"))) == ("", (), 199)


@pytest.mark.nightly  # it takes the processor time that a worker may use, twice
def test_packets_that_keep_the_worker_busy_cost_only_their_sender(run: Callable[..., Any]) -> None:
    """Among them is a gap over two thousand million messages: each is noted, or computed without end.

    The worker is ended, and nothing is judged in the sender's favour: its fault, or undecided on a busy machine.
    """
    trace = run(sender(mutants({0x08: GAP})))
    assert trace.faults() or trace.harness_problem
    after = run(hostile())
    assert (after.harness_problem, after.faults(), len(after.messages("/cmd_vel"))) == ("", (), 199)
