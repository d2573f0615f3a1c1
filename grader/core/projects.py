"""The ROS packages of a submission, as their project files describe them."""

from __future__ import annotations

from grader.core.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Project:
    """One ROS package. Whoever reads its files checks every name and path: none leads out of its folder.

    Attributes:
        folder: Its folder, relative to the submission; empty for the submission's own folder.
        name: Its name: what package.xml says, or else setup.py, or else the name of the folder.
        scripts: Name, module and function of each console script.
        data_files: The folders below the prefix, with the files that setup.py installs to them, relative to the
            package; None if that is not known.
    """

    folder: str
    name: str
    scripts: tuple[tuple[str, str, str], ...] = ()
    data_files: tuple[tuple[str, tuple[str, ...]], ...] | None = None
