"""Packets of the wire protocol of DDS, made by hand: enough to listen, to forge and to garble."""

import os
import socket
import struct

DOMAIN = int(os.environ.get("ROS_DOMAIN_ID", "0"))
BASE = 7400 + 250 * DOMAIN
GROUP = "239.255.0.1"
HEADER = b"RTPS\x02\x03\x01\x0f"
# Built-in writers and readers of participants and endpoints.
SPDP_WRITER, SPDP_READER = b"\x00\x01\x00\xc2", b"\x00\x01\x00\xc7"
SEDP_WRITER, SEDP_READER = b"\x00\x00\x03\xc2", b"\x00\x00\x03\xc7"


def udp():
    there = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    there.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
    return there


def ports():
    """Return the ports that participants of this domain listen to."""
    return [BASE, BASE + 1, *(BASE + 10 + number for number in range(40))]


def listen():
    """Return a socket that hears the announcements of all participants of the domain."""
    here = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    here.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    here.bind(("", BASE))
    membership = socket.inet_aton(GROUP) + socket.inet_aton("127.0.0.1")
    here.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
    here.setblocking(False)
    return here


def heard(here):
    """Return the packets that have arrived, without waiting."""
    packets = []
    while len(packets) < 200:
        try:
            packets.append(here.recv(65536))
        except OSError:
            break
    return packets


def prefixes(packets):
    """Return the participants that sent packets."""
    return {packet[8:20] for packet in packets if packet[:4] == b"RTPS"}


def everywhere(packet):
    """Send a packet to everybody in the domain."""
    with udp() as there:
        for port in ports():
            for address in ("127.0.0.1", GROUP):
                try:
                    there.sendto(packet, (address, port))
                except OSError:
                    continue


def submessage(kind, body, flags=1):
    return struct.pack("<BBH", kind, flags, len(body)) + body


def data(prefix, reader, writer, sequence, payload, status=None):
    """Return a packet with one sample; a status of 3 disposes and unregisters what it is about."""
    inline = b"" if status is None else struct.pack("<HH", 0x71, 4) + struct.pack(">I", status) + struct.pack("<HH", 1, 0)
    body = struct.pack("<HH", 0, 16) + reader + writer + struct.pack("<iI", 0, sequence) + inline + payload
    return HEADER + prefix + submessage(0x15, body, 5 if status is None else 11)


def heartbeat(prefix, reader, writer, first, last, count):
    body = reader + writer + struct.pack("<iIiII", 0, first, 0, last, count)
    return HEADER + prefix + submessage(0x07, body)


def gap(prefix, reader, writer, first, until):
    body = reader + writer + struct.pack("<iI", 0, first) + struct.pack("<iII", 0, until, 0)
    return HEADER + prefix + submessage(0x08, body)


def acknack(prefix, reader, writer, base, count):
    body = reader + writer + struct.pack("<iIII", 0, base, 0, count)
    return HEADER + prefix + submessage(0x06, body)
