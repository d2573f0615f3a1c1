"""Behaves for the first second, then goes to sleep for good."""

import time

from attempts import attempt, every_tick, run


@attempt
def behaves(node):
    return False


@every_tick
def explode(node):
    if node.ticks == 20:
        time.sleep(10**6)


run()
