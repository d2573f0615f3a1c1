"""Random programs do in virtual time what an independent model says, event by event."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest
from tiers import NIGHTLY, each, more

pytest.importorskip("rclpy")

from counter_examples import COUNTER_EXAMPLES
from program_comparison import compared, differences_of_each
from program_description import Program
from program_strategy import drawn

from grader.runtime.session import RecordingSession

pytestmark = pytest.mark.ros

#: In so many parts, with so many programs each.
PARTS, EACH = 8, 25
#: A few others by default; each part nightly.
PROGRAMS = [
    (PARTS, 6),
    *more(((part, EACH) for part in range(PARTS)), NIGHTLY),
]


@pytest.mark.parametrize(("part", "count"), PROGRAMS)
def test_random_programs_do_what_the_model_says(session: RecordingSession, part: int, count: int) -> None:
    """Two hundred of them, the same ones each time."""
    chosen = drawn(part, count)
    with tempfile.TemporaryDirectory(dir=session.folder) as name:
        folder = Path(name)
        folder.chmod(0o755)
        found = [*differences_of_each(session, chosen, folder)]
    wrong = ["\n".join([repr(program), *differences]) for program, differences in found if differences]
    assert not wrong, "\n\n".join([*wrong, f"python benchmarks/programs.py {EACH} --seed {part} makes them smaller"])


@pytest.mark.breadth(2, 20)
@pytest.mark.parametrize("program", each(COUNTER_EXAMPLES.values(), 3), ids=COUNTER_EXAMPLES)
def test_what_once_was_a_counter_example_is_none(session: RecordingSession, tmp_path: Path, program: Program) -> None:
    """Each was one until the grader, or the model, was corrected."""
    tmp_path.chmod(0o755)
    assert compared(session, program, tmp_path / "s") == []
