"""Asks for a core dump of unlimited size and dies, to leave a file on the machine."""

import os
import resource

from attempts import attempt, every_tick, run


@attempt
def raises_the_limit(node):
    resource.setrlimit(resource.RLIMIT_CORE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    return True


@attempt
def reads_a_limit_above_nothing(node):
    return any(resource.getrlimit(resource.RLIMIT_CORE))


@every_tick
def die(node):
    if node.ticks == 10:
        os.abort()


run()
