"""Opens sockets that lead past the network: to the hypervisor, to the wire, to the kernel."""

import socket
import struct

from attempts import attempt, run


@attempt
def to_the_hypervisor(node):
    return socket.socket(40, socket.SOCK_STREAM)


@attempt
def to_the_wire(node):
    return socket.socket(17, socket.SOCK_RAW, 0x300)


@attempt
def raw(node):
    return socket.socket(socket.AF_INET, socket.SOCK_RAW, 1)


@attempt
def to_the_crypto_api(node):
    return socket.socket(38, socket.SOCK_SEQPACKET)


@attempt
def to_radios_and_buses(node):
    return [family for family in (29, 31, 35, 39, 41, 44) if opens(family)]


@attempt
def adds_a_network_interface(node):
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, 0) as kernel:
        # RTM_NEWLINK, asking for an acknowledgement: what comes back is an error number.
        request = struct.pack("=IHHIIBxHiII", 32, 16, 0x605, 1, 0, 0, 0, 0, 0, 0)
        kernel.send(request)
        answer = kernel.recv(4096)
    return struct.unpack_from("=i", answer, 16)[0] == 0


def opens(family):
    try:
        socket.socket(family, socket.SOCK_RAW)
    except OSError:
        return False
    return True


run()
