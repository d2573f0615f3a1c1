"""Shows on a terminal what is being done, while it is being done."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from grader.reporting.escape import shown

if TYPE_CHECKING:
    from grader.app.grade import Progress


@contextmanager
def shown_progress(*, wanted: bool) -> Iterator[Progress]:
    """Show on a terminal what is being done, and leave no trace of it there."""
    if not (wanted and sys.stderr is not None and sys.stderr.isatty()):
        yield _say_nothing
        return
    from rich.console import Console  # noqa: PLC0415  only for a terminal
    from rich.text import Text  # noqa: PLC0415

    with Console(stderr=True).status("starting") as status:
        yield lambda step: status.update(Text(shown(step)))


def _say_nothing(step: str) -> None:
    del step
