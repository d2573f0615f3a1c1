"""Bundles for platforms: everything that one needs to grade, by file name."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from grader.exporting.parts import integration, pins, wheel, zipped
from grader.model.errors import GraderError, RubricError
from grader.reading.builtin_rubrics import builtin_rubrics, require_exercises
from grader.reading.keys import read_key
from grader.reading.rubric_file import own_check_files, read_rubric
from grader.reading.variants import First

#: Files that are run; the others are read.
_PROGRAMS = ("prepare", "setup.sh", "run_autograder", "autograder.py")
#: The key that drawn values follow from, where `run_autograder` looks for it.
SEED_KEY = "seed.key"
#: Classroom 50 fetches no more than this.
CLASSROOM50_BYTES = 10 * 1024 * 1024
_OWNER, _COMMIT = "__OWNER__/rclpy-grader", "__COMMIT__"
_HEX_DIGITS = 40
_NAME_SIGNS = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.")


@dataclass(frozen=True, slots=True)
class Chosen:
    """What a platform is to grade, and how.

    Attributes:
        exercises: Exercise ids; empty for all of the rubrics.
        rubrics: Rubric files; empty for the built-in ones.
        isolation: As on the command line.
    """

    exercises: tuple[str, ...] = ()
    rubrics: tuple[Path, ...] = ()
    isolation: str = "auto"


def gradescope(chosen: Chosen, seed_key: Path | None = None) -> bytes:
    """Return the autograder zip for Gradescope; raises GraderError if it would not work there.

    Args:
        chosen: What it grades.
        seed_key: File with the key that drawn values follow from; None for the public practice key.
    """
    files = {name: integration(f"gradescope/{name}") for name in ("setup.sh", "run_autograder")}
    if seed_key is not None:
        files[SEED_KEY] = read_key(seed_key, "seed key") + b"\n"
    return zipped({**files, **_common(chosen)}, programs=_PROGRAMS, private=(SEED_KEY,))


def classroom50(chosen: Chosen) -> dict[str, bytes]:
    """Return the files of an assignment's autograder for Classroom 50, by name.

    Raises:
        GraderError: They would not work there.
    """
    files = {"autograder.py": integration("classroom50/autograder.py"), **_common(chosen)}
    size = sum(map(len, files.values()))
    if size > CLASSROOM50_BYTES:
        text = f"classroom50: expected at most {CLASSROOM50_BYTES} bytes, found {size}"
        raise GraderError(text, "leave out rubrics that this assignment does not need")
    return files


def workflow(action: str) -> str:
    """Return the workflow of a student's repository, which grades with an action at one commit.

    Args:
        action: `OWNER/NAME@COMMIT`, the commit with all of its 40 digits: what it names never changes.

    Raises:
        GraderError: It is of another form.
    """
    repository, _, commit = action.partition("@")
    parts = repository.split("/")
    whole = len(commit) == _HEX_DIGITS and set(commit) <= set("0123456789abcdef")
    if len(parts) != 2 or not all(part and set(part) <= _NAME_SIGNS for part in parts) or not whole:
        text = f"{action}: expected OWNER/NAME@COMMIT with a commit of {_HEX_DIGITS} digits, found something else"
        raise GraderError(text, "git rev-parse HEAD in the repository of the grader says the commit")
    text = integration("github/workflow.yml").decode()
    return text.replace(_OWNER, repository).replace(_COMMIT, commit)


def _common(chosen: Chosen) -> dict[str, bytes]:
    _check(chosen)
    name, content = wheel()
    # Numbered: two rubrics may have one name in two folders, and names of files may be anything.
    rubrics = {f"rubrics/{n}/rubric.yaml": path.read_bytes() for n, path in enumerate(chosen.rubrics, start=1)}
    settings = {"exercises": chosen.exercises, "rubrics": list(rubrics), "isolation": chosen.isolation}
    checks = {
        f"rubrics/{n}/{file.name}": file.content
        for n, path in enumerate(chosen.rubrics, start=1)
        for file in own_check_files(path)
    }
    return {
        "prepare": integration("prepare"),
        "settings.json": (json.dumps(settings, indent=2) + "\n").encode(),
        "constraints.txt": pins().encode(),
        name: content,
        **rubrics,
        **checks,
    }


def _check(chosen: Chosen) -> None:
    """Find mistakes now that would otherwise be found by the first student."""
    paths = chosen.rubrics or tuple(builtin_rubrics().values())
    exercises = [read_rubric(path, draw=First()) for path in paths]
    for path, found in zip(paths, exercises, strict=True):
        if found.variant is not None:
            text = f"{path}: expected a rubric that is the same for everybody, found one with variants"
            raise RubricError(text, "grade it with grade batch: no platform keeps the course key from students")
    require_exercises(chosen.exercises, [exercise.id for exercise in exercises])
