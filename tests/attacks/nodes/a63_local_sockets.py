"""Connects to local services: abstract sockets, the message bus, the display, the agent with the keys."""

import glob
import os
import socket

from attempts import attempt, run
from planted import ABSTRACT, UNIX


@attempt
def abstract(node):
    return connects("\0" + ABSTRACT)


@attempt
def by_its_path(node):
    return connects(UNIX)


@attempt
def well_known(node):
    places = ["/run/dbus/system_bus_socket", "/var/run/docker.sock", "/run/docker.sock", "\0/tmp/.X11-unix/X0"]
    places += glob.glob("/tmp/.X11-unix/*") + glob.glob("/run/user/*/bus") + [os.environ.get("SSH_AUTH_SOCK", "/none")]
    return [place for place in places if connects(place)]


@attempt
def finds_it_in_the_list(node):
    with open("/proc/net/unix") as file:
        return ABSTRACT in file.read()


def connects(place):
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as there:
        return there.connect_ex(place) == 0


run()
