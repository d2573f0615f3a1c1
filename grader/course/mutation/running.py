"""Tests rubrics: runs reference, template, mutants and correct variants in parallel."""

from __future__ import annotations

import os
import random
import shutil
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from fnmatch import fnmatchcase
from itertools import islice, zip_longest
from pathlib import Path

from libcst import ParserSyntaxError

from grader.course.mutation.explained import Explained, Explanation, read_explained
from grader.course.mutation.operators import mutants_of
from grader.course.mutation.operators.program import Candidate, ParsedProgram
from grader.course.mutation.operators.variants import variants_of
from grader.course.mutation.results import (
    Fate,
    SelftestResult,
    Trial,
    TrialResult,
    one_line_change,
    result_of,
    unified_change,
)
from grader.grading.app.bags import read_recordings
from grader.grading.app.grade import Progress, plan_jobs, plan_tests, read_exercises
from grader.grading.app.interfaces import provided_for
from grader.grading.app.request import GradeRequest
from grader.grading.app.seeds import PRACTICE
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.model.exercise import Exercise
from grader.grading.model.rubric_files import notes_on, rubric_file
from grader.grading.submissions.sources import read_sources
from grader.grading.submissions.submission import stage_submission
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import RubricError
from grader.runtime.model.submission import Submission
from grader.runtime.model.trace import AssessedTrace
from grader.runtime.model.wording import printable
from grader.runtime.plan import Surroundings
from grader.runtime.session import Job, RecordingSession, TestJob, open_session, planned_clock

__all__ = [
    "SelftestOptions",
    "SelftestResult",
    "TrialRunner",
    "selftest",
]

#: Programs per worker that are recorded before they are judged; limited because traces are large.
_AT_ONCE = 6


@dataclass(slots=True)
class TrialRunner:
    """Grades the programs of one rubric."""

    session: RecordingSession
    workers: int
    request: GradeRequest
    exercise: Exercise
    around: Surroundings  # what the runs of all programs have besides their files
    reference: Submission
    sources: Mapping[str, str]
    progress: Progress
    traces: dict[str, AssessedTrace] = field(default_factory=dict)
    recordings: int = 0

    def grade(self, submission: Submission) -> tuple[TrialResult, dict[str, AssessedTrace]]:
        """Grade a complete submission; the traces are those of its scenarios."""
        jobs = plan_jobs([self.exercise], submission, self.around)
        recorded = self.session.record(jobs, self.request.clock, self.progress)
        recorded |= self.session.record_tests(self._tests(submission), self.progress)
        self.recordings += len(recorded)
        traces = {scenario: trace for (_, scenario), trace in recorded.items()}
        return result_of(judge_exercise(self.exercise, traces, submission, read_sources(submission))), traces

    def grade_changed(self, candidates: Sequence[Candidate], label: str) -> Iterator[tuple[Candidate, TrialResult]]:
        """Grade changed programs; scenarios without the changed file reuse the traces of the reference."""
        done, waiting = 0, iter(candidates)
        at_once = _AT_ONCE * self.workers
        while chunk := list(islice(waiting, at_once)):
            folder = self.session.folder / "mutants"
            submissions = {c.id: self._staged(c, folder / str(n)) for n, c in enumerate(chunk)}
            jobs = {
                (c.id, key[1]): replace(job, title=f"{label}, {done + n + 1} of {len(candidates)}: {c.id}")
                for n, c in enumerate(chunk)
                for key, job in self._jobs(c, submissions[c.id]).items()
            }
            recorded = self.session.record(jobs, self.request.clock, self.progress)
            tests = {(c.id, key[1]): job for c in chunk for key, job in self._tests(submissions[c.id]).items()}
            recorded |= self.session.record_tests(tests, self.progress)
            self.recordings += len(recorded)
            for candidate in chunk:
                own = {scenario: trace for (id_, scenario), trace in recorded.items() if id_ == candidate.id}
                yield candidate, self._judged(candidate, submissions[candidate.id], own)
            shutil.rmtree(folder)
            done += len(chunk)

    def _jobs(self, candidate: Candidate, submission: Submission) -> Mapping[tuple[str, str], Job]:
        jobs = plan_jobs([self.exercise], submission, self.around)
        concerned = {s.id for s in self.exercise.scenarios if candidate.file in s.processes}
        return {key: job for key, job in jobs.items() if key[1] in concerned}

    def _tests(self, submission: Submission) -> Mapping[tuple[str, str], TestJob]:
        return plan_tests([self.exercise], submission, self.around)

    def _judged(self, candidate: Candidate, submission: Submission, own: Mapping[str, AssessedTrace]) -> TrialResult:
        sources = {**self.sources, candidate.file: candidate.source}
        return result_of(judge_exercise(self.exercise, {**self.traces, **own}, submission, sources))

    def _staged(self, candidate: Candidate, root: Path) -> Submission:
        found = self.reference.files[candidate.file].found or candidate.file
        shutil.copytree(self.reference.root, root)
        (root / found).write_text(candidate.source, encoding="utf-8", newline="")
        return replace(self.reference, root=root)


