"""Reads what a report does not know from the platform: the repository folder, and the submission's metadata."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from datetime import datetime, timezone
from pathlib import Path, PurePosixPath

from grader.core.errors import GraderError
from grader.reporting.platforms.classroom50 import HandedIn

#: Environment variables that Classroom 50 sets for its autograders, by the field that each one fills.
VARIABLES = {
    "classroom": "CLASSROOM",
    "assignment": "ASSIGNMENT",
    "assignment_type": "ASSIGNMENT_TYPE",
    "owner": "OWNER",
    "username": "USERNAME",
    "submission": "SUBMISSION_TAG",
    "commit": "COMMIT_URL",
    "release": "RELEASE_URL",
    "review": "REVIEW_URL",
}
#: When the submission was committed, in any form of ISO 8601 with an offset.
COMMIT_DATETIME = "COMMIT_DATETIME"
_EVENT = "GITHUB_EVENT_PATH"
_EVENT_BYTES = 32 << 20


def repository_folder(path: str, environment: Mapping[str, str]) -> str | None:
    """Return a submission's folder in its repository, POSIX form, empty for the root; None outside of one.

    The repository is the workspace of a GitHub job, else the nearest parent folder with a `.git`, else this folder.
    """
    source = Path(os.path.realpath(path))
    folder = source if source.is_dir() else source.parent
    if not source.is_dir() and source.suffix != ".py":
        return None  # files inside an archive are not in the repository
    workspace = environment.get("GITHUB_WORKSPACE")
    root = Path(os.path.realpath(workspace)) if workspace else _nearest_checkout(folder)
    if not folder.is_relative_to(root):
        return None
    relative = PurePosixPath(folder.relative_to(root)).as_posix()
    return "" if relative == "." else relative


def handed_in(environment: Mapping[str, str]) -> HandedIn:
    """Return the metadata of the submission from Classroom 50; raises GraderError if a value is missing."""
    missing = [name for name in VARIABLES.values() if not environment.get(name)]
    if missing:
        text = (
            f"classroom50: expected {', '.join(VARIABLES.values())} in the environment, found no {', '.join(missing)}"
        )
        raise GraderError(text, "a Classroom 50 autograder has them; elsewhere use another format")
    if not environment["SUBMISSION_TAG"].startswith("submit/"):
        raise GraderError("classroom50: SUBMISSION_TAG: expected submit/..., found another tag")
    if environment["ASSIGNMENT_TYPE"] not in ("individual", "group"):
        raise GraderError("classroom50: ASSIGNMENT_TYPE: expected individual or group, found something else")
    values = {field: environment[name] for field, name in VARIABLES.items()}
    return HandedIn(**values, datetime=_committed_at(environment))


def _nearest_checkout(folder: Path) -> Path:
    return next((f for f in (folder, *folder.parents) if (f / ".git").exists()), Path(os.path.realpath(".")))


def _committed_at(environment: Mapping[str, str]) -> str:
    text = environment.get(COMMIT_DATETIME) or _from_event(environment.get(_EVENT, ""))
    try:
        when = datetime.fromisoformat(text.replace("Z", "+00:00"))
    except ValueError:
        when = datetime.min  # noqa: DTZ901  it has no offset, like a time that cannot be used
    if when.tzinfo is None:
        raise GraderError(
            f"classroom50: {COMMIT_DATETIME}: expected the commit's time with its offset, found none",
            f'export {COMMIT_DATETIME}="$(git show -s --format=%cI)"',
        )
    return when.astimezone(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")


def _from_event(path: str) -> str:
    """Return the commit time from a push event, as GitHub wrote it; empty if it has none."""
    if not path:
        return ""
    try:
        with Path(path).open("rb") as file:
            event = json.loads(file.read(_EVENT_BYTES))
        return str(event["head_commit"]["timestamp"])
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        return ""
