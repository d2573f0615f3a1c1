"""Fills memory, in one process and in several, up to a gibibyte."""

import os

from attempts import attempt, run, spawn

MIB = 1 << 20


@attempt
def one_gibibyte_in_one_process(node):
    kept = []
    try:
        for _ in range(64):
            kept.append(b"x" * (16 * MIB))
    except MemoryError:
        pass
    return len(kept) == 64


@attempt
def one_gibibyte_in_four_processes(node):
    done, told = os.pipe()

    def fill():
        kept = []
        for _ in range(16):
            kept.append(b"x" * (16 * MIB))
            os.write(told, b".")

    children = [spawn(fill) for _ in range(4)]
    for child in children:
        os.waitpid(child, 0)
    os.close(told)
    return len(os.read(done, 1000)) == 64


run()
