"""What tests that record real nodes share."""

from collections.abc import Iterator

import pytest
from hostile import staging

from grader.execution.recording_session import RecordingSession, open_session


@pytest.fixture(scope="module")
def studio() -> Iterator[RecordingSession]:
    """The strongest sandbox of this machine, with warm workers."""
    with open_session("auto") as studio:
        yield staging(studio)
