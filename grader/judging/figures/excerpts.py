"""Cuts the lines around a place that a report names out of the student's source."""

from __future__ import annotations

from collections.abc import Mapping

from grader.core.chart import Excerpt
from grader.core.exercise import Location
from grader.core.report import ExerciseReport
from grader.core.submission import Submission

#: Lines shown before and after the one that is meant.
AROUND = 3
#: A line of a source may be a megabyte long.
_LONGEST_LINE = 400
_TAB = 4


def excerpts_for(report: ExerciseReport, submission: Submission, sources: Mapping[str, str]) -> tuple[Excerpt, ...]:
    """Return the source around each place that a verdict or a fault names, each once; unknown places have none."""
    places = [v.location for v in report.verdicts if v.location is not None]
    places += [Location(f.file, f.line) for f in report.faults if f.file and f.line > 0]
    texts = {file.found: sources[wanted] for wanted, file in submission.files.items() if wanted in sources}
    lines = {name: text.splitlines() for name, text in texts.items() if any(p.file == name for p in places)}
    found = (_excerpt(place, lines.get(place.file, [])) for place in dict.fromkeys(places))
    return tuple(excerpt for excerpt in found if excerpt is not None)


def _excerpt(place: Location, lines: list[str]) -> Excerpt | None:
    if not 1 <= place.line <= len(lines):
        return None
    first = max(1, place.line - AROUND)
    shown = lines[first - 1 : place.line + AROUND]
    return Excerpt(place.file, place.line, first, tuple(line[:_LONGEST_LINE].expandtabs(_TAB) for line in shown))
