"""Says farewell for participants that ended without it, so that all others forget them at once.

A participant that leaves sends all others a message that disposes of what they know of it (RTPS 2.3, 8.5.3 and 9.6.2).
One that is killed sends none, and the others forget it when its lease ends, which Fast DDS counts in real time. In
virtual time the grader sends the message in its place, when the lease ends there.
"""

from __future__ import annotations

import contextlib
import socket
import struct
from collections.abc import Iterable

#: The ports at which participants hear of each other (RTPS 2.3, 9.6.1.1): the first one of a domain, the distance to
#: the next domain's, the first one of a participant, and the distance to the next participant's.
PORT, OF_DOMAIN, OF_PARTICIPANTS, OF_PARTICIPANT = 7400, 250, 10, 2
#: The address at which all participants of a domain hear, at its first port (9.6.1.4.1).
GROUP = "239.255.0.1"
#: How many participants of a domain have ports of their own before those of the next domain begin.
PARTICIPANTS = (OF_DOMAIN - OF_PARTICIPANTS) // OF_PARTICIPANT
#: The beginning of a message: protocol, version 2.3, and eProsima as vendor.
HEADER = b"RTPS\x02\x03\x01\x0f"
#: The ends of a participant that announce it and hear of others, and the participant itself.
READER, WRITER, PARTICIPANT = (bytes.fromhex(entity) for entity in ("000100c7", "000100c2", "000001c1"))
#: The kind of a submessage with data; that it is little endian and has parameters in front of its data, here alone.
DATA, FLAGS = 0x15, 0x03
#: The parameters: which participant, what becomes of it (disposed of and unregistered), and that no more follow.
KEY_HASH, STATUS_INFO, SENTINEL = 0x70, 0x71, 0x01
GONE = bytes((0, 0, 0, 3))
#: Later than all that the participant has sent: its number of announcements is far below it.
LAST = 0x7FFFFFFF


def say_for(participants: Iterable[bytes], domain: int) -> None:
    """Tell every participant of a domain on this machine that some others have left.

    Args:
        participants: The first twelve bytes of the GUIDs of each that has left.
        domain: The ROS domain.
    """
    first = PORT + OF_DOMAIN * domain
    own = [("127.0.0.1", first + OF_PARTICIPANTS + OF_PARTICIPANT * number) for number in range(PARTICIPANTS)]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        for prefix in participants:
            message = farewell(prefix)
            # To the group as well: what the participant has announced there is read before it, however late.
            for address in ((GROUP, first), *own):
                with contextlib.suppress(OSError):  # nobody listens there, or not any more
                    out.sendto(message, address)


def farewell(prefix: bytes) -> bytes:
    """Return the message with which a participant leaves, by the first twelve bytes of its GUID."""
    parameters = _parameter(KEY_HASH, prefix + PARTICIPANT) + _parameter(STATUS_INFO, GONE) + _parameter(SENTINEL, b"")
    number = struct.pack("<iI", 0, LAST)
    # no further flags, and the parameters begin behind the two ends and the number
    body = struct.pack("<HH", 0, len(READER + WRITER + number)) + READER + WRITER + number + parameters
    return HEADER + prefix + struct.pack("<BBH", DATA, FLAGS, len(body)) + body


def _parameter(kind: int, value: bytes) -> bytes:
    return struct.pack("<HH", kind, len(value)) + value
