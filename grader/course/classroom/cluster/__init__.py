"""Grades a class on the workers of a Dask cluster: the scheduler `dask`, found like those of other packages."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from grader.runtime.model.extras import require

if TYPE_CHECKING:
    from grader.course.classroom.local import ClassScheduler


def connect(place: str, jobs: int | None, warn: Callable[[str], None]) -> AbstractContextManager[ClassScheduler]:
    """Return a context that is connected to the cluster at an address or of a scheduler file; see `Connect`."""
    require("--scheduler", "distributed", "dask")
    from grader.course.classroom.cluster.dispatcher import (  # noqa: PLC0415  distributed is optional, and takes long
        connected,
    )

    return connected(place, jobs, warn)
