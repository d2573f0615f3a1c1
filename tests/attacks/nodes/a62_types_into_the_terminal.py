"""Types a command into the terminal of whoever started the grader."""

import fcntl
import os

from attempts import attempt, run

TIOCSTI, TIOCLINUX, TIOCSCTTY = 0x5412, 0x541C, 0x540E


@attempt
def types(node):
    return [number for number in (0, 1, 2) if works(number, TIOCSTI)]


@attempt
def types_into_the_controlling_terminal(node):
    return works(os.open("/dev/tty", os.O_RDWR), TIOCSTI)


@attempt
def types_into_a_new_terminal(node):
    terminal = os.open("/dev/ptmx", os.O_RDWR)
    return works(terminal, TIOCSTI) or works(terminal, TIOCLINUX)


@attempt
def reads_what_is_typed(node):
    return os.isatty(0) or os.read(0, 1)


def works(number, request):
    try:
        fcntl.ioctl(number, request, b"x")
    except OSError:
        return False
    return True


run()
