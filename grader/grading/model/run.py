"""Runs: a recorded submission, which is the only input of judging."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from grader.grading.model.report import Environment, Reproduction
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.packages import BroughtPackage
from grader.runtime.model.submission import Definition, Submission
from grader.runtime.model.trace import AssessedTrace


@dataclass(frozen=True, slots=True)
class Run:
    """A submission with its recordings."""

    submission: Submission  # the submission; judging never reads files in its `root`
    # (exercise id, scenario id) -> trace; a scenario with a missing file has none
    traces: Mapping[tuple[str, str], AssessedTrace]
    sources: Mapping[str, str]  # wanted file name -> its text, for finding the causes of lost points
    environment: Environment  # the software that it was recorded with
    seed: int  # determines every drawn value
    duration_s: float = 0.0  # wall time of the run
    notes: tuple[str, ...] = ()  # sentences about the files and the machine that readers must know
    reproduce: Reproduction = field(default_factory=Reproduction)  # how to reproduce the recording and the report
    interfaces: tuple[BroughtPackage, ...] = ()  # the interface packages that are not installed, sorted by name
    offered: str = ""  # digest of all interface packages of rubric and class, used or not; empty if there are none
    # Type of a recorded message -> its definition, for the types of these packages
    definitions: Mapping[str, Definition] = field(default_factory=dict)
