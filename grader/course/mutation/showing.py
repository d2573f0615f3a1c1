"""Renders the results of a self-test: tables for people, JSON for programs."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from fractions import Fraction
from io import StringIO

from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from grader.course.mutation.results import Fate, Nearest, SelftestResult, Trial, TrialResult
from grader.grading.model.exercise import Outcome
from grader.grading.model.measures import Measure
from grader.grading.model.report import JsonObject
from grader.grading.reporting.escape import shown, valid_unicode

SCHEMA = "grader/selftest/v1"
_NARROWEST = 80
#: Most lines of a change that are shown.
_MOST_LINES = 30
_GOOD, _BAD, _QUIET = "green", "bold red", "dim"


def render_selftest(results: Sequence[SelftestResult], *, width: int, colour: bool) -> str:
    """Render the results as text, at least 80 columns wide; the words are the same without ANSI colours."""
    out = StringIO()
    console = Console(
        file=out,
        width=max(width, _NARROWEST),
        force_terminal=colour,
        color_system="standard" if colour else None,
        legacy_windows=False,
        highlight=False,
        markup=False,
        emoji=False,
        _environ={},
    )
    for result in results:
        _result(console, result)
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines()) + "\n"


def _result(console: Console, result: SelftestResult) -> None:
    verdict = Text("no hole found" if result.passed else "HAS HOLES", style=_GOOD if result.passed else _BAD)
    console.print(Text(f"{shown(result.exercise)} ({shown(result.rubric)}): ").append(verdict))
    console.print(f"  reference  {_score(result.reference)}", style="" if result.reference.full else _BAD)
    if result.template is not None:
        expected = "" if result.baseline is None else f", expected {_points(result.baseline)}"
        console.print(f"  template   {_score(result.template)}{expected}", style="" if result.template_fits else _BAD)
    if not result.reference.full:
        console.print("  mutants    none tried: the reference must get full points first")
        _reasons(console, result.reference)
        return
    console.print(f"  mutants    {_count(result)}")
    lost = len(result.marked_down)
    variants = f"{len(result.variants)} correct programs, {lost or 'none'} of them lost points"
    console.print(f"  variants   {variants}", style=_BAD if lost else "")
    console.print(f"  recorded   {result.recordings} scenarios in {result.duration_s:.0f} s")
    console.print()
    console.print(_operators(result))
    console.print()
    console.print(_criteria(result))
    for near in result.nearest:
        _put(console, 2, _near(near))
    _listed(console, "Survivors, which no criterion detected", result.survivors, _BAD)
    _listed(console, "Correct variants that lost points", result.marked_down, _BAD)
    _listed(console, "Undecided, because the grader or the machine failed", result.undecided, "yellow")
    others = [t for t in result.mutants if t.fate is Fate.KILLED and not t.as_expected]
    _listed(console, "Detected by another criterion than expected", others, "yellow")
    _listed(console, "Explained survivors", [t for t in result.mutants if t.because], _QUIET)
    _listed(console, "Explained variants", [t for t in result.variants if t.because], _QUIET)
    for id_, because in result.unturned.items():
        _put(console, 2, f"{id_} detects no mutant because {shown(because, limit=600)}", _QUIET)
    for line in result.idle:
        _put(console, 2, line, "yellow")


def _count(result: SelftestResult) -> str:
    fates = [trial.fate for trial in result.mutants]
    explained = sum(bool(trial.because) for trial in result.mutants)
    counts = f"{len(fates)} tried, {fates.count(Fate.KILLED)} detected, {len(result.survivors)} survived"
    undecided = f", {fates.count(Fate.UNDECIDED)} undecided" if Fate.UNDECIDED in fates else ""
    partial = "" if result.whole else " (a part of all)"
    return f"{counts}, {explained} more survived for a reason in the notes{undecided}{partial}"


def _operators(result: SelftestResult) -> Table:
    """Build the table with a row for each operator; a column in which nothing stands is left out."""
    names = ("tried", "detected", "as expected", "by others", "explained", "undecided", "SURVIVED")
    rows: dict[str, tuple[int, ...]] = {}
    for name in dict.fromkeys(trial.operator for trial in result.mutants):
        own = [trial for trial in result.mutants if trial.operator == name]
        killed = [trial for trial in own if trial.fate is Fate.KILLED]
        predicted = [trial for trial in killed if trial.expected]
        right = sum(trial.as_expected for trial in predicted)
        survived = sum(trial.fate is Fate.SURVIVED and not trial.because for trial in own)
        excused = sum(bool(trial.because) for trial in own)
        undecided = sum(trial.fate is Fate.UNDECIDED for trial in own)
        rows[name] = (len(own), len(killed), right, len(predicted) - right, excused, undecided, survived)
    shown_ = [column for column in range(len(names)) if column < 2 or any(row[column] for row in rows.values())]
    table = _table("mistake", *(names[column] for column in shown_))
    for name, row in rows.items():
        table.add_row(name, *(str(row[column] or "") for column in shown_), style=_BAD if row[-1] else "")
    return table


def _criteria(result: SelftestResult) -> Table:
    """Build the table with a row for each criterion."""
    table = _table("criterion", "detected", "only by this", "expected", "of these detected", "")
    for id_ in result.criteria:
        turned = [trial for trial in result.mutants if id_ in trial.result.turned]
        alone = sum(trial.result.turned == (id_,) for trial in turned)
        meant = [trial for trial in result.mutants if id_ in trial.expected]
        never = "DETECTED NOTHING" if id_ in result.never_turned else ""
        row = (len(turned), alone, len(meant), sum(id_ in trial.result.turned for trial in meant))
        table.add_row(id_, *(str(number or "") for number in row), never, style=_BAD if never else "")
    return table


def _near(near: Nearest) -> str:
    """Return how near the best wrong program comes by a criterion, in a line."""
    measure = Measure(near.name, near.unit)
    begin = f"{near.criterion}: {shown(near.name)} {shown(measure.written(near.reference))} for the reference"
    if near.wrong is None:
        return f"{begin}; no mistake loses points by it"
    kept = f"{shown(measure.written(near.wrong))} for the best mistake that it marks down, which keeps {near.share:.1%}"
    return f"{begin}, {kept} of the points: {shown(near.trial, limit=200)}"


def _table(first: str, *others: str) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold", show_edge=False)
    table.add_column(f"  {first}", no_wrap=True)
    for name in others:
        table.add_column(name, justify="right")
    return table


def _listed(console: Console, title: str, trials: Iterable[Trial], style: str) -> None:
    found = list(trials)
    if not found:
        return
    console.print()
    console.print(f"{title} ({len(found)})", style=style)
    for trial in found:
        _put(console, 2, shown(trial.id, limit=200), "bold" if style == _BAD else "")
        if not trial.because:
            _change(console, trial)
        if trial.because:
            _put(console, 4, f"because {shown(trial.because, limit=600)}")
        elif trial.fate is not Fate.SURVIVED:
            _reasons(console, trial.result)
        if trial.expected and not trial.as_expected:
            _put(console, 4, f"expected {' or '.join(trial.expected)}")


def _change(console: Console, trial: Trial) -> None:
    """Write the change as a diff, long ones in part; in one line if there is no diff."""
    lines = trial.diff.splitlines() or [trial.change]
    for line in lines[:_MOST_LINES]:
        style = _GOOD if line.startswith("+") else "red" if line.startswith("-") else _QUIET
        console.print(Padding(Text(shown(line, limit=400), style=style), (0, 0, 0, 4), expand=False))
    if len(lines) > _MOST_LINES:
        _put(console, 4, f"... and {len(lines) - _MOST_LINES} more lines", _QUIET)


def _reasons(console: Console, result: TrialResult) -> None:
    for id_, reason in result.reasons.items():
        if result.outcomes[id_] is not Outcome.BLOCKED:
            _put(console, 4, f"{id_}: {shown(reason, limit=300)}")


def _put(console: Console, indent: int, text: str, style: str = "") -> None:
    console.print(Padding(Text(text, style=style), (0, 0, 0, indent), expand=False))


def _score(result: TrialResult) -> str:
    return f"{_points(result.score)}/{_points(result.max_score)}"


def _points(points: Fraction) -> str:
    return f"{round(float(points), 3):g}"


def selftest_to_json(results: Sequence[SelftestResult]) -> str:
    """Render the results of rubrics as JSON, as described by selftest.schema.json."""
    data = {"schema": SCHEMA, "passed": all(r.passed for r in results), "rubrics": [_as_data(r) for r in results]}
    return json.dumps(data, indent=2, allow_nan=False) + "\n"


def _as_data(result: SelftestResult) -> JsonObject:
    return {
        "rubric": valid_unicode(result.rubric),
        "exercise": result.exercise,
        "passed": result.passed,
        "whole": result.whole,
        "reference": _result_data(result.reference),
        "template": None if result.template is None else _result_data(result.template),
        "template_expected": None if result.baseline is None else float(result.baseline),
        "criteria": [
            {"id": id_, "turned_by": sum(id_ in t.result.turned for t in result.mutants)} for id_ in result.criteria
        ],
        "never_turned": list(result.never_turned),
        "nearest": [
            {
                "criterion": near.criterion,
                "measured": valid_unicode(near.name),
                "unit": valid_unicode(near.unit),
                "reference": near.reference,
                "wrong": near.wrong,
                "share": near.share,
                "mutant": valid_unicode(near.trial),
            }
            for near in result.nearest
        ],
        "unturned_because": {id_: valid_unicode(because) for id_, because in result.unturned.items()},
        "mutants": [_trial_data(trial) for trial in result.mutants],
        "variants": [_trial_data(trial) for trial in result.variants],
        "idle": [valid_unicode(line) for line in result.idle],
        "recordings": result.recordings,
        "duration_s": round(result.duration_s, 3),
    }


def _trial_data(trial: Trial) -> JsonObject:
    return {
        "id": valid_unicode(trial.id),
        "file": valid_unicode(trial.file),
        "operator": trial.operator,
        "change": valid_unicode(trial.change),
        "diff": valid_unicode(trial.diff),
        "fate": trial.fate.value,
        "killed_by": list(trial.result.turned),
        "expected": list(trial.expected),
        "because": valid_unicode(trial.because),
        **_result_data(trial.result),
    }


def _result_data(result: TrialResult) -> JsonObject:
    return {
        "score": float(result.score),
        "max_score": float(result.max_score),
        "outcomes": {id_: outcome.value for id_, outcome in result.outcomes.items()},
        "reasons": {id_: valid_unicode(reason) for id_, reason in result.reasons.items()},
    }
