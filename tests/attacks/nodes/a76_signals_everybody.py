"""Sends every signal that it may send to everybody, and takes the ports of those who come later."""

import os
import signal
import socket

from attempts import attempt, run

KEPT = []


@attempt
def ends_everybody(node):
    """All processes but itself; what would have been hit is seen from outside."""
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    for to in (-1, 0):
        try:
            os.kill(to, signal.SIGTERM)
        except OSError:
            continue
    signal.signal(signal.SIGTERM, before)
    return False


@attempt
def stops_everybody(node):
    own = {*map(int, os.listdir("/proc/self/task")), os.getpgid(0)}
    for number in range(1, 400):
        if number not in own:
            for which in (signal.SIGSTOP, signal.SIGKILL):
                try:
                    os.kill(number, which)
                except OSError:
                    continue
    return False


@attempt
def takes_ports_of_others(node):
    """Of the domains of later scenarios; each scenario has a domain that no other has."""
    for domain in range(60, 100):
        for port in (7410, 7411):
            with_port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            try:
                with_port.bind(("127.0.0.1", 250 * domain + port))
                KEPT.append(with_port)
            except OSError:
                with_port.close()
    return False


run()
