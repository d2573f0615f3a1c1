"""Walks through everything there is and looks for the instructor's secret by name and by content."""

import os
import sys

from attempts import attempt, holds_canary, run

LIBRARIES = (sys.prefix, sys.base_prefix, "/usr", "/lib", "/opt", "/proc", "/sys")


FILES = []


def files():
    """Return every file, walked through once."""
    for folder, folders, names in os.walk("/") if not FILES else ():
        FILES.extend(os.path.join(folder, name) for name in names)
        if folder in ("/proc", "/sys"):
            folders.clear()
    return FILES


@attempt
def by_name(node):
    return [path for path in files() if path.endswith("/canary.txt")]


@attempt
def by_content(node):
    found = False
    for path in files():
        if path.startswith(LIBRARIES) or not os.path.isfile(path):
            continue
        try:
            with open(path, "rb") as file:
                found |= holds_canary(file.read(1 << 16))
        except OSError:
            continue
    return found


run()
