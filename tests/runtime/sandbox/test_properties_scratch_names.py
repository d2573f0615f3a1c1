"""How many names there are in scratch folders, tried in the sandboxes that have their own."""

import os
from pathlib import Path

import pytest
from sandboxes import close, find_sandbox, start
from tiers import tiers

from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.ros_installation import find_ros
from grader.runtime.usage import families, scratch_names

pytestmark = pytest.mark.sandbox

CODE = """
import os, time
for number in range(700):
    os.mknod(f"{folder}/{{number}}")
print("ready", flush=True)
time.sleep(60)
"""


@pytest.mark.parametrize("folder", ["/tmp", "/tmp/work", "/dev/shm"])
@pytest.mark.parametrize("tier", tiers("bubblewrap-root", "bubblewrap"))
def test_names_are_counted_wherever_a_student_may_make_them(tier: str, folder: str, submission: Path) -> None:
    """From outside, in the file systems that the student's processes see."""
    try:
        sandbox = find_sandbox(tier, find_ros(), submission)
    except EnvironmentFault as fault:
        pytest.skip(fault.message)
    if isinstance(sandbox, str):
        pytest.skip(sandbox)
    student = sandbox.student(CODE.format(folder=folder))
    with start(sandbox.around(student)) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        found = scratch_names(families([process.pid])[process.pid])
        process.kill()
    close(student)
    assert 700 <= found < 800


def test_names_in_the_machines_own_folders_are_nobodys() -> None:
    """A process outside of a sandbox has none, and neither has one that is gone."""
    assert scratch_names([os.getpid(), 2**22 + 1]) == 0
    assert scratch_names([]) == 0
