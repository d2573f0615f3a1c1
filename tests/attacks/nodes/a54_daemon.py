"""Leaves processes behind, in sessions of their own, whose parents are gone."""

import os
import subprocess
import sys

from attempts import LIBC, attempt, run, spawn
from planted import MARK


@attempt
def starts_daemons(node):
    sleeper = [sys.executable, "-I", "-S", "-c", "import time; time.sleep(600)", MARK]
    for _ in range(3):
        subprocess.Popen(sleeper, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def twice():
        LIBC.setsid()
        if LIBC.fork() == 0:
            os.execv(sleeper[0], sleeper)

    os.waitpid(spawn(twice), 0)
    return False


run()