#: A sample has one variant for this many mutants.
_MUTANTS_A_VARIANT = 4


@dataclass(frozen=True, slots=True)
class SelftestOptions:
    """How to test rubrics."""

    reference: Path | None = None  # folder of reference solutions; None for the one in the notes beside a rubric
    template: Path | None = None  # folder of templates; None for the one in the notes
    jobs: int | None = None  # scenarios recorded in parallel; None for a number that suits the machine
    only: str = ""  # pattern for the ids to run, with `*` for anything; empty for all
    # Most mutants of a rubric, spread over the operators, with a quarter as many variants; None for all
    sample: int | None = None
    # Seed of the sample and of all drawn values; None derives the values from the reference solution
    seed: int | None = None
    clock: str = "auto"
    isolation: str = "auto"


def selftest(rubrics: Sequence[Path], options: SelftestOptions, progress: Progress) -> Iterator[SelftestResult]:
    """Test rubrics, and yield the result of each as it is ready; raises GraderError if something cannot be used."""
    prepared = [_prepared(path, options) for path in rubrics]
    workers = options.jobs or len(os.sched_getaffinity(0))
    with open_session(options.isolation, workers) as session:
        for path, exercise, explained in prepared:
            bench = _bench(path, exercise, explained, session, replace(options, jobs=workers), progress)
            yield _tested(path, bench, explained, options)


def _prepared(path: Path, options: SelftestOptions) -> tuple[Path, Exercise, Explained]:
    path = rubric_file(path)
    (exercise,) = read_exercises(GradeRequest("", rubrics=(path,)))
    known = read_explained(notes_on(path), exercise)
    exercise, left_out = _without_recordings(path, exercise)
    explained = replace(
        known,
        reference=options.reference or known.reference,
        template=options.template or known.template,
        criteria={**known.criteria, **left_out},
    )
    if explained.reference is None:
        hint = f"name it with --reference FOLDER, or as `reference:` in {notes_on(path).name}"
        raise RubricError(f"{path}: expected a reference solution to test it with, found none", hint)
    return path, exercise, explained


def _without_recordings(path: Path, exercise: Exercise) -> tuple[Exercise, Mapping[str, str]]:
    """Return an exercise without what recordings of students decide, and why the criteria about these are left out.

    Raises RubricError if nothing else is left.
    """
    bags = {scenario.id for scenario in exercise.scenarios if scenario.handed_in is not None}
    kept = [criterion for criterion in exercise.criteria if criterion.scenario not in bags]
    if not kept:
        text = "expected a criterion about a program, found only some about recordings that students hand in"
        raise RubricError(f"{path}: {text}", "no program can be changed to test these: grade a few recordings instead")
    names = {criterion.id for criterion in kept}
    criteria = tuple(replace(one, needs=tuple(need for need in one.needs if need in names)) for one in kept)
    scenarios = tuple(scenario for scenario in exercise.scenarios if scenario.id not in bags)
    why = "a recording that students hand in decides it, and no change of a program alters that"
    left_out = {criterion.id: why for criterion in exercise.criteria if criterion.id not in names}
    return replace(exercise, criteria=criteria, scenarios=scenarios), left_out


def _bench(  # noqa: PLR0913  each comes from a different stage
    path: Path,
    exercise: Exercise,
    explained: Explained,
    session: RecordingSession,
    options: SelftestOptions,
    progress: Progress,
) -> TrialRunner:
    request = GradeRequest(
        "", rubrics=(path,), clock=options.clock, isolation=options.isolation, workers=options.jobs, seed=options.seed
    )
    reference = _staged(explained.reference, exercise, session, "reference")
    seed = PRACTICE.seed(reference.digest) if options.seed is None else options.seed
    folders = tuple(map(str, provided_for(session, [exercise], (), reference).folders))
    recordings = read_recordings(request, [exercise])
    return TrialRunner(
        session=session,
        request=request,
        exercise=exercise,
        around=Surroundings(seed, planned_clock(request.clock), recordings, folders, trusted=folders),
        reference=reference,
        sources=_sources(reference, exercise),
        progress=progress,
        workers=options.jobs or 1,
    )


def _staged(folder: Path | None, exercise: Exercise, session: RecordingSession, name: str) -> Submission:
    root = session.folder / exercise.id / name
    root.mkdir(parents=True)
    return stage_submission(str(folder), exercise.files, root)


def _sources(reference: Submission, exercise: Exercise) -> Mapping[str, str]:
    """Read the files of the reference solution; raises RubricError if one cannot be used."""
    sources = read_sources(reference)
    for name in exercise.files:
        if name not in sources:
            raise RubricError(f"{reference.path}: expected {name} of {exercise.id} in it, found none that can be read")
        try:
            ParsedProgram(sources[name])
        except ParserSyntaxError as error:
            where = f"{reference.path}/{name}:{error.raw_line}"
            raise RubricError(f"{where}: expected a program that libcst can read, found another") from None
    return sources


