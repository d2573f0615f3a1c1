"""Random programs do in virtual time what an independent model says, event by event."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("rclpy")

from counter_examples import COUNTER_EXAMPLES
from hostile import staging
from hypothesis import HealthCheck, Phase, given, seed, settings
from program_comparison import compared
from program_description import Program
from program_strategy import programs

from grader.execution.recording_session import RecordingSession, open_session

pytestmark = pytest.mark.ros

#: In so many parts, with so many programs each.
PARTS, EACH = 8, 25


@pytest.fixture(scope="module")
def session() -> Iterator[RecordingSession]:
    """The strongest sandbox of this machine, with one worker."""
    with open_session("auto", 1) as session:
        yield staging(session)


@pytest.mark.parametrize("part", range(PARTS))
def test_random_programs_do_what_the_model_says(session: RecordingSession, part: int) -> None:
    """Two hundred of them, the same ones each time."""

    @seed(part)
    @settings(
        max_examples=EACH,
        database=None,
        deadline=None,
        phases=[Phase.generate, Phase.shrink],
        suppress_health_check=list(HealthCheck),
    )
    @given(programs())
    def agrees(program: Program) -> None:
        with tempfile.TemporaryDirectory(dir=session.folder) as folder:
            found = compared(session, program, Path(folder))
        assert not found, "\n".join([repr(program), *found])

    agrees()


@pytest.mark.parametrize("program", COUNTER_EXAMPLES.values(), ids=COUNTER_EXAMPLES)
def test_what_once_was_a_counter_example_is_none(session: RecordingSession, tmp_path: Path, program: Program) -> None:
    """Each was one until the grader, or the model, was corrected."""
    tmp_path.chmod(0o755)
    assert compared(session, program, tmp_path / "s") == []
