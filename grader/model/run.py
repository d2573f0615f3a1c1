"""Runs: one submission as it was recorded; everything that judging reads, and nothing that needs a machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from grader.model.report import Environment, Reproduction
from grader.model.submission import Submission
from grader.model.trace import Trace


@dataclass(frozen=True, slots=True)
class Run:
    """What recording one submission left behind.

    Attributes:
        submission: What was handed in; judging never looks into its `root`.
        traces: (exercise id, scenario id) -> what was observed; a scenario with a missing file has none.
        sources: Wanted file name -> its text, to find the causes of lost points in.
        environment: What it was recorded with.
        seed: Every drawn value follows from it.
        duration_s: Wall time of the run.
        notes: Sentences about the intake and the machine that a reader must know.
        reproduce: What gives the same recording and the same report again.
    """

    submission: Submission
    traces: Mapping[tuple[str, str], Trace]
    sources: Mapping[str, str]
    environment: Environment
    seed: int
    duration_s: float = 0.0
    notes: tuple[str, ...] = ()
    reproduce: Reproduction = field(default_factory=Reproduction)
