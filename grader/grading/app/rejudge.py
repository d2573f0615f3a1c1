"""Judges kept evidence again without running anything: one submission, or a whole class at once."""

from __future__ import annotations

import gc
import os
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import cast

from grader.grading.app.grade import read_exercises
from grader.grading.app.kept_recordings import kept_traces
from grader.grading.app.request import GradeRequest, command_words, request_of
from grader.grading.evidence.store import (
    Evidence,
    first_report,
    found_under,
    is_evidence,
    open_evidence,
    run_from,
    run_of,
)
from grader.grading.judging.judge_run import judge_run
from grader.grading.model.exercise import Exercise, recordings_in
from grader.grading.model.report import Report, Reproduction, report_exit_code
from grader.grading.model.run import Run
from grader.grading.reporting.audience import ANYBODY, Readers, told
from grader.grading.reporting.delivery import Output, write_report
from grader.grading.reporting.formats import known
from grader.grading.reporting.json_report import ReportData, dumps, report_to_json
from grader.grading.reporting.rejudged import RejudgedResult, ReportChange, change
from grader.grading.rubrics.draws import First
from grader.grading.submissions.sources import read_texts
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ALL_MET, NOT_ALL_MET, UNDECIDED, UNUSABLE, EvidenceError, GraderError

#: With fewer submissions than this for each process, another process does not pay off.
WORTH_A_POOL = 16
#: Thresholds of the garbage collector while many recordings are read.
COLLECTING = (200_000, 20, 20)


@dataclass(frozen=True, slots=True)
class Judgement:
    """How to judge evidence."""

    exercises: tuple[Exercise, ...]  # all exercises of the rubrics
    chosen: tuple[str, ...] = ()  # requested exercise ids; empty for those that were graded
    rubrics: tuple[Path, ...] = ()  # given rubric files; empty for the built-in ones
    pictures: bool = False  # whether reports include charts
    verify: bool = False  # whether to compare the stored trace with the recordings


@dataclass(frozen=True, slots=True)
class Wanted:
    """The outputs wanted for each report of a class."""

    files: tuple[Output, ...] = ()  # formats, each with the folder for its files
    reports: bool = False
    changes: bool = False  # whether results include the changes since grading
    min_score: Fraction | None = None  # see `exit_code`
    readers: Readers = ANYBODY  # who reads the outputs, and when


def judgement(
    chosen: tuple[str, ...], rubrics: tuple[Path, ...], *, pictures: bool = False, verify: bool = False
) -> Judgement:
    """Read the rubrics to judge by; raises RubricError for an unusable rubric or an unknown exercise."""
    request = GradeRequest("", every=True, exercises=chosen, rubrics=rubrics, draw=First())
    exercises = read_exercises(request, recorded=True)
    ids = tuple(exercise.id for exercise in exercises) if chosen else ()  # numbers and paths stand for them, too
    return Judgement(tuple(exercises), ids, rubrics, pictures, verify)


def rejudge_evidence(evidence: Evidence, how: Judgement) -> Report:
    """Judge one submission's evidence; raises EvidenceError if it is damaged or has none of the requested exercises."""
    exercises, run = again(evidence, how)
    return judge_run(exercises, run, pictures=how.pictures)


def again(evidence: Evidence, how: Judgement) -> tuple[list[Exercise], Run]:
    """Return the exercises to judge by, and the run that evidence holds; raises EvidenceError like `rejudge`."""
    kept = evidence.manifest.run
    request = request_of(kept.request, submission=kept.path, seed=kept.seed, rubrics=how.rubrics)
    exercises = _as_recorded(_asked(evidence, how), request)
    run = _with_trees(run_of(evidence, exercises, verify=how.verify))
    if how.chosen:
        request = replace(request, exercises=how.chosen)
    same = replace(run.reproduce, command=command_words(request, kept.seed))
    return exercises, replace(run, reproduce=same, notes=(*run.notes, *_not_judged_again(exercises)))


def _with_trees(run: Run) -> Run:
    """Return a kept run whose texts have trees, which a contained process makes if one of them is looked at."""
    return replace(run, sources=read_texts(run.sources))


def _not_judged_again(exercises: Sequence[Exercise]) -> Iterator[str]:
    """Yield what readers must know of criteria whose outcome is that of the recording."""
    tests = [scenario.test for exercise in exercises for scenario in exercise.scenarios if scenario.test is not None]
    for file in dict.fromkeys(test.file for test in tests):
        count = sum(test.file == file for test in tests)
        what = "1 criterion is a test" if count == 1 else f"{count} criteria are tests"
        yield (
            f"{what} in {file}, which cannot be judged again from a recording: the outcome is that of the recorded "
            "run; to run the tests again, use grade"
        )


def judged_again(evidence: Evidence, exercises: Sequence[Exercise], request: GradeRequest, played: str) -> Report:
    """Judge kept recordings as the report of a request that would record the same; raises EvidenceError for damage.

    `played` is the digest of the recordings that exercises play.
    """
    run = _with_trees(run_from(evidence.manifest, exercises, kept_traces(evidence, exercises)))
    given = Reproduction(
        command=command_words(request, run.seed),
        rubrics=run.reproduce.rubrics,
        recording=played if any(recordings_in(exercise) for exercise in exercises) else "",
    )
    submission = replace(run.submission, path=request.submission)
    return judge_run(exercises, replace(run, submission=submission, reproduce=given), pictures=True)


