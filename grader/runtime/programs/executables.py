"""Finds the programs that the packages of a submission install, by their names as `ros2 run` takes them."""

from __future__ import annotations

import contextlib
import glob
import os
import posixpath
import re
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path

from grader.runtime.host.packages import CMAKE, FOLDERS, SKIPPED, package_folders, walk_folders
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.projects import Project

#: A package with this file installs its programs with CMake.
CMAKE_LISTS = CMAKE
#: The most files of a package that are searched for a module or a program.
MOST_FILES = 2_000
#: How far above a package its workspace may begin: repositories have groups of packages in groups.
MOST_LEVELS = 8
#: With a file of this name in it, a folder is none of those that colcon builds.
IGNORED = "COLCON_IGNORE"
#: Files that name the packages that theirs needs.
_NAMING = frozenset({".py", ".xml", ".yaml", ".txt", ".cfg", ".msg", ".srv", ".action", ".idl"})
#: The most bytes of one of them and of a package.xml that are read: no real one is nearly as long.
MOST_NAMING_BYTES, MOST_MANIFEST_BYTES = 1 << 20, 64 << 10
_PACKAGE_NAME = re.compile(rb"<name>\s*([A-Za-z0-9_-]{1,100})\s*</name>")
_WORD = re.compile(rb"[A-Za-z][A-Za-z0-9_]{1,99}")


@dataclass(frozen=True, slots=True)
class Executable:
    """A program of a package."""

    package: str  # name of the ROS package
    name: str  # name of the executable
    file: str | None  # the file that it runs, relative to the submission; None if it is not there
    target: str = ""  # the entry point, as `MODULE:FUNCTION`; empty for a file that is installed as it is
    source: str = ""  # the file that is installed as it is, relative to its package; empty for an entry point

    @property
    def words(self) -> str:
        """Package and name, as in `ros2 run PACKAGE NAME`."""
        return f"{self.package}/{self.name}"

    @property
    def problem(self) -> str:
        """What is wrong with a program whose file is not there, as a sentence."""
        if self.source:
            return f"{self.source}, which is installed as {self.words}, is not in the submission"
        return f"the entry point {self.words} is {self.target}, which is not in the submission"


def project_folders(root: Path) -> list[Path]:
    """Return the folders of all ROS packages in a submission, outermost first."""
    return [Path(folder) for folder in package_folders(str(root))]


def files_below(folder: Path) -> Iterator[str]:
    """Yield the paths of all files below a folder, relative to it, without those in folders that a tool has made."""
    for here, _, files in walk_folders(str(folder)):
        for file in files:
            yield Path(here, file).relative_to(folder).as_posix()


def executables(root: Path, projects: Sequence[Project]) -> list[Executable]:
    """Return the programs of all packages of a submission, in the order of its folders.

    They are the entry points, and what CMake or setup.py installs as it is.
    """
    found, files = [], _Files(root)
    for project in projects:
        names = set()
        for name, module, function in project.scripts:
            path = files.find(project.folder, f"{module.replace('.', '/')}.py")
            file = None if path is None else path.relative_to(root).as_posix()
            found.append(Executable(project.name, name, file, f"{module}:{function}"))
            names.add(name)
        for name, source in project.programs:
            if name not in names:
                found.append(_installed(files, project, name, source))
    return found


def _installed(files: _Files, project: Project, name: str, source: str) -> Executable:
    path = posixpath.join(project.folder, source)
    return Executable(project.name, name, path if files.has(path) else None, source=source)


def find_executables(root: Path, projects: Sequence[Project], package: str, name: str) -> list[Executable]:
    """Return the programs that `PACKAGE/NAME` stands for, in the order of the folders; `*` stands for any package.

    Where the files of a package do not tell all its programs, a file of the name in it is taken. All are files of the
    submission, or are not there.
    """
    here = [project for project in projects if package in ("*", project.name)]
    found = [one for one in executables(root, here) if one.name == name]
    files = _Files(root)
    for project in here:
        if any(one.package == project.name for one in found):
            continue
        installed = dict(project.unrunnable)
        if name in installed:
            found.append(_installed(files, project, name, installed[name]))
            continue
        path = files.find(project.folder, name) if _may_have_others(root, project) else None
        if path is not None and path.suffix == ".py":
            found.append(Executable(project.name, name, path.relative_to(root).as_posix()))
    return found


def find_executable(root: Path, projects: Sequence[Project], package: str, name: str) -> Executable | None:
    """Return the program that `ros2 run PACKAGE NAME` would start; None if there is none."""
    return next(iter(find_executables(root, projects, package, name)), None)


def find_loose(root: Path, name: str) -> Executable | None:
    """Return a file NAME or NAME.py anywhere in a submission, for a package that it does not have."""
    files = _Files(root)
    found = next((path for one in (name, f"{name}.py") if (path := files.find("", one)) is not None), None)
    known = found is not None and found.suffix == ".py"
    return Executable("", name, found.relative_to(root).as_posix()) if known and found is not None else None


def _may_have_others(root: Path, project: Project) -> bool:
    """Return whether a package may have programs that its files do not tell."""
    folder = root / project.folder
    return project.unread or not any((folder / name).is_file() for name in ("setup.py", "setup.cfg", CMAKE))


def why_unknown(root: Path, projects: Sequence[Project], package: str, name: str) -> str:
    """Return why a program that was not found may be there all the same; empty if it cannot be."""
    for project in projects:
        if project.name == package and name in project.foreign:
            return "it is not a Python program"
        if project.name == package and project.unread and (root / project.folder / CMAKE).is_file():
            return "CMakeLists.txt may install it in a way that is not read here"
    return ""


