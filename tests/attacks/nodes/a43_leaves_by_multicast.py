"""Looks for a network beyond its own machine and sends commands to robots in the classroom."""

import socket

import rtps
from attempts import attempt, run
from planted import MULTICAST, SECRET_TO_SEND


@attempt
def another_interface(node):
    return [name for _, name in socket.if_nameindex() if name != "lo"]


@attempt
def multicast_from_every_address(node):
    with rtps.udp() as there:
        there.sendto(SECRET_TO_SEND, tuple(MULTICAST))
    return False


@attempt
def broadcast(node):
    with rtps.udp() as there:
        there.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        return there.sendto(SECRET_TO_SEND, ("255.255.255.255", 7400))


run()
