"""Takes descriptors, processors and priority away from the processes of the grader, and stops them."""

import os
import resource
import signal

from attempts import attempt, call, run
from planted import BYSTANDER


def around():
    """Return the processes to be harmed; the first one only if it is the sandbox's own, never the machine's."""
    return {BYSTANDER, *([1] if sandboxed() else []), *([os.getppid()] if os.getppid() > 1 else [])}


def sandboxed():
    try:
        with open("/proc/1/comm") as file:
            return file.read().strip() == "bwrap"
    except FileNotFoundError:  # hidden: only a sandbox does that
        return True
    except OSError:
        return False


@attempt
def limits_those_around_it(node):
    return any([works(resource.prlimit, pid, resource.RLIMIT_NOFILE, (3, 3)) for pid in around()])


@attempt
def lowers_a_bystander(node):
    os.setpriority(os.PRIO_PROCESS, BYSTANDER, 19)
    return os.getpriority(os.PRIO_PROCESS, BYSTANDER) == 19  # what was refused may say that it was done


@attempt
def takes_the_processors(node):
    return works(os.sched_setaffinity, BYSTANDER, {0})


@attempt
def signals_a_bystander(node):
    return works(os.kill, BYSTANDER, 0) or works(os.kill, BYSTANDER, signal.SIGSTOP)


@attempt
def holds_a_bystander(node):
    return call("pidfd_open", BYSTANDER, 0)


@attempt
def raises_itself(node):
    return works(os.sched_setscheduler, 0, os.SCHED_FIFO, os.sched_param(1)) or works(os.nice, -5)


def works(function, *arguments):
    try:
        function(*arguments)
    except OSError:
        return False
    return True


run()
