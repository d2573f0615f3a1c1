"""Tests rubrics: reference, template, mutants and correct variants, and what their author says of them."""

from __future__ import annotations

import os
import random
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from itertools import zip_longest
from pathlib import Path

from libcst import ParserSyntaxError

from grader.model.errors import RubricError
from grader.model.exercise import Exercise
from grader.model.submission import Submission
from grader.reading.sources import read_sources
from grader.reading.submission import stage_submission
from grader.recording.studio import Studio, open_studio
from grader.request import Request
from grader.seeding import PRACTICE
from grader.selftest.bench import Bench, Candidate
from grader.selftest.explained import Explained, Explanation, beside, idle, read_explained
from grader.selftest.mutating.mutants import mutants_of
from grader.selftest.mutating.program import Program
from grader.selftest.mutating.variants import variants_of
from grader.selftest.results import Fate, Result, Standing, Trial, one_line_change
from grader.session import Progress, read_exercises, read_recording

#: A sample holds a variant for so many mutants.
_MUTANTS_A_VARIANT = 4


@dataclass(frozen=True, slots=True)
class Options:
    """How rubrics are tested.

    Attributes:
        reference: Folder of reference solutions; None for what the notes beside a rubric name.
        template: Folder of templates; None likewise.
        jobs: Scenarios recorded side by side; None leaves it to the machine.
        only: Ids to run, with `*` for anything; empty for all.
        sample: Most mutants of a rubric, spread over the operators, with a quarter as many variants; None for all.
        seed: Of the sample, and of every drawn value; None derives the values from the reference solution.
        clock: `virtual`, `wall` or `auto`.
        isolation: `auto`, `none` or the name of a tier.
    """

    reference: Path | None = None
    template: Path | None = None
    jobs: int | None = None
    only: str = ""
    sample: int | None = None
    seed: int | None = None
    clock: str = "auto"
    isolation: str = "auto"


def selftest(rubrics: Sequence[Path], options: Options, progress: Progress) -> Iterator[Result]:
    """Test rubrics, and yield what came of each as soon as it is there.

    Args:
        rubrics: Their files.
        options: How they are tested.
        progress: Hears which step begins.

    Raises:
        GraderError: Something that the test needs cannot be used; its class says who must act.
    """
    prepared = [_prepared(path, options) for path in rubrics]
    workers = options.jobs or len(os.sched_getaffinity(0))
    with open_studio(options.isolation, workers) as studio:
        for path, exercise, explained in prepared:
            bench = _bench(path, exercise, explained, studio, replace(options, jobs=workers), progress)
            yield _tested(path, bench, explained, options)


def _prepared(path: Path, options: Options) -> tuple[Path, Exercise, Explained]:
    (exercise,) = read_exercises(Request("", rubrics=(path,)))
    said = read_explained(beside(path), exercise)
    explained = replace(said, reference=options.reference or said.reference, template=options.template or said.template)
    if explained.reference is None:
        hint = f"name it with --reference FOLDER, or as `reference:` in {beside(path).name}"
        raise RubricError(f"{path}: expected a reference solution to test it with, found none", hint)
    return path, exercise, explained


def _bench(  # noqa: PLR0913  each comes from another stage
    path: Path, exercise: Exercise, explained: Explained, studio: Studio, options: Options, progress: Progress
) -> Bench:
    request = Request(
        "", rubrics=(path,), clock=options.clock, isolation=options.isolation, workers=options.jobs, seed=options.seed
    )
    reference = _staged(explained.reference, exercise, studio, "reference")
    return Bench(
        studio=studio,
        request=request,
        exercise=exercise,
        odometry=read_recording(request, [exercise]),
        seed=PRACTICE.seed(reference.digest) if options.seed is None else options.seed,
        reference=reference,
        sources=_sources(reference, exercise),
        progress=progress,
        workers=options.jobs or 1,
    )


def _staged(folder: Path | None, exercise: Exercise, studio: Studio, name: str) -> Submission:
    root = studio.folder / exercise.id / name
    root.mkdir(parents=True)
    return stage_submission(str(folder), exercise.files, root)


def _sources(reference: Submission, exercise: Exercise) -> dict[str, str]:
    """Return the text of every file of the reference solution; raises RubricError if one cannot be used."""
    sources = read_sources(reference)
    for name in exercise.files:
        if name not in sources:
            raise RubricError(f"{reference.path}: expected {name} of {exercise.id} in it, found none that can be read")
        try:
            Program(sources[name])
        except ParserSyntaxError as error:
            where = f"{reference.path}/{name}:{error.raw_line}"
            raise RubricError(f"{where}: expected a program that libcst can read, found another") from None
    return sources


