"""Overwrites every segment of shared memory that others use to exchange messages."""

import os

from attempts import attempt, run


@attempt
def scribbles(node):
    found = []
    for name in os.listdir("/dev/shm"):
        path = os.path.join("/dev/shm", name)
        if not os.path.isfile(path) or name.startswith("lttng-ust-wait"):  # these are its own
            continue
        with open(path, "r+b") as file:
            file.write(b"\xff" * min(os.path.getsize(path), 1 << 16))
        found.append(name)
    return found


@attempt
def leaves_a_segment(node):
    with open("/dev/shm/fastrtps_port7411", "wb") as file:
        file.write(b"\xff" * 4096)
    return False


run()
