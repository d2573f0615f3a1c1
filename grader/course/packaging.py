"""Packs the grader for platforms that run it themselves: its wheel, pinned versions, and the platform's scripts."""

from __future__ import annotations

import base64
import hashlib
import importlib.metadata
import io
import json
import re
import sys
import tomllib
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import grader
from grader.grading.app.seeds import read_key
from grader.grading.rubrics.builtin import builtin_rubrics, exercise_ids
from grader.grading.rubrics.draws import First
from grader.grading.rubrics.loader import read_rubric, side_files
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EnvironmentFault, GraderError, RubricError
from grader.runtime.shipped import shipped

PACKAGE = "rclpy-grader"
#: The earliest time that a zip can store; a fixed time makes archives reproducible.
_LONG_AGO = (1980, 1, 1, 0, 0, 0)
_PROGRAM, _FILE, _PRIVATE = 0o100755, 0o100644, 0o100600
#: Packages that every environment brings for its own Python.
_WITH_PYTHON = ("pip", "setuptools", "wheel")
#: Folder of an installed package with what a checkout has outside of the package.
_SHIPPED = "shipped"


def integration(name: str) -> bytes:
    """Read one of the files that platforms run, such as `gradescope/setup.sh`."""
    return (shipped("integrations") / name).read_bytes()


