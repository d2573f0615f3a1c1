"""The bench that changed programs are tried on: staged, recorded in sandboxes side by side, judged as always."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path

from grader.judging.judge import judge_exercise
from grader.model.exercise import Exercise
from grader.model.submission import Submission
from grader.model.trace import Trace
from grader.reading.sources import read_sources
from grader.recording.bag import Odometry
from grader.recording.recorder import Job
from grader.recording.studio import Studio
from grader.request import Request
from grader.selftest.results import Standing, standing_of
from grader.session import Progress, plan_jobs

#: So many programs for each worker are recorded before any is judged: traces are large.
_AT_ONCE = 6


@dataclass(frozen=True, slots=True)
class Candidate:
    """A changed file that is to be run, and what is known of it."""

    id: str
    file: str
    operator: str
    source: str


@dataclass(slots=True)
class Bench:
    """What the programs of one rubric are tried with."""

    studio: Studio
    workers: int
    request: Request
    exercise: Exercise
    odometry: Odometry | None
    seed: int
    reference: Submission
    sources: Mapping[str, str]
    progress: Progress
    traces: dict[str, Trace] = field(default_factory=dict)
    recordings: int = 0

    def measure_reference(self) -> Standing:
        """Return what the reference solution is worth, and keep what was recorded of it."""
        standing, self.traces = self._recorded(self.reference)
        return standing

    def standing(self, submission: Submission) -> Standing:
        """Return what a whole submission is worth."""
        return self._recorded(submission)[0]

    def _recorded(self, submission: Submission) -> tuple[Standing, dict[str, Trace]]:
        jobs = plan_jobs(self.request, [self.exercise], submission, self.odometry, self.seed)
        recorded = self.studio.record(jobs, self.request.clock, self.progress)
        self.recordings += len(recorded)
        traces = {scenario: trace for (_, scenario), trace in recorded.items()}
        sources = read_sources(submission)
        return standing_of(judge_exercise(self.exercise, traces, submission, sources)), traces

    def standings(self, candidates: Sequence[Candidate], label: str) -> Iterator[tuple[Candidate, Standing]]:
        """Yield what each changed program is worth; scenarios without the changed file are those of the reference."""
        done, waiting = 0, iter(candidates)
        at_once = _AT_ONCE * self.workers
        while chunk := list(islice(waiting, at_once)):
            folder = self.studio.folder / "mutants"
            submissions = {c.id: self._staged(c, folder / str(n)) for n, c in enumerate(chunk)}
            jobs = {
                (c.id, key[1]): replace(job, title=f"{label}, {done + n + 1} of {len(candidates)}: {c.id}")
                for n, c in enumerate(chunk)
                for key, job in self._jobs(c, submissions[c.id]).items()
            }
            recorded = self.studio.record(jobs, self.request.clock, self.progress)
            self.recordings += len(recorded)
            for candidate in chunk:
                own = {scenario: trace for (id_, scenario), trace in recorded.items() if id_ == candidate.id}
                yield candidate, self._judged(candidate, submissions[candidate.id], own)
            shutil.rmtree(folder)
            done += len(chunk)

    def _jobs(self, candidate: Candidate, submission: Submission) -> Mapping[tuple[str, str], Job]:
        jobs = plan_jobs(self.request, [self.exercise], submission, self.odometry, self.seed)
        concerned = {s.id for s in self.exercise.scenarios if candidate.file in s.processes}
        return {key: job for key, job in jobs.items() if key[1] in concerned}

    def _judged(self, candidate: Candidate, submission: Submission, own: Mapping[str, Trace]) -> Standing:
        sources = {**self.sources, candidate.file: candidate.source}
        return standing_of(judge_exercise(self.exercise, {**self.traces, **own}, submission, sources))

    def _staged(self, candidate: Candidate, root: Path) -> Submission:
        found = self.reference.files[candidate.file].found or candidate.file
        shutil.copytree(self.reference.root, root)
        (root / found).write_text(candidate.source, encoding="utf-8", newline="")
        return replace(self.reference, root=root)