def has_package(projects: Sequence[Project], name: str) -> bool:
    """Return whether a submission has a ROS package."""
    return any(project.name == name for project in projects)


class _Files:
    """The files of a submission; each folder is listed once, however many names are looked for in it.

    Args:
        root: The submission.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self._listed: dict[str, dict[str, list[Path]]] = {}

    def find(self, within: str, tail: str) -> Path | None:
        """Return the file nearest the top of a folder whose path ends like this.

        A tail that could lead out of the folder is refused before the file system is asked, and so is a file that a
        link leads to.
        """
        parts = tail.split("/")
        if "\0" in tail or not {"", ".", ".."}.isdisjoint(parts):
            return None
        if within not in self._listed:
            self._listed[within] = self._list(self._root / within)
        near = len((self._root / within).parts)
        for path in self._listed[within].get(parts[-1], ()):
            ends_so = path.parts[-len(parts) :] == tuple(parts) and len(path.parts) - len(parts) >= near
            if ends_so and self._is_inside(path):
                return path
        return None

    def has(self, path: str) -> bool:
        """Return whether a relative path is that of a plain file that no link leads to."""
        return "\0" not in path and self._is_inside(self._root / path)

    def _list(self, folder: Path) -> dict[str, list[Path]]:
        """Return the files below a folder by name, the ones nearest the top first."""
        found: dict[str, list[Path]] = {}
        seen = 0
        for above, _, names in walk_folders(str(folder)):
            seen += len(names)
            for name in names:
                found.setdefault(name, []).append(Path(above, name))
            if seen > MOST_FILES:
                break
        return found

    def _is_inside(self, path: Path) -> bool:
        return path.is_file() and path.resolve() == self._root.resolve() / path.relative_to(self._root)


def package_of(folder: Path) -> Path:
    """Return the package that a folder is in; the folder itself if it is in none."""
    return next((up for up in (folder, *folder.parents) if (up / "package.xml").is_file()), folder)


def workspace_of(package: Path) -> Path:
    """Return the folder with the packages that one may need; the package itself if there are no others.

    That is the `src` above it. Without one, it is the nearest of the folder that it is in, the one above that, and its
    repository that has all packages that it names and that lie in any of them.
    """
    if not is_package(package):
        return package
    above = [up for up in package.parents[:MOST_LEVELS] if up != up.parent]
    source = next((up for up in above if up.name == "src"), None)
    if source is not None:
        return source if any(folder != package for folder in project_folders(source)) else package
    beside = {up: {package_name(one) for one in packages_near(up) if one != package} for up in above[:2]}
    cloned = next((up for up in above if _is_cloned(up)), None)
    if cloned is not None and cloned not in beside:
        beside[cloned] = {package_name(folder) for folder in project_folders(cloned) if folder != package}
    named = words_of(package) & {name for names in beside.values() for name in names}
    nearest = next((up for up, names in beside.items() if named <= names), package)
    return nearest if beside.get(nearest) else package


def packages_near(folder: Path) -> list[Path]:
    """Return the folders of the packages in a folder and in the folders in it."""
    # Not `Path.glob`, which raises if a folder vanishes meanwhile, as do those that other runs of pytest tidy up.
    found = (path for level in ("*", "*/*") for path in glob.iglob(f"{level}/package.xml", root_dir=folder))  # noqa: PTH207
    return [(folder / path).parent for path in found]


def _is_cloned(folder: Path) -> bool:
    return (folder / ".git").exists()


def is_package(folder: Path) -> bool:
    """Return whether a folder is that of a ROS package."""
    return (folder / "package.xml").is_file()


def package_name(package: Path) -> str:
    """Return the name of a package: that in its package.xml, or else that of its folder."""
    found, path = None, package / "package.xml"
    with contextlib.suppress(OSError):
        if path.is_file():  # a pipe would never end
            with path.open("rb") as manifest:
                found = _PACKAGE_NAME.search(manifest.read(MOST_MANIFEST_BYTES))
    return found[1].decode() if found is not None else package.name


def words_of(package: Path) -> frozenset[str]:
    """Return the words of a package's programs, definitions and build files, among which are the packages it needs."""
    found: set[str] = set()
    for file in islice(files_below(package), MOST_FILES):
        path = package / file
        if path.suffix in _NAMING and path.is_file() and path.stat().st_size <= MOST_NAMING_BYTES:
            found |= {word.decode() for word in _WORD.findall(path.read_bytes())}
    return frozenset(found)


def needed_packages(package: Path, workspace: Path) -> list[Path]:
    """Return a package and those of its workspace that it names, with those that they name."""
    known: dict[str, Path] = {}
    for folder in project_folders(workspace):
        known.setdefault(package_name(folder), folder)
    needed, new = {package: None}, [package]
    while new:
        named = words_of(new.pop())
        found = [folder for name, folder in known.items() if name in named and folder not in needed]
        needed.update(dict.fromkeys(found))
        new += found
    return sorted(needed)


def ignored_packages(workspace: Path) -> dict[str, Path]:
    """Return the packages of a workspace that colcon does not build, by name, and the folder with COLCON_IGNORE."""
    found: dict[str, Path] = {}
    for number, (here, folders, files) in enumerate(os.walk(workspace)):
        if number >= FOLDERS:
            break
        folders[:] = sorted(name for name in folders if name not in SKIPPED and not name.startswith("."))
        if IGNORED in files and Path(here) != workspace:
            folders.clear()
            for inner in project_folders(Path(here)):
                found.setdefault(package_name(inner), Path(here))
    return found
