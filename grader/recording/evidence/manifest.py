"""The manifest of evidence: what was handed in, with what it was recorded, and a digest of every recording."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from enum import Enum
from functools import lru_cache
from typing import Any

import msgspec

from grader.model.errors import EvidenceError
from grader.model.scenario import Scenario

FORMAT = "grader/evidence/v1"
#: A longer manifest is none that the grader wrote.
MOST_BYTES = 64 << 20


class _Strict(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A mapping with fixed keys."""


class KeptFile(_Strict, frozen=True):
    """One file that an exercise asked for; see `grader.model.submission.StudentFile`."""

    wanted: str
    found: str | None
    similar: tuple[str, ...]
    others: tuple[str, ...]


class KeptSubmission(_Strict, frozen=True):
    """What was handed in; see `grader.model.submission.Submission`."""

    name: str
    digest: str
    files: tuple[KeptFile, ...]
    notes: tuple[str, ...]


class KeptProperty(_Strict, frozen=True):
    """One thing that the sandbox held back; see `grader.model.containment.Property`."""

    name: str
    holds: bool
    mechanism: str
    found: str


class KeptEnvironment(_Strict, frozen=True):
    """What the recordings were made with; see `grader.model.report.Environment`."""

    grader: str
    ros_distro: str
    rclpy: str
    rmw: str
    python: str
    isolation: str
    containment: tuple[KeptProperty, ...]


class KeptRecording(_Strict, frozen=True):
    """One scenario's recording.

    Attributes:
        scenario: Scenario id.
        asked: Digest of the scenario as the rubric described it.
        digest: `sha256:` of the file; None if the scenario could not be recorded for want of a file.
        at: Where in the file the trace begins that judging takes, in bytes.
        size: How long it is there.
    """

    scenario: str
    asked: str
    digest: str | None = None
    at: int = 0
    size: int = 0


class KeptExercise(_Strict, frozen=True):
    """One exercise that was graded; `rubric` is the digest of its rubric at that time."""

    id: str
    rubric: str
    recordings: tuple[KeptRecording, ...]


class KeptRun(_Strict, frozen=True):
    """What belongs to this one run: what was typed, and how long it took."""

    path: str
    seed: int
    duration_s: float
    notes: tuple[str, ...]
    recording: str
    request: dict[str, Any]


class Manifest(_Strict, frozen=True):
    """Everything but the recordings; `files` are the grader's own, `complete` is false while they are written."""

    format: str
    complete: bool
    files: tuple[str, ...]
    submission: KeptSubmission
    run: KeptRun
    environment: KeptEnvironment
    exercises: tuple[KeptExercise, ...]
    sources: dict[str, str]


def dump(manifest: Manifest) -> bytes:
    """Return a manifest as JSON text; the same manifest gives the same bytes."""
    return json.dumps(msgspec.to_builtins(manifest), indent=1, allow_nan=False).encode() + b"\n"


def parse(data: bytes) -> Manifest:
    """Return the manifest that a text holds.

    Raises:
        EvidenceError: It holds none, or one of another version.
    """
    try:
        found = json.loads(data)
        version = found.get("format") if isinstance(found, dict) else None
        if version != FORMAT:
            what = f"the format {version[:40]}" if isinstance(version, str) else "none"
            raise EvidenceError(f"expected evidence of the format {FORMAT}, found {what}")
        return msgspec.convert(found, Manifest)
    except (ValueError, RecursionError) as error:
        raise EvidenceError(f"expected {FORMAT}, found something else ({type(error).__name__})") from error


def scenario_digest(scenario: Scenario) -> str:
    """Return a digest of everything that shapes a recording; fields at their defaults do not count."""
    try:
        return _known_digest(scenario)
    except TypeError:  # one with fields of messages cannot be a key
        return _digest(scenario)


@lru_cache(maxsize=256)
def _known_digest(scenario: Scenario) -> str:
    return _digest(scenario)


def _digest(scenario: Scenario) -> str:
    return sha256(json.dumps(_plainly(scenario), sort_keys=True).encode())


def sha256(data: bytes) -> str:
    """Return the digest of bytes as manifests name it."""
    return f"sha256:{hashlib.sha256(data).hexdigest()}"


def _plainly(value: Any) -> Any:
    if is_dataclass(value):
        kept = {f.name: getattr(value, f.name) for f in fields(value)}
        defaults = {f.name: f.default for f in fields(value) if f.default is not MISSING}
        changed = {n: _plainly(v) for n, v in kept.items() if n not in defaults or v != defaults[n]}
        return {type(value).__name__: changed}
    if isinstance(value, Mapping):
        return {str(key): _plainly(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plainly(item) for item in value]
    return value.value if isinstance(value, Enum) else value
