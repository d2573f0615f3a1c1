"""Counts the work that judging does: the same on a fast machine, a slow one and a busy one."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import FrameType
from typing import ParamSpec

Given = ParamSpec("Given")


def calls_in(function: Callable[Given, object], *args: Given.args, **kwargs: Given.kwargs) -> int:
    """Call a function and return how many calls it made, of Python and of C, with those of all that it called."""
    count = 0

    def profile(_frame: FrameType, event: str, _argument: object) -> None:
        nonlocal count
        count += event in {"call", "c_call"}

    before = sys.getprofile()
    sys.setprofile(profile)
    try:
        function(*args, **kwargs)
    finally:
        sys.setprofile(before)
    return count