def _tested(path: Path, bench: TrialRunner, explained: Explained, options: SelftestOptions) -> SelftestResult:
    started = time.perf_counter()
    exercise = bench.exercise
    bench.progress(f"{exercise.id}: reference and template")
    reference, bench.traces = bench.grade(bench.reference)
    template = None
    if explained.template is not None:
        template, _ = bench.grade(_staged(explained.template, exercise, bench.session, "template"))
    # Without a correct program, results of wrong ones are meaningless.
    tried = tuple(_mutants(bench, explained, options)) if reference.full else ()
    correct = tuple(_variants(bench, explained, options)) if reference.full else ()
    whole = reference.full and not options.only and options.sample is None
    return SelftestResult(
        rubric=str(path),
        exercise=exercise.id,
        criteria=tuple(criterion.id for criterion in exercise.criteria),
        reference=reference,
        template=template,
        baseline=explained.template_score,
        mutants=tried,
        variants=correct,
        whole=whole,
        idle=(*_unfilled(explained), *(_idle(explained, tried, correct) if whole else ())),
        unturned={id_: because for id_, because in explained.criteria.items() if because},
        recordings=bench.recordings,
        duration_s=time.perf_counter() - started,
    )


def _mutants(bench: TrialRunner, explained: Explained, options: SelftestOptions) -> Iterator[Trial]:
    """Run the selected mutants."""
    made = (mutant for name in bench.exercise.files for mutant in mutants_of(bench.sources[name], name))
    for trial in _trials(bench, made, "mutant", options, options.sample):
        because = _reason(explained.survivors, trial.id) if trial.fate is Fate.SURVIVED else ""
        yield replace(trial, because=because, expected=_first(explained.expected, trial.id).criteria)


def _variants(bench: TrialRunner, explained: Explained, options: SelftestOptions) -> Iterator[Trial]:
    """Run the selected correct variants."""
    made = (variant for name in bench.exercise.files for variant in variants_of(bench.sources[name], name))
    most = None if options.sample is None else -(-options.sample // _MUTANTS_A_VARIANT)
    for trial in _trials(bench, made, "variant", options, most):
        because = _reason(explained.variants, trial.id) if trial.fate is Fate.KILLED else ""
        yield replace(trial, because=because)


def _trials(
    bench: TrialRunner, made: Iterable[Candidate], word: str, options: SelftestOptions, most: int | None
) -> Iterator[Trial]:
    """Run the candidates that the options select, at most so many."""
    wanted = [c for c in made if not options.only or fnmatchcase(c.id, options.only)]
    chosen = _sampled(wanted, most, options.seed or 0)
    for candidate, result in bench.grade_changed(chosen, f"{bench.exercise.id}: {word}"):
        change = one_line_change(bench.sources[candidate.file], candidate.source)
        diff = unified_change(bench.sources[candidate.file], candidate.source)
        yield Trial(candidate.id, candidate.file, candidate.operator, change, result, diff=diff)


def _sampled(candidates: Sequence[Candidate], most: int | None, seed: int) -> list[Candidate]:
    """Draw a reproducible sample, spread over the operators, in the original order."""
    if most is None:
        return list(candidates)
    draw = random.Random(f"{seed}")  # noqa: S311  must be reproducible
    groups: dict[str, list[Candidate]] = {}
    for candidate in draw.sample(candidates, len(candidates)):
        groups.setdefault(candidate.operator, []).append(candidate)
    rounds = zip_longest(*groups.values())
    drawn = [candidate.id for one_each in rounds for candidate in one_each if candidate is not None]
    kept = set(drawn[:most])
    return [candidate for candidate in candidates if candidate.id in kept]


def _reason(explanations: Iterable[Explanation], id_: str) -> str:
    """Return the reason in the first note that fits and has one; empty if none has."""
    return _first((one for one in explanations if one.because), id_).because


def _first(explanations: Iterable[Explanation], id_: str) -> Explanation:
    """Return the first note that fits; an empty one if none does."""
    return next((explanation for explanation in explanations if explanation.fits(id_)), Explanation(""))


def _unfilled(explained: Explained) -> Iterator[str]:
    """Yield the notes whose reason is still to be filled in."""
    for note in (*explained.survivors, *explained.variants):
        if not note.because:
            yield f"{note.where}: `{printable(note.pattern)}` needs a reason after `because:`"
    for id_, because in explained.criteria.items():
        if not because:
            yield f"{id_}: the note needs a reason after `because:`"


def _idle(explained: Explained, mutants: Sequence[Trial], variants: Sequence[Trial]) -> tuple[str, ...]:
    """Return the explanations in the notes that nothing needs."""
    concerned = (
        (explained.survivors, [trial.id for trial in mutants if trial.fate is Fate.SURVIVED]),
        (explained.expected, [trial.id for trial in mutants]),
        (explained.variants, [trial.id for trial in variants if trial.fate is Fate.KILLED]),
    )
    unused = (note for notes, ids in concerned for note in notes if not any(map(note.fits, ids)))
    turned = {id_ for trial in mutants for id_ in trial.result.turned}
    return (
        *(f"{note.where}: nothing matches `{printable(note.pattern)}`" for note in unused),
        *(
            f"{id_}: the notes say why it detects no mutant, but it detects some"
            for id_ in explained.criteria
            if id_ in turned
        ),
    )
