"""Opens what the instructor keeps to himself, by its absolute path and by climbing up."""

import os

from attempts import attempt, opens, run
from planted import HIDDEN


@attempt
def absolute(node):
    return any([try_open(path) for path in HIDDEN])


@attempt
def climbing(node):
    here = os.path.dirname(os.path.abspath(__file__))
    return any([try_open(os.path.join(here, "../" * depth + path.lstrip("/"))) for path in HIDDEN for depth in range(8)])


@attempt
def through_root_of_the_first_process(node):
    return any([try_open(f"/proc/{process}/root{path}") for path in HIDDEN for process in (1, os.getppid())])


def try_open(path):
    try:
        return opens(path)
    except OSError:
        return False


run()
