"""Ignores every request to end, and goes on in what Python calls at the very end."""

import atexit
import signal

from attempts import attempt, run


class Stays:
    def __del__(self):
        loop()


def loop(*_):
    while True:
        pass


@attempt
def ignores_signals(node):
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM, signal.SIGPIPE):
        signal.signal(number, signal.SIG_IGN)
    atexit.register(loop)
    node.stays = Stays()
    return False


run()
