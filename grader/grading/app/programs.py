"""Finds the programs that `grade observe` is to run, and stages what they may import."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import takewhile
from pathlib import Path

from grader.grading.submissions.collected import Collected
from grader.grading.submissions.projects import read_projects
from grader.grading.submissions.submission import collect_submission, every_file, stage_collected, stage_submission
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import SubmissionError
from grader.runtime.model.limits import MAX_FILES, MAX_TOTAL_BYTES
from grader.runtime.model.projects import Project
from grader.runtime.model.scenario import is_launch_file
from grader.runtime.model.submission import Submission
from grader.runtime.model.wording import first_of, listed
from grader.runtime.programs.executables import (
    IGNORED,
    executables,
    find_executables,
    ignored_packages,
    is_package,
    needed_packages,
    package_name,
    package_of,
    project_folders,
    words_of,
    workspace_of,
)

#: What can be named.
_WHAT = "name .py files, launch files, packages, workspaces, FOLDER/EXECUTABLE or FOLDER/PACKAGE/EXECUTABLE"
#: The most executables that a message lists.
_SHOWN = 12
#: The most programs that are observed together: each is a process with a sandbox, 70 MB and a DDS participant.
MOST_PROGRAMS = 40


@dataclass(frozen=True, slots=True)
class Target:
    """One process to run: a file, or an executable of a package."""

    name: str  # file name, or `PACKAGE/EXECUTABLE`
    folder: Path  # the folder of the file, or that of the packages
    file: Path | None = None


@dataclass(frozen=True, slots=True)
class Targets:
    """What to run.

    Attributes:
        targets: The processes, in the given order, with different names.
        notes: Sentences about what is not run.
    """

    targets: tuple[Target, ...]
    notes: tuple[str, ...] = ()


def find_targets(paths: tuple[Path, ...]) -> Targets:
    """Return what to run; raises SubmissionError for programs that are named twice, and for anything else."""
    found = [_of_path(path) for path in paths]
    targets = [target for one in found for target in one.targets]
    whole = [str(target.file.resolve()) if target.file is not None else target.name for target in targets]
    for name in whole:
        if whole.count(name) > 1:
            raise SubmissionError(f"{name}: expected each program once, found it twice", "name it once")
    if len(targets) > MOST_PROGRAMS:
        text = f"expected at most {MOST_PROGRAMS} programs, found {len(targets)}"
        raise SubmissionError(text, "name the packages or files to observe together")
    return Targets(_with_folders(targets), tuple(note for one in found for note in one.notes))


def _with_folders(targets: list[Target]) -> tuple[Target, ...]:
    """Return targets with different names: files of one name get as many of their folders as tell them apart."""
    names = [target.name for target in targets]
    renamed = []
    for target in targets:
        if target.file is None or names.count(target.name) == 1:
            renamed.append(target)
            continue
        parts = target.file.resolve().parts
        others = [other.file.resolve().parts for other in targets if other.name == target.name and other.file]
        size = next(n for n in range(1, len(parts) + 1) if sum(other[-n:] == parts[-n:] for other in others) == 1)
        renamed.append(replace(target, name="/".join(parts[-size:])))
    return tuple(renamed)


def _of_path(path: Path) -> Targets:
    if path.is_file() and (path.suffix == ".py" or is_launch_file(path.name)):
        return Targets((Target(path.name, path.resolve().parent, path),))
    if path.is_dir():
        return _of_folder(path)
    if not path.exists():
        # FOLDER/NAME, or FOLDER/PACKAGE/NAME
        for folder, package in ((path.parent, "*"), (path.parent.parent, path.parent.name)):
            found = _of_name(path, folder, package) if folder.is_dir() and path.parent.name else None
            if found is not None:
                return found
    raise SubmissionError(f"{path}: expected a .py file, found none", _WHAT)


def _of_folder(path: Path) -> Targets:
    """Return all executables of a package or workspace."""
    root = path.resolve()
    projects, problems = read_projects(root)
    known = executables(root, projects)
    foreign = [f"{project.name}/{name}" for project in projects for name in project.foreign]
    notes = [one.problem for one in known if one.file is None]
    notes += [f"not run, because it is not a Python program: {first_of(foreign)}"] if foreign else []
    found = tuple(Target(one.words, root) for one in known if one.file is not None)
    if not found:
        text = f"{path}: expected a package or workspace with executables, found none"
        ignored = [
            f"{name} is left out, as colcon does: there is a file {folder.relative_to(root) / IGNORED}"
            for name, folder in ignored_packages(root).items()
        ]
        ignored += [f"colcon leaves this folder out: there is a file {IGNORED}"] if (root / IGNORED).is_file() else []
        raise SubmissionError(text, "; ".join([*ignored, *notes, *([] if ignored else [_how_to_have_some(projects)])]))
    return Targets(found, (*notes, *problems))


def _how_to_have_some(projects: Sequence[Project]) -> str:
    """Return what to do about packages without executables, by how they are built."""
    by_cmake = [project for project in projects if project.by_cmake]
    files = [file for project in projects for _, file in project.unrunnable]
    if files:
        return f"install {first_of(files)} with PROGRAMS, so that it can be run"
    ways = ["add console_scripts to setup.py"] if len(by_cmake) < len(projects) else []
    ways += ["add install(PROGRAMS ... DESTINATION lib/${PROJECT_NAME}) to CMakeLists.txt"] if by_cmake else []
    return ", or ".join(["name the files of the nodes to run", *ways])


def _of_name(path: Path, folder: Path, package: str) -> Targets | None:
    """Return the executable of a name; None if the folder has no such package."""
    root = folder.resolve()
    projects, _ = read_projects(root)
    known = [one for one in executables(root, projects) if package in ("*", one.package)]
    named = find_executables(root, projects, package, path.name)
    found = [one for one in named if one.file is not None]
    if len(found) == 1 or (found and path.parent.name == "*"):
        others = [one.words for one in found[1:]]
        notes = (f"run is {found[0].words}, the first of its name; not run: {first_of(others)}",) if others else ()
        return Targets((Target(found[0].words, root),), notes)
    if named and not found:
        raise SubmissionError(f"{path}: {named[0].problem}", "write the file, or correct the name")
    if not known:
        return None
    several = f"several: {listed([one.words for one in found])}" if found else "none"
    names = listed([one.words for one in known[:_SHOWN]])
    hint = "name it as FOLDER/PACKAGE/EXECUTABLE" if found else _WHAT
    raise SubmissionError(f"{path}: expected an executable ({names}), found {several}", hint)


def stage(targets: Sequence[Target], into: Path) -> Submission:
    """Stage what the programs may import: their workspace or package, or else their common folder; one may be alone.

    Of a workspace that is too large, only the packages are taken that the programs need. The notes say what is missing.
    """
    names, files = [target.name for target in targets], [target.file for target in targets]
    folder = Path(os.path.commonpath([target.folder for target in targets]))
    package = package_of(folder)
    workspace = workspace_of(package)
    notes: tuple[str, ...] = tuple(_ignored(targets, package, workspace))
    if (modules := _outermost(folder)) is not None and (whole := _stage_modules(targets, modules, into)) is not None:
        return replace(whole, notes=(*notes, *whole.notes))
    for place, root in enumerate(dict.fromkeys((workspace, package, folder))):
        staged = into / f"submission_{place}"
        staged.mkdir()
        meant = {
            name: file.resolve().relative_to(root).as_posix() for name, file in zip(names, files, strict=True) if file
        }
        try:
            submission = stage_submission(str(root), names, staged, meant)
        except SubmissionError as error:
            if root == workspace and workspace != package:
                needed = into / "needed"
                needed.mkdir()
                if (part := _stage_needed(targets, package, workspace, needed)) is not None:
                    return replace(part, notes=(*notes, *part.notes))
                notes = (*notes, f"without the packages beside it: {error.message}")
            if root == folder and (len(files) > 1 or files[0] is None):
                if len({target.folder for target in targets}) > 1:
                    break
                raise
            continue
        if all(submission.files[name].found == path for name, path in meant.items()):  # a copy leaves some folders out
            return replace(submission, notes=notes)
    alone = into / "alone"
    alone.mkdir()
    if len(targets) == 1:
        return replace(stage_submission(str(files[0]), names, alone), notes=notes)
    return replace(_stage_apart(targets, alone), notes=notes)


def _outermost(folder: Path) -> Path | None:
    """Return the outermost Python package that a folder is in; None if it is in none, or in a ROS package."""
    if is_package(package_of(folder)):
        return None
    within = takewhile(lambda up: (up / "__init__.py").is_file(), (folder, *folder.parents))
    return next(iter([*within][::-1]), None)


def _stage_modules(targets: Sequence[Target], package: Path, into: Path) -> Submission | None:
    """Stage a Python package as a folder of its name, from which its modules import each other; None if it cannot be.

    Args:
        targets: Programs in it.
        package: The outermost one.
        into: The folder to stage in.
    """
    staged = into / "modules"
    staged.mkdir()
    try:
        files = [(f"{package.name}/{name}", text) for name, text in every_file(str(package), staged).files]
        return _stage_files(targets, files, package.parent, staged)
    except SubmissionError:
        return None


def _stage_files(
    targets: Sequence[Target], files: Sequence[tuple[str, bytes]], root: Path, into: Path
) -> Submission | None:
    """Stage files of a folder, among them those of the programs; None if they are too large, or one is left out."""
    meant = {
        target.name: target.file.resolve().relative_to(root).as_posix() for target in targets if target.file is not None
    }
    if len(files) > MAX_FILES or sum(len(text) for _, text in files) > MAX_TOTAL_BYTES:
        return None
    names = [target.name for target in targets]
    submission = stage_collected(Collected(tuple(files)), str(root), names, into, meant)
    return submission if all(submission.files[name].found == path for name, path in meant.items()) else None


def _ignored(targets: Sequence[Target], package: Path, workspace: Path) -> Iterator[str]:
    """Yield a sentence for each package that those of the programs name, and that colcon would not build."""
    if is_package(package):
        packages = [package]
        if workspace == package:  # all others may be ignored
            workspace = next((up for up in package.parents if up.name == "src"), package.parent)
    else:
        wanted = {target.name.split("/")[0] for target in targets if target.file is None}
        packages = [folder for folder in project_folders(workspace) if package_name(folder) in wanted] if wanted else []
    ignored = ignored_packages(workspace) if packages else {}
    named = {word for one in packages for word in words_of(one)} if ignored else set()
    around = {folder for one in packages for folder in (one, *one.parents)}
    for name, folder in ignored.items():
        if name in named and folder not in around:
            where = (folder / IGNORED).relative_to(workspace).as_posix()
            yield f"the package {name} was left out, as colcon does: there is a file {where}"


def _stage_needed(targets: Sequence[Target], package: Path, workspace: Path, into: Path) -> Submission | None:
    """Stage a package and those that it needs of a workspace; None if they are too large as well."""
    files: list[tuple[str, bytes]] = []
    packages = needed_packages(package, workspace)
    try:
        for folder in packages:
            inside = folder.relative_to(workspace).as_posix()
            # Packages in one another are read with the outer one.
            if not any(other in folder.parents for other in packages):
                files += [(f"{inside}/{name}", text) for name, text in every_file(str(folder), into).files]
        submission = _stage_files(targets, files, workspace, into)
    except SubmissionError:
        return None
    if submission is None:
        return None
    taken = ", ".join(package_name(folder) for folder in packages)
    return replace(submission, notes=(f"the workspace is too large to be copied: taken are the packages {taken}",))


def _stage_apart(targets: Sequence[Target], into: Path) -> Submission:
    """Stage programs whose common folder holds too much: beside each other, each with its own workspace or folder."""
    roots = {target.name: workspace_of(package_of(target.folder)) for target in targets}
    places = {root: f"{place}_{root.name}" for place, root in enumerate(dict.fromkeys(roots.values()), 1)}
    names = [target.name for target in targets]
    collected = {root: collect_submission(str(root), names, into) for root in places}
    files = tuple((f"{places[root]}/{name}", text) for root, one in collected.items() for name, text in one.files)
    meant = {
        target.name: f"{places[roots[target.name]]}/{target.file.resolve().relative_to(roots[target.name]).as_posix()}"
        for target in targets
        if target.file is not None
    }
    submission = stage_collected(Collected(files), str(targets[0].folder), names, into, meant)
    for name, path in meant.items():
        if submission.files[name].found != path:
            raise SubmissionError(
                f"{name}: expected a file of the submission, found one in a folder that a tool created"
            )
    return submission
