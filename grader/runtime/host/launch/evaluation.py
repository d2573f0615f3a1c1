"""Evaluates a launch file, and says what of it was left out."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from typing import Any

from ..protocol import LaunchReport
from .context import Context, begin_evaluation
from .entities import walk
from .files import description_in
from .left_out import LeftOutError, left_out_by
from .markup import description_of
from .modules import install
from .places import folders_with_places, place_files_in, place_in
from .shares import Shares


def describe(  # noqa: PLR0913  what to evaluate, with what, and how much of it
    folders: tuple[str, ...],
    path: str,
    packages: Mapping[str, str],
    arguments: Mapping[str, str],
    *,
    prefix: str = "",
    most_nodes: int,
    most_left_out: int,
) -> LaunchReport:
    """Evaluate a launch file; raises whatever it raises.

    Args:
        folders: The submission's folder, and that of the rubric's own files.
        path: The launch file, in one of them.
        packages: Name and folder of each ROS package of the submission.
        arguments: The launch arguments.
        prefix: The folder that share folders are laid out in; empty to lay out none.
        most_nodes: So many nodes are described; whatever follows the last one is left out.
        most_left_out: So many things are said to be left out.

    Returns:
        The nodes, what is done with them and when, and what was left out.
    """
    place_files_in(folders)
    shares = Shares(packages, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep), prefix)
    context = Context(packages, shares, arguments, most_nodes, most_left_out)
    context.read_markup = description_of
    begin_evaluation(context)
    install(context)
    setattr(os, "system", _without_shell(context))  # noqa: B010  a plain assignment would need its exact type
    # Once a package is built, a launch file imports the modules of its package.
    sys.path += [folder for folder in packages.values() if folder not in sys.path]
    context.files.append(path)
    try:
        walk(description_in(path, context).entities, context)
        while context.undescribed:
            context.undescribed.pop(0)(context)
    except LeftOutError as error:
        _leave_out_all(context, path, error)
    except OSError as error:
        left_out = left_out_by(error, folders_with_places())
        if left_out is None:
            raise
        left_out.place = place_in(error)
        _leave_out_all(context, path, left_out)
    return LaunchReport(context.nodes, context.left_out, steps=context.steps, handlers=context.handlers)


def _leave_out_all(context: Context, path: str, error: LeftOutError) -> None:
    """Note what ended the evaluation of a launch file."""
    error.told = error.told._replace(ends=True)
    file, line = error.place
    context.leave_out(file or os.path.basename(path), line, error)


def _without_shell(context: Context) -> Callable[[Any], int]:
    def system(command: Any) -> int:
        context.leave_out_here(LeftOutError("command", text=os.fsdecode(command)))
        return 0

    return system