def wheel() -> tuple[str, bytes]:
    """Build a wheel of the running package, and return its name and content.

    Raises EnvironmentFault if the package is not installed, or its requirements changed since it was installed.
    """
    try:
        installed = importlib.metadata.distribution(PACKAGE)
    except importlib.metadata.PackageNotFoundError:
        text = f"{PACKAGE}: expected an installed package, found only its code"
        raise EnvironmentFault(text, "python3 -m pip install . in the checkout of the grader") from None
    _refuse_stale(installed)
    stem = f"{PACKAGE.replace('-', '_')}-{installed.version}"
    files = _code()
    for name in ("METADATA", "entry_points.txt"):
        files[f"{stem}.dist-info/{name}"] = (installed.read_text(name) or "").encode()
    files[f"{stem}.dist-info/WHEEL"] = (
        b"Wheel-Version: 1.0\nGenerator: grade\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    )
    record = f"{stem}.dist-info/RECORD"
    files[record] = "".join([*map(_recorded, files, files.values()), f"{record},,\n"]).encode()
    return f"{stem}-py3-none-any.whl", zipped(files)


def pins() -> str:
    """Return the installed versions of all dependencies, as constraints for pip.

    They apply to this Python version and later ones, since older ones may not support these versions.
    """
    found: dict[str, str] = {}
    done: set[tuple[str, tuple[str, ...]]] = set()
    waiting: list[tuple[str, tuple[str, ...]]] = [(PACKAGE, ())]
    while waiting:
        name, extras = waiting.pop()
        try:
            distribution = importlib.metadata.distribution(name)
        except importlib.metadata.PackageNotFoundError:
            continue  # required on other systems only
        if (name, extras) not in done:
            done.add((name, extras))
            found[_normal(name)] = distribution.version
            waiting += _needed(distribution.requires or [], extras)
    for name in (PACKAGE, *_WITH_PYTHON):
        found.pop(name, None)
    since = f'python_version >= "{sys.version_info.major}.{sys.version_info.minor}"'
    return "".join(f"{name}=={version} ; {since}\n" for name, version in sorted(found.items()))


def zipped(files: Mapping[str, bytes], programs: tuple[str, ...] = (), private: tuple[str, ...] = ()) -> bytes:
    """Zip files in the given order; `programs` are executable, and only the owner can read `private` ones."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            info = zipfile.ZipInfo(name, _LONG_AGO)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = (_PROGRAM if name in programs else _PRIVATE if name in private else _FILE) << 16
            archive.writestr(info, content)
    return stream.getvalue()


def _refuse_stale(installed: importlib.metadata.Distribution) -> None:
    """Refuse a checkout whose requirements have grown since it was installed."""
    project = Path(grader.__file__).resolve().parent.parent / "pyproject.toml"
    if not project.is_file():
        return

    wanted = tomllib.loads(project.read_text(encoding="utf-8"))["project"]["dependencies"]
    have = {_normal(name) for name, _ in _needed(installed.requires or [], ())}
    new = sorted({_normal(name) for name, _ in _needed(wanted, ())} - have)
    if new:
        text = f"{PACKAGE}: expected an installation that knows its requirements, found none of {', '.join(new)}"
        raise EnvironmentFault(text, "python3 -m pip install -e . in the checkout of the grader")


def _code() -> dict[str, bytes]:
    package = Path(grader.__file__).resolve().parent
    files = {f"grader/{name}": content for name, content in _below(package).items()}
    for folder in ("rubrics", "integrations"):
        for name, content in _below(shipped(folder)).items():
            files[f"grader/{_SHIPPED}/{folder}/{name}"] = content
    return files


def _below(folder: Path) -> dict[str, bytes]:
    paths = {path.relative_to(folder): path for path in sorted(folder.rglob("*")) if path.is_file()}
    return {
        name.as_posix(): path.read_bytes()
        for name, path in paths.items()
        if name.parts[0] != _SHIPPED and "__pycache__" not in name.parts
    }


def _recorded(name: str, content: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(content)}\n"


def _needed(requirements: Iterable[str], extras: tuple[str, ...]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield name and extras of each requirement that applies with the given extras."""
    for requirement in requirements:
        of_extra = re.search(r"extra *== *['\"]([^'\"]+)", requirement)
        if of_extra is None or of_extra[1] in extras:
            match = re.match(r"([A-Za-z0-9._-]+) *(?:\[([^]]*)\])?", requirement)
            assert match is not None, requirement
            yield match[1], tuple(extra.strip() for extra in (match[2] or "").split(",") if extra)


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


#: Executable files.
_PROGRAMS = ("prepare", "setup.sh", "run_autograder", "autograder.py")
#: File with the seed key, as `run_autograder` expects it.
SEED_KEY = "seed.key"
#: Largest autograder that Classroom 50 fetches.
CLASSROOM50_BYTES = 10 * 1024 * 1024
# What the workflow says above the line that is filled in.
_TO_FILL_IN = re.compile("# Whoever sets up the course fills this in: .*")
_OWNER, _COMMIT = "__OWNER__/rclpy-grader", "__COMMIT__"
_ACTION = re.compile(r"([A-Za-z0-9._-]+/[A-Za-z0-9._-]+)@([0-9a-f]{40})")


@dataclass(frozen=True, slots=True)
class Chosen:
    """What a platform grades, and how."""

    exercises: tuple[str, ...] = ()  # exercise ids; empty for all exercises of the rubrics
    rubrics: tuple[Path, ...] = ()  # rubric files; empty for the built-in ones
    isolation: str = "auto"  # as on the command line


def gradescope(chosen: Chosen, seed_key: Path | None = None) -> bytes:
    """Build the autograder zip for Gradescope; raises GraderError if it would not work there.

    Without a file with the seed key, the public practice key is used.
    """
    files = {name: integration(f"gradescope/{name}") for name in ("setup.sh", "run_autograder")}
    if seed_key is not None:
        files[SEED_KEY] = read_key(seed_key, "seed key") + b"\n"
    return zipped({**files, **_common(chosen)}, programs=_PROGRAMS, private=(SEED_KEY,))


def classroom50(chosen: Chosen) -> dict[str, bytes]:
    """Build the files of an assignment's autograder, by name; raises GraderError if it would not work there."""
    files = {"autograder.py": integration("classroom50/autograder.py"), **_common(chosen)}
    size = sum(map(len, files.values()))
    if size > CLASSROOM50_BYTES:
        text = f"classroom50: expected at most {CLASSROOM50_BYTES} bytes, found {size}"
        raise GraderError(text, "leave out rubrics that this assignment does not need")
    return files


def workflow(action: str) -> str:
    """Render the workflow for students' repositories, which uses the action at a fixed commit.

    The action is `OWNER/NAME@COMMIT`, with all 40 digits of the commit; raises GraderError for another form.
    """
    match = _ACTION.fullmatch(action)
    if match is None:
        text = f"{action}: expected OWNER/NAME@COMMIT with a commit of 40 digits, found something else"
        raise GraderError(text, "git rev-parse HEAD in the repository of the grader says the commit")
    text = integration("github/workflow.yml").decode()
    made = _TO_FILL_IN.sub(lambda _: f"# Made by: grade export workflow {action}", text)
    return made.replace(_OWNER, match[1]).replace(_COMMIT, match[2])


def _common(chosen: Chosen) -> dict[str, bytes]:
    _check(chosen)
    name, content = wheel()
    # Numbered, because rubrics in different folders may share a name, and file names may be arbitrary.
    folders = {f"rubrics/{n}": path for n, path in enumerate(chosen.rubrics, start=1)}
    rubrics = {f"{folder}/rubric.yaml": path.read_bytes() for folder, path in folders.items()}
    brought = {f"{folder}/{f.name}": f.content for folder, path in folders.items() for f in side_files(path)}
    settings = {"exercises": chosen.exercises, "rubrics": list(rubrics), "isolation": chosen.isolation}
    return {
        "prepare": integration("prepare"),
        "settings.json": (json.dumps(settings, indent=2) + "\n").encode(),
        "constraints.txt": pins().encode(),
        name: content,
        **rubrics,
        **brought,
    }


def _check(chosen: Chosen) -> None:
    """Check the rubrics now, so that the first student does not run into a mistake."""
    paths = chosen.rubrics or tuple(builtin_rubrics().values())
    exercises = [read_rubric(path, draw=First()) for path in paths]
    for path, found in zip(paths, exercises, strict=True):
        if found.variant is not None:
            text = f"{path}: expected a rubric that is the same for everybody, found one with variants"
            raise RubricError(text, "grade it with grade batch: no platform keeps the variant key from students")
        if any(scenario.test is not None for scenario in found.scenarios):
            text = (
                f"{path}: expected a rubric without tests for pytest, which bundles do not bring, found one with some"
            )
            raise RubricError(text, "grade it with grade batch, where pytest is installed")
    exercise_ids(chosen.exercises, exercises)
