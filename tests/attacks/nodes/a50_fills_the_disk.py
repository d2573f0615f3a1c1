"""Fills every place that it can write to: with bytes, with a sparse file, with names."""

import os

from attempts import attempt, every_tick, run

MIB = 1 << 20
PLACES = ("/tmp", "/tmp/home", "/tmp/work", "/dev/shm", "/dev", "/run", "/var/tmp")


@attempt
def more_than_128_mib(node):
    return sum(fill(place) for place in PLACES) > 128


@attempt
def a_sparse_file_of_a_tebibyte(node):
    with open("/tmp/sparse", "wb") as file:
        os.truncate(file.fileno(), 1 << 40)
    return True


@every_tick
def fifty_thousand_names(node):
    """Fill a folder with empty files; who is still there afterwards was not stopped."""
    if node.ticks == 10:
        os.mkdir("/tmp/names")
        for number in range(50_000):
            os.mknod(f"/tmp/names/{number}")


def fill(place):
    written = 0
    try:
        for number in range(200):
            with open(f"{place}/fill-{number}", "wb", buffering=0) as file:
                written += file.write(b"x" * MIB) == MIB
    except OSError:
        pass
    for number in range(200):
        try:
            os.remove(f"{place}/fill-{number}")
        except OSError:
            break
    return written


run()
