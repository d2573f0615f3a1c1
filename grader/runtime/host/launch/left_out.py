"""What a launch file asks for and only ROS itself can do: it is left out, and named with its place."""

from __future__ import annotations

import errno
import os
import subprocess
from collections.abc import Sequence

from ..protocol import NotEvaluated
from .places import written_at

#: The longest name or text of something that is left out.
MOST_CHARACTERS = 200


class LeftOutError(BaseException):
    """Something that only ROS itself can do; the action that needs it is left out.

    Not an Exception: what a launch file does after one would not be what it does in ROS.

    Args:
        code: What it is; the grader has the words for each code.
        name: Which one.
        text: What it was given, as text.
    """

    def __init__(self, code: str, name: str = "", text: str = "") -> None:
        super().__init__(code)
        self.told = NotEvaluated(code, name[:MOST_CHARACTERS], text[:MOST_CHARACTERS])
        self.place = written_at()


def left_out_by(error: OSError, folders: Sequence[str]) -> LeftOutError | None:
    """Return what a launch file could not do in the sandbox and could do elsewhere; None if the mistake is its own."""
    step = error.__traceback__
    while step is not None and step.tb_next is not None:
        step = step.tb_next
    # Most commands are not in the sandbox, and no shell.
    if step is not None and step.tb_frame.f_code.co_filename == subprocess.__file__:
        command = step.tb_frame.f_locals.get("args") or ()
        words = [os.fsdecode(word) for word in command if isinstance(word, (str, bytes, os.PathLike))]
        return LeftOutError("command", text=" ".join(words[2:] if words[1:2] == ["-c"] else words))
    # The submission is there to be read.
    name = error.filename
    refused = error.errno in (errno.EROFS, errno.EACCES, errno.EPERM) and isinstance(name, str)
    inside = refused and any(os.path.abspath(name).startswith(folder) for folder in folders)
    return LeftOutError("written_file", os.path.basename(name)) if inside else None