def _tested(path: Path, bench: Bench, explained: Explained, options: Options) -> Result:
    started = time.perf_counter()
    exercise = bench.exercise
    bench.progress(f"{exercise.id}: reference and template")
    reference = bench.measure_reference()
    template = None
    if explained.template is not None:
        template = bench.standing(_staged(explained.template, exercise, bench.studio, "template"))
    # Without a right program nothing can be said about wrong ones.
    tried = tuple(_mutants(bench, explained, options)) if reference.full else ()
    correct = tuple(_variants(bench, explained, options)) if reference.full else ()
    whole = reference.full and not options.only and options.sample is None
    return Result(
        rubric=str(path),
        exercise=exercise.id,
        criteria=tuple(criterion.id for criterion in exercise.criteria),
        reference=reference,
        template=template,
        baseline=explained.template_score,
        mutants=tried,
        variants=correct,
        whole=whole,
        idle=_idle(explained, tried, correct) if whole else (),
        unturned=explained.criteria,
        recordings=bench.recordings,
        duration_s=time.perf_counter() - started,
    )


def _mutants(bench: Bench, explained: Explained, options: Options) -> Iterator[Trial]:
    """Yield the mutants that were asked for, tried."""
    found = [mutant for name in bench.exercise.files for mutant in mutants_of(bench.sources[name], name)]
    wanted = [Candidate(m.id, m.file, m.operator, m.source) for m in found if _wanted(m.id, options)]
    for candidate, standing in bench.standings(
        _sampled(wanted, options.sample, options.seed or 0), f"{bench.exercise.id}: mutant"
    ):
        trial = _trial(candidate, standing, bench)
        because = _first(explained.survivors, trial.id) if trial.fate is Fate.SURVIVED else None
        expected = _first(explained.expected, trial.id)
        yield replace(trial, because=because.because if because else "", expected=expected.criteria if expected else ())


def _variants(bench: Bench, explained: Explained, options: Options) -> Iterator[Trial]:
    """Yield the correct variants that were asked for, tried."""
    found = [variant for name in bench.exercise.files for variant in variants_of(bench.sources[name], name)]
    wanted = [Candidate(v.id, v.file, v.name, v.source) for v in found if _wanted(v.id, options)]
    most = None if options.sample is None else -(-options.sample // _MUTANTS_A_VARIANT)
    chosen = _sampled(wanted, most, options.seed or 0)
    for candidate, standing in bench.standings(chosen, f"{bench.exercise.id}: variant"):
        trial = _trial(candidate, standing, bench)
        because = _first(explained.variants, trial.id) if trial.fate is Fate.KILLED else None
        yield replace(trial, because=because.because if because else "")


def _trial(candidate: Candidate, standing: Standing, bench: Bench) -> Trial:
    change = one_line_change(bench.sources[candidate.file], candidate.source)
    return Trial(candidate.id, candidate.file, candidate.operator, change, standing)


def _wanted(id_: str, options: Options) -> bool:
    return not options.only or fnmatchcase(id_, options.only)


def _sampled(candidates: Sequence[Candidate], most: int | None, seed: int) -> list[Candidate]:
    """Return at most so many, spread over the operators, in the same order; the draw repeats."""
    if most is None:
        return list(candidates)
    draw = random.Random(f"{seed}")  # noqa: S311  it has to repeat
    groups: dict[str, list[Candidate]] = {}
    for candidate in draw.sample(candidates, len(candidates)):
        groups.setdefault(candidate.operator, []).append(candidate)
    rounds = zip_longest(*groups.values())
    drawn = [candidate.id for one_each in rounds for candidate in one_each if candidate is not None]
    kept = set(drawn[:most])
    return [candidate for candidate in candidates if candidate.id in kept]


def _first(explanations: Iterable[Explanation], id_: str) -> Explanation | None:
    return next((explanation for explanation in explanations if explanation.fits(id_)), None)


def _idle(explained: Explained, mutants: Sequence[Trial], variants: Sequence[Trial]) -> tuple[str, ...]:
    """Return what the author explains and nothing needs."""
    survived = [trial.id for trial in mutants if trial.fate is Fate.SURVIVED]
    lost = [trial.id for trial in variants if trial.fate is Fate.KILLED]
    every = [trial.id for trial in mutants]
    turned = {id_ for trial in mutants for id_ in trial.standing.turned}
    return (
        *idle(explained.survivors, lambda e: any(map(e.fits, survived))),
        *idle(explained.expected, lambda e: any(map(e.fits, every))),
        *idle(explained.variants, lambda e: any(map(e.fits, lost))),
        *(f"{id_}: the notes say why no mutant turns it, but some do" for id_ in explained.criteria if id_ in turned),
    )
