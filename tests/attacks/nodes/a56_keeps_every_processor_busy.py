"""Runs busy processes beside the node, so that whoever measures time measures it wrongly."""

import subprocess
import sys

from attempts import attempt, run


@attempt
def starts_them(node):
    for _ in range(4):
        subprocess.Popen([sys.executable, "-I", "-S", "-c", "while True: pass"])
    return False


run(rate_hz=5)