def what_changed(name: str, evidence: Evidence, report: Report) -> ReportChange | None:
    """Compare a new report with the first one; None if the first one is missing or unreadable."""
    before = first_report(evidence)
    if before is None:
        return None
    try:
        return change(name, cast("ReportData", before), report_to_json(report))
    except (KeyError, TypeError, ValueError):
        return None


def named_evidence(paths: Sequence[Path]) -> list[tuple[str, Path]]:
    """Return name and folder of all evidence in and below the given paths; raises EvidenceError if one holds none."""
    named: dict[Path, str] = {}
    used: Counter[str] = Counter()
    for path in paths:
        folders = [path] if is_evidence(path) else found_under(path)
        if not folders:
            raise EvidenceError(f"{path}: expected kept evidence, found none", "keep it with -o evidence=FOLDER")
        for folder in folders:
            if folder not in named:
                name = _name(folder, path)
                used[name] += 1
                named[folder] = name if used[name] == 1 else f"{name} ({used[name]})"
    return [(name, folder) for folder, name in named.items()]


def rejudge_class(
    named: Sequence[tuple[str, Path]], how: Judgement, wanted: Wanted, *, jobs: int | None = None
) -> list[RejudgedResult]:
    """Judge many submissions, and return their results in the given order; a failure of one does not affect the others.

    They are judged by `jobs` processes, or by one for each core if it is None.
    """
    workers = min(jobs or len(os.sched_getaffinity(0)), max(1, len(named) // WORTH_A_POOL))
    if workers == 1:
        with _rare_collection():
            return [_result(name, folder, how, wanted) for name, folder in named]
    with ProcessPoolExecutor(workers, initializer=_prepare, initargs=(how, wanted)) as pool:
        return list(pool.map(_result_there, named, chunksize=max(1, min(32, len(named) // (4 * workers)))))


#: What a pool process has to do; set once when it starts.
_task: list[tuple[Judgement, Wanted]] = []


def _prepare(how: Judgement, wanted: Wanted) -> None:
    _task[:] = [(how, wanted)]
    gc.freeze()
    gc.set_threshold(*COLLECTING)


@contextmanager
def _rare_collection() -> Iterator[None]:
    """Run the cyclic garbage collector rarely: reading a recording makes many objects and few cycles."""
    usual = gc.get_threshold()
    gc.freeze()
    gc.set_threshold(*COLLECTING)
    try:
        yield
    finally:
        gc.set_threshold(*usual)
        gc.unfreeze()


def _result_there(named: tuple[str, Path]) -> RejudgedResult:
    return _result(*named, *_task[0])


def _result(name: str, folder: Path, how: Judgement, wanted: Wanted) -> RejudgedResult:
    try:
        evidence = open_evidence(folder)
        report = rejudge_evidence(evidence, how)
        _write(name, report, wanted)
    except GraderError as error:
        return RejudgedResult(name, problem=error.message, code=UNUSABLE)
    except OSError as error:
        return RejudgedResult(name, problem=f"its report cannot be written: {error.strerror or error}", code=UNUSABLE)
    seen = told(report, wanted.readers)
    return RejudgedResult(
        name,
        score=float(seen.score),
        max_score=float(seen.max_score),
        code=report_exit_code(seen, wanted.min_score),
        change=what_changed(name, evidence, report) if wanted.changes else None,
        report=dumps(seen) if wanted.reports else "",
    )


def _write(name: str, report: Report, wanted: Wanted) -> None:
    for output in wanted.files:
        if output.path is not None:
            path = output.path / f"{name}{known(output.format).suffix}"
            path.parent.mkdir(parents=True, exist_ok=True)
            write_report(report, replace(output, path=path), wanted.readers)


def _asked(evidence: Evidence, how: Judgement) -> list[Exercise]:
    """Return the requested exercises that the evidence holds."""
    held = evidence.exercises
    known = [e.id for e in how.exercises]
    missing = [id_ for id_ in (how.chosen or (() if how.rubrics else held)) if id_ not in held or id_ not in known]
    if missing and how.chosen:
        raise EvidenceError(f"{evidence.folder}: expected the exercise {missing[0]}, found {', '.join(held)}")
    if missing or not set(held) & set(known):
        what = (missing or list(held))[0]
        message = f"{evidence.folder}: expected a rubric for {what}, found one for {', '.join(known)}"
        raise EvidenceError(message, "name the rubric it was graded by with --rubric")
    return [exercise for exercise in how.exercises if exercise.id in held]


def _as_recorded(exercises: list[Exercise], request: GradeRequest) -> list[Exercise]:
    """Return the exercises with the student's variant values from when they were graded."""
    if all(exercise.variant is None for exercise in exercises):
        return exercises
    wanted = tuple(exercise.id for exercise in exercises)
    return read_exercises(replace(request, submission="", exercises=wanted), recorded=True)


def _name(folder: Path, root: Path) -> str:
    """Name a folder of evidence by its path below the root, without a trailing `evidence`."""
    parts = list(folder.relative_to(root).parts) if folder != root else [folder.resolve().name]
    if len(parts) > 1 and parts[-1] == "evidence":
        parts.pop()
    return "/".join(parts)


def class_code(results: Sequence[RejudgedResult]) -> int:
    """Return the most serious exit code of all submissions."""
    return min((r.code for r in results), key=(UNUSABLE, UNDECIDED, NOT_ALL_MET, ALL_MET).index)
