"""What tests that record real nodes or start sandboxes share."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from hostile import staging
from sandboxes import make_submission

from grader.runtime.session import RecordingSession, open_session


@pytest.fixture(scope="module")
def studio() -> Iterator[RecordingSession]:
    """The strongest sandbox of this machine, with warm workers."""
    with open_session("auto") as studio:
        yield staging(studio)


@pytest.fixture
def submission() -> Iterator[Path]:
    """A folder that students' processes may see."""
    folder = make_submission()
    yield folder
    shutil.rmtree(folder)
