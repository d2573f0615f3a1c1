"""Measures which lines of a program run, with coverage.py and the options of the process that runs its test."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Mapping
from typing import Any

from . import originals


def measure_lines(told: Mapping[str, Any]) -> Callable[[], None]:
    """Measure from now on; return what writes the lines that have run so far, and may be called again.

    coverage.py would name its file by host, process and chance. In virtual time, all of them can be those of another
    process.

    Args:
        told: The `folder` of the package coverage; its `data_file`; and `options` of coverage's configuration by name.
    """
    sys.path.append(told["folder"])  # of this user alone, it is not on the path
    try:
        from coverage import Coverage
        from coverage.exceptions import CoverageException
    finally:
        sys.path.pop()
    suffix = f"node.{originals.urandom(8).hex()}"
    measured = Coverage(data_file=told["data_file"], data_suffix=suffix, config_file=False)
    for name, value in told["options"].items():
        with contextlib.suppress(CoverageException):  # another process may have found another version
            measured.set_option(name, value)
    measured.start()

    def write() -> None:
        # What it reads and writes then belongs to no program, and neither does what goes wrong.
        with contextlib.suppress(Exception):
            measured.save()

    return write
