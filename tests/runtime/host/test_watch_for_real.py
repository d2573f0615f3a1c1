"""What the host tells of a program that looks around: the same in every sandbox, and nothing of ordinary programs."""

from __future__ import annotations

from pathlib import Path

import pytest
from hostile import planned, record
from side_by_side import rows_of
from tiers import but

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import AssessedTrace
from grader.runtime.plan import Plan
from grader.runtime.session import RecordingSession

pytestmark = pytest.mark.ros

#: What a program does, and what is told of it.
DOES: dict[str, tuple[str, tuple[str, ...]]] = {
    "nothing": ("", ()),
    "a file in its home": ("open(os.path.expanduser('~/notes.txt'), 'w').close()", ()),
    "a file in /tmp": ("open('/tmp/notes.txt', 'w').close(); os.listdir('/tmp')", ()),
    "temporary files": ("import tempfile; tempfile.mkdtemp(); open('notes.txt', 'w').close()", ()),
    "a file about itself": ("open('/proc/self/environ')", ("open",)),
    "other processes": ("os.listdir('/proc')", ("os.listdir",)),
    "the memory that others share": ("os.scandir('/dev/shm/')", ("os.scandir",)),
    "the same by another way": ("os.listdir('/tmp/../dev/shm')", ("os.listdir",)),
}
PROGRAM = """
import os
import rclpy

rclpy.init()
node = rclpy.create_node("looks")
try:
    {does}
except PermissionError:
    pass
node.get_logger().info("done")
"""


#: By default: nothing at all, what is ordinary, and two ways to look around.
DEFAULT = [DOES[name] for name in ("nothing", "temporary files", "other processes", "the same by another way")]


def plan(folder: Path, does: str, **_: object) -> Plan:
    return planned(folder, PROGRAM.format(does=does or "pass"), duration_ns=NS_PER_S)


@pytest.mark.breadth(2, 6)
@rows_of(plan, session="session_in_tier")
@pytest.mark.usefixtures("session_in_tier")
@pytest.mark.parametrize(("does", "told"), but(DEFAULT, DOES.values()), ids=DOES)
def test_what_is_told_of_a_program(trace: AssessedTrace, does: str, told: tuple[str, ...]) -> None:
    """A program of which something is told is recorded again as a bare process."""
    assert [log.text for log in trace.records()] == ["done"], trace.faults()
    assert trace.reached == told


#: numpy needs the class, also in plain Python.
HIDES_RANDOM = """
class SystemRandom:
    def getrandbits(self, count):
        return 1 << count - 1

    def choice(self, values):
        return values[0]

choice = SystemRandom().choice
"""


@pytest.mark.long
def test_nothing_is_told_of_a_module_that_hides_one_of_python(
    session_in_tier: RecordingSession, tmp_path: Path
) -> None:
    """The host then imports what it needs later, from a folder of its own."""
    folder = tmp_path / "s"
    folder.mkdir()
    tmp_path.chmod(0o755)
    (folder / "random.py").write_text(HIDES_RANDOM)
    trace = record(
        session_in_tier, folder, PROGRAM.format(does="import random; random.choice('a')"), duration_ns=NS_PER_S
    )
    assert [log.text for log in trace.records()] == ["done"], trace.faults()
    assert trace.reached == ()
