"""Starts processes that start processes."""

import time

from attempts import attempt, spawn, run


def sleep_long():
    import ctypes

    ctypes.CDLL(None).sleep(600)


@attempt
def more_than_200_processes(node):
    count = 0
    try:
        while count <= 200:
            spawn(sleep_long)
            count += 1
    except OSError:
        pass
    print("processes:", count, time.time(), flush=True)
    return count > 200


run()
