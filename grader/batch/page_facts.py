"""The facts of a run over a class, in words for the page of the class."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import PurePath
from typing import Any

from grader.batch.classbook import Classbook, Status
from grader.batch.facts import RunOfClass
from grader.batch.watching import clock_time
from grader.reports.class_page.contents import RunFacts

_MIB = 1 << 20


def run_facts(book: Classbook, run: RunOfClass) -> RunFacts:
    """Return what the header of the page says.

    Args:
        book: The class.
        run: The run that writes the page.
    """
    reports = [row.report for row in book.rows if row.report is not None]
    counts = [f"{book.count(status)} {status.value}" for status in Status if book.count(status)]
    now = "" if run.stopped else f"graded now: {run.graded}, done before: {run.kept}"
    parts = [", ".join(counts), now, f"took {clock_time(run.took_s)}", run.written]
    line = "; ".join(part for part in parts if part)
    return RunFacts(line, tuple(_rows(book, run, reports)), tuple(_warnings(run, reports)))


def _rows(book: Classbook, run: RunOfClass, reports: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    conditions = run.conditions
    seed = conditions.seed
    yield "grader", _counted(_versions(report) for report in reports) or conditions.grader
    yield "rubrics", ", ".join(f"{id_} {digest}" for id_, digest in conditions.rubrics)
    if conditions.recording:
        yield "recording", conditions.recording
    yield "clock", _clock(conditions.clock, reports)
    yield "isolation", f"asked for: {conditions.isolation}; {_counted(_isolation(r) for r in reports) or 'nothing ran'}"
    yield "seed", f"{seed} for everybody" if seed is not None else "follows from the seed key and the files handed in"
    yield "jobs", str(run.jobs)
    yield "cost", _cost(book)
    yield "sources", ", ".join(f"{PurePath(source).name or source} ({layout})" for source, layout in book.layouts)


def _warnings(run: RunOfClass, reports: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    if run.stopped:
        yield "This run was stopped before everybody was graded; the same command goes on where it was."
    bare = sum(_isolation(report).startswith("none") for report in reports)
    if bare:
        yield f"No sandbox: {bare} of {len(reports)} submissions ran without walls around them."


def _versions(report: Mapping[str, Any]) -> str:
    made = report.get("environment", {})
    names = ("grader", "rclpy", "ros_distro", "rmw", "python")
    return ", ".join(f"{name} {made[name]}" for name in names if made.get(name))


def _isolation(report: Mapping[str, Any]) -> str:
    return str(report.get("environment", {}).get("isolation", ""))


def _clock(asked: str, reports: Sequence[Mapping[str, Any]]) -> str:
    walls = sum(any(e.get("clock") == "wall" for e in report["exercises"]) for report in reports)
    return f"asked for: {asked}; on the wall clock in part or whole: {walls} of {len(reports)}"


def _cost(book: Classbook) -> str:
    used = [row.standing for row in book.rows if row.standing is not None]
    processor = sum(standing.usage.get("processor_s", 0.0) for standing in used)
    peak = max((standing.usage.get("peak_bytes", 0.0) for standing in used), default=0.0)
    return f"{processor:.1f} s of processor time in all, at most {peak / _MIB:.0f} MiB in one process"


def _counted(texts: Iterable[str]) -> str:
    """Return the different texts; where there are several, with how many have each."""
    counts = Counter(text for text in texts if text)
    if len(counts) <= 1:
        return next(iter(counts), "")
    return "; ".join(f"{text} ({count})" for text, count in sorted(counts.items()))
