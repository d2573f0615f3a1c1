"""What tests that record real nodes share."""

import pytest
from hostile import staging

from grader.execution.recording_session import open_session


@pytest.fixture(scope="module")
def studio():
    """The strongest sandbox of this machine, with warm workers."""
    with open_session("auto") as studio:
        yield staging(studio)
