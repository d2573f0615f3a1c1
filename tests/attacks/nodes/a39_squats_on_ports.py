"""Takes the ports of the domain before ROS starts, so that nobody else can listen there."""

import socket

import rtps

TAKEN = []
for port in rtps.ports():
    there = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    there.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        there.bind(("0.0.0.0", port))
    except OSError:
        continue
    TAKEN.append((port, there))

from attempts import attempt, run


@attempt
def took_a_port_away_from_the_grader(node):
    return len(TAKEN) == len(rtps.ports())


run(rate_hz=5)
