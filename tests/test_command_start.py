"""The time that `grade` shows at its end begins with the command, also in a shell that becomes the command."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys

import pytest

pytestmark = pytest.mark.slow

#: Prints how long ago the command began, and the processor time that this process has used by then.
AGE = """
import json, time
from grader.cli.interactive import process_start
start = process_start()
now, used = time.monotonic(), time.process_time()
print(json.dumps([now - start, used]))
"""


def told(*command: str) -> tuple[float, float]:
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    age, used = json.loads(done.stdout)
    return age, used


@pytest.mark.parametrize("before", ["sleep 2 &&", "sleep 2;", "(sleep 2);", "sleep 2 & wait;", "sleep 1 | sleep 2;"])
def test_what_a_shell_ran_before_is_not_counted(before: str) -> None:
    """The shell replaces itself by its last command, which keeps its process and the time of its start."""
    age, used = told("bash", "-c", f"{before} exec {shlex.join((sys.executable, '-c', AGE))}")
    assert age < used + 1  # the other commands waited for two seconds


def test_the_start_of_python_is_counted() -> None:
    """A command that the shell starts as a process of its own begins with this process."""
    age, _ = told(sys.executable, "-c", f"import time\ntime.sleep(1)\n{AGE}")
    assert age > 1
