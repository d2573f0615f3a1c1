"""What became of one submission, as it lies in the folder for results."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import Enum

import msgspec

from grader.reports.escape import json_value

SCHEMA = "grader/batch-result/v1"


class State(str, Enum):
    """What an attempt at grading a submission came to; only the first two have a report."""

    GRADED = "graded"
    UNDECIDED = "undecided"  # a criterion was not decided, through no fault of the student
    REFUSED = "refused"  # the submission cannot be used: the student, or whoever named it, must act
    FAILED = "failed"  # the grader or the machine failed: never a mark

    @property
    def worth(self) -> int:
        """How good a result is: a worse one never replaces a better one."""
        return {State.FAILED: 0, State.UNDECIDED: 1, State.REFUSED: 2, State.GRADED: 2}[self]


@dataclass(frozen=True, slots=True)
class Standing:
    """What became of one submission.

    Attributes:
        state: See State.
        key: What the result depends on; see `Conditions`.
        digest: Digest of what was handed in.
        label: What the source calls the submission.
        problem: Why there is no report, one line; empty if there is one.
        hint: One thing to do; may be empty.
        score: Points earned.
        max_score: Points to be had.
        duration_s: Wall time.
        usage: What it cost: `processor_s` and `peak_bytes`.
        schema: Version of this format.
    """

    state: State
    key: str
    digest: str
    label: str
    problem: str = ""
    hint: str = ""
    score: float = 0.0
    max_score: float = 0.0
    duration_s: float = 0.0
    usage: Mapping[str, float] = field(default_factory=dict)
    schema: str = SCHEMA


def dump(standing: Standing) -> bytes:
    """Return a standing as JSON; what is no text in a name becomes a sign for that."""
    return json.dumps(json_value(asdict(standing)), indent=2).encode() + b"\n"


def load(data: bytes) -> Standing | None:
    """Return a standing; None if the data is none of this version."""
    try:
        standing = msgspec.json.decode(data, type=Standing)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError):
        return None
    return standing if standing.schema == SCHEMA else None
