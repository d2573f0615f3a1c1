"""Kills itself, so that its node stays in the graph for others until its lease ends."""

import os
import signal

from attempts import attempt, every_tick, run


@attempt
def ready(node):
    return False


@every_tick
def die(node):
    if node.ticks == 10:
        os.kill(os.getpid(), signal.SIGKILL)


run()
