"""Fixtures that tests of several folders use: sessions for recordings, and folders.

Every run of pytest loads this module, so a fixture imports what it needs.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from tiers import more

if TYPE_CHECKING:
    from side_by_side import Tables

    from grader.runtime.model.trace import Trace
    from grader.runtime.session import RecordingSession


@pytest.fixture(scope="session")
def session() -> Iterator[RecordingSession]:
    """The strongest sandbox of this machine, with warm workers, for all tests of this process."""
    from hostile import staging

    from grader.runtime.session import open_session

    with open_session("auto") as session:
        yield staging(session)


@pytest.fixture(scope="session")
def one_worker() -> Iterator[RecordingSession]:
    """The strongest sandbox of this machine, with one worker, for all tests of this process."""
    from hostile import staging

    from grader.runtime.session import open_session

    with open_session("auto", 1) as session:
        yield staging(session)


@pytest.fixture(scope="session", params=["auto", *more(["bubblewrap-flat", "landlock"])])
def session_in_tier(request: pytest.FixtureRequest) -> Iterator[RecordingSession]:
    """A sandbox with one worker: with a view of files of its own for each process, and without."""
    from hostile import staging

    from grader.runtime.model.errors import EnvironmentFault
    from grader.runtime.session import open_session

    try:
        with open_session(request.param, 1) as session:
            yield staging(session)
    except EnvironmentFault as fault:
        pytest.skip(fault.message)


@pytest.fixture(scope="session")
def tables(tmp_path_factory: pytest.TempPathFactory) -> Tables:
    """The recordings of tables of programs that this process has made."""
    from side_by_side import Tables

    def new_folder() -> Path:
        folder = tmp_path_factory.mktemp("row")
        folder.chmod(0o755)
        return folder / "s"

    return Tables(new_folder)


@pytest.fixture
def trace(request: pytest.FixtureRequest, tables: Tables) -> Trace:
    """The trace of this row of a table that `rows_of` marks."""
    return tables.trace(request)


@pytest.fixture
def submission() -> Iterator[Path]:
    """A folder that students' processes may see."""
    from sandboxes import make_submission

    folder = make_submission()
    yield folder
    shutil.rmtree(folder)


@pytest.fixture
def open_folder() -> Iterator[Path]:
    """An empty folder; unlike pytest's own, every user can enter what is above it."""
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        yield Path(name)


@pytest.fixture
def into(tmp_path: Path) -> Path:
    """An empty folder for what a test unpacks or copies."""
    folder = tmp_path / "into"
    folder.mkdir()
    return folder
