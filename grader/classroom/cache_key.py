"""What a result depends on, as one digest: the same key means that nothing has to be run again."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass

from grader.app.spot_checks import is_drawn
from grader.core.errors import GraderError
from grader.core.exercise import Drawn
from grader.core.limits import TIME_BUDGET_S


@dataclass(frozen=True, slots=True)
class Conditions:
    """All that a class is graded with, besides what the students handed in.

    Attributes:
        grader: Version of the grader.
        rubrics: Exercise id and digest of its rubric, in the order graded.
        recording: Digest of the /odom recording; empty if none is played.
        seed: The seed of every drawn value; None in what a whole class is graded with, if each submission has its own.
        clock: The clock that was asked for.
        isolation: The sandbox that was asked for.
        time_budget_s: Real time that all recordings of a submission may take together.
        every: Whether only exercises count of which a submission has a file.
        variants: The values that are this student's own; None if nothing varies.
        spot_checks: Share of the class that is drawn to be checked on the wall clock, from 0 to 1.
    """

    grader: str
    rubrics: tuple[tuple[str, str], ...]
    recording: str
    seed: int | None
    clock: str
    isolation: str
    every: bool = False
    variants: Drawn | None = None
    time_budget_s: float = TIME_BUDGET_S
    spot_checks: float = 0.0

    def key(self, submission: str) -> str:
        """Return the key of the result of a submission, by its digest."""
        depends_on = {**asdict(self), "submission": submission}
        # Only who is drawn with one share and not with another is graded again.
        if is_drawn(depends_on.pop("spot_checks"), self.seed or 0, submission):
            depends_on["spot_check"] = True
        text = json.dumps(depends_on, sort_keys=True)
        return f"sha256:{hashlib.sha256(text.encode()).hexdigest()}"


def unusable_digest(error: GraderError) -> str:
    """Return what stands for the digest of a submission that cannot be used: it is new when the reason is."""
    return f"unusable:{hashlib.sha256(error.message.encode('utf-8', 'surrogatepass')).hexdigest()}"
