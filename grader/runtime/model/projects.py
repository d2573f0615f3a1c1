"""The ROS packages of a submission, as their project files describe them."""

from __future__ import annotations

from grader.runtime.model.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Project:
    """One ROS package. Whoever reads its files checks every name and path: none leads out of its folder.

    Attributes:
        folder: Its folder, relative to the submission; empty for the submission's own folder.
        name: Its name: what package.xml says, or else setup.py, or else the name of the folder.
        scripts: Name, module and function of each console script.
        data_files: The folders below the prefix, with the files that setup.py installs to them, relative to the
            package; None if that is not known.
        programs: Name and file of each Python program that is installed as it is, by CMake for instance; the file is
            relative to the package.
        unrunnable: The same for other Python files beside them: `ros2 run` finds one only if its source is executable
            and was linked, not copied.
        foreign: The names of programs that are not in Python.
        imported: Folders with installed Python packages, relative to the package, besides its own.
        unread: Whether it may have programs that its files do not tell.
        by_cmake: Whether it has a CMakeLists.txt.
    """

    folder: str
    name: str
    scripts: tuple[tuple[str, str, str], ...] = ()
    data_files: tuple[tuple[str, tuple[str, ...]], ...] | None = None
    programs: tuple[tuple[str, str], ...] = ()
    unrunnable: tuple[tuple[str, str], ...] = ()
    foreign: tuple[str, ...] = ()
    imported: tuple[str, ...] = ()
    unread: bool = False
    by_cmake: bool = False
