"""Says where in the submission, or in the rubric's own files, a launch file does something."""

from __future__ import annotations

import os
import sys
from types import FrameType

#: The folders whose files are named as places: that of the submission, and that of the rubric's own files.
_folders: tuple[str, ...] = ()


def place_files_in(folders: tuple[str, ...]) -> None:
    """Name places in the files of these folders: the submission's, and that of the rubric's own files."""
    global _folders  # noqa: PLW0603  every action needs them, also those that a launch file makes at import
    _folders = tuple(os.path.join(folder, "") for folder in folders)


def folders_with_places() -> tuple[str, ...]:
    """Return the folders, each with a slash at its end."""
    return _folders


def written_at() -> tuple[str, int]:
    """Return the file and line of a launch file that runs now; an empty name and 0 if none does."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        name = frame.f_code.co_filename
        for folder in _folders:
            if name.startswith(folder):
                return os.path.relpath(name, folder), frame.f_lineno
        frame = frame.f_back
    return "", 0


def place_in(error: BaseException) -> tuple[str, int]:
    """Return the last line of the submission that an exception went through."""
    place, step = ("", 0), error.__traceback__
    while step is not None:
        name = step.tb_frame.f_code.co_filename
        for folder in _folders:
            if name.startswith(folder):
                place = os.path.relpath(name, folder), step.tb_lineno
        step = step.tb_next
    return place
