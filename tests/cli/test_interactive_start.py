"""The time that `grade` shows at its end begins with the command, also in a shell that becomes the command."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys

import pytest
from tiers import each

pytestmark = pytest.mark.slow

#: Prints how long ago the command began, and how long that was after the moment that the shell tells, if it does.
AGE = """
import json, os, time
from grader.cli.interactive import process_start
age = time.monotonic() - process_start()
began = time.time() - age
print(json.dumps([age, began - float(os.environ.get("BEFORE", "0").replace(",", "."))]))
"""


def told(*command: str) -> tuple[float, float]:
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    age, later = json.loads(done.stdout)
    return age, later


@pytest.mark.parametrize(
    "before", each(["sleep 2 &&", "sleep 2;", "(sleep 2);", "sleep 2 & wait;", "sleep 1 | sleep 2;"], 5)
)
def test_what_a_shell_ran_before_is_not_counted(before: str) -> None:
    """The shell replaces itself by its last command, which keeps its process and the time of its start.

    The command may seem to have begun before the shell came to it, but only by the processor time that the shell had
    used by then, not by the two seconds of the other commands.
    """
    last = f"BEFORE=$EPOCHREALTIME exec {shlex.join((sys.executable, '-c', AGE))}"
    _, later = told("bash", "-c", f"{before} {last}")
    assert later > -1


def test_the_start_of_python_is_counted() -> None:
    """A command that the shell starts as a process of its own begins with this process."""
    age, _ = told(sys.executable, "-c", f"import time\ntime.sleep(1)\n{AGE}")
    assert age > 1
