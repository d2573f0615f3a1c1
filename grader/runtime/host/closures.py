"""Imports ctypes, with the file that its library keeps open out of the way of the program's own files.

libffi 3.4 and later may map the code of callbacks from its own file, which it opens for the first callback and needs
for later ones (`src/tramp.c` there). Debian's does from 3.5 on. A process that is forked must not close that file, and
a program must find the same numbers free whether its process was forked or executed.
"""

from __future__ import annotations

import contextlib
import os

#: The number that the file gets: above those that a program opens, below the least limit (`core.limits`).
HIGH = 60


def _import() -> int | None:
    """Import ctypes while all lower numbers are taken; return the number of the file, None if there is none."""
    taken = [os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC)]
    while taken[-1] < HIGH - 1:
        taken.append(os.dup(taken[0]))
    try:
        import ctypes

        ctypes.CFUNCTYPE(None)(int)
    finally:
        for descriptor in taken:
            os.close(descriptor)
    with contextlib.suppress(OSError):
        os.set_inheritable(HIGH, False)  # noqa: FBT003 - Python's
        return HIGH
    return None


#: The number of the file that ctypes needs, None if it needs none.
KEPT = _import()
