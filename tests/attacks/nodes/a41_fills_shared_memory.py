"""Fills the shared memory of the machine and leaves a segment with a name of its own."""

from attempts import attempt, run
from planted import MARK

MIB = 1 << 20


@attempt
def more_than_64_mib(node):
    written = 0
    try:
        with open(f"/dev/shm/{MARK}", "wb", buffering=0) as file:
            while written <= 64 * MIB:
                written += file.write(b"x" * MIB)
    except OSError:
        pass
    return written > 64 * MIB


run()
