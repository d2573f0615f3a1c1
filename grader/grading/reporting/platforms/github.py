"""The report as GitHub Actions workflow commands: annotations beside the lines they refer to."""

from __future__ import annotations

from pathlib import PurePosixPath

from grader.grading.model.exercise import Location, Outcome, exercise_name
from grader.grading.model.report import ExerciseReport, Report, Verdict
from grader.grading.reporting import wording
from grader.grading.reporting.escape import log_lines, shown, workflow_message, workflow_property
from grader.runtime.model.dataclass import dataclass

#: GitHub shows at most this many annotations of one kind per step, and silently drops the rest.
MOST_OF_A_KIND = 10
_KINDS = {Outcome.NOT_MET: "error", Outcome.PARTLY: "warning", Outcome.UNDECIDED: "warning"}


@dataclass(frozen=True, slots=True)
class _Annotation:
    kind: str
    title: str
    message: str
    location: Location | None = None


def render_github(report: Report, *, folder: str | None) -> str:
    """Return the lines to print in a step.

    Each unmet criterion is an error, each partly met or undecided one a warning, and the score is one notice. Blocked
    criteria are left out, because their cause is among the others. Lines without a command repeat the end of the report
    in the log.

    The folder is that of the submission in the repository, POSIX form, empty for the root. None if it is elsewhere:
    then no annotation names a file.
    """
    annotations = [_notice(report), *_warnings(report)]
    annotations += [_annotation(e, v) for e in report.exercises for v in e.verdicts if v.outcome in _KINDS]
    kept = [a for kind in ("notice", "error", "warning") for a in _within_limit(annotations, kind)]
    lines = [_line(annotation, folder) for annotation in kept]
    lines += [
        log_lines(f"{wording.exercise_line(e)}: {remark}") for e in report.exercises for remark in wording.remarks(e)
    ]
    return "\n".join([*lines, *map(log_lines, wording.ending_lines(report))]) + "\n"


def _notice(report: Report) -> _Annotation:
    lines = [wording.headline(report), wording.summary(report), *wording.notes(report), *wording.ending_lines(report)]
    message = "\n".join(lines)
    return _Annotation("notice", f"Score: {wording.score_line(report)}", message)


def _warnings(report: Report) -> list[_Annotation]:
    found = [_Annotation("warning", "The score is not final", warning) for warning in wording.warnings(report)]
    if wording.ran_without_sandbox(report):
        found.append(_Annotation("warning", "No isolation", f"isolation: {wording.isolation(report)}"))
    return found


def _annotation(exercise: ExerciseReport, verdict: Verdict) -> _Annotation:
    score = f"{wording.points(verdict.score)}/{wording.points(verdict.max_score)}"
    number = shown(exercise.number, limit=wording.NAME_LIMIT)
    word = wording.OUTCOME_WORDS[verdict.outcome]
    return _Annotation(
        kind=_KINDS[verdict.outcome],
        title=f"{exercise_name(number)}, {shown(verdict.title)}: {word}, {score}",
        message="\n".join(wording.explanation(verdict)),
        location=verdict.location,
    )


def _within_limit(annotations: list[_Annotation], kind: str) -> list[_Annotation]:
    """Return the annotations of a kind; if there are too many, the last one counts the missing ones."""
    found = [annotation for annotation in annotations if annotation.kind == kind]
    if len(found) <= MOST_OF_A_KIND:
        return found
    kept = found[: MOST_OF_A_KIND - 1]
    more = len(found) - len(kept)
    titles = "\n".join(annotation.title for annotation in found[len(kept) :])
    return [*kept, _Annotation(kind, f"And {more} more", titles)]


def _line(annotation: _Annotation, folder: str | None) -> str:
    properties = [f"title={workflow_property(annotation.title)}"]
    place = annotation.location
    if place is not None and folder is not None:
        file = PurePosixPath(folder, place.file).as_posix()
        properties = [f"file={workflow_property(file, limit=4096)}", f"line={place.line}", *properties]
    return f"::{annotation.kind} {','.join(properties)}::{workflow_message(annotation.message)}"
