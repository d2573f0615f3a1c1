"""A class of any size, taken in, stored and written as `grade batch` does it; only what grades it is made up."""

from __future__ import annotations

import random
import tempfile
from collections.abc import Generator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import class_reports
from class_samples import course

from grader.course.classroom.class_run import grade_class
from grader.course.classroom.local import Attempt, OnStep, Task
from grader.course.classroom.store import ResultStatus, State
from grader.course.classroom.watching import Watcher
from grader.grading.reporting.html.render import render_html
from grader.grading.reporting.json_report import dumps
from grader.grading.submissions.submission import stage_submission

FIRST = ("Ada", "Bogdan", "Chiara", "Dmitri", "Élodie", "Fatima", "Giang", "Hyun", "Ines", "Jakob", "Kwame", "Łukasz",
         "Mariam", "Noor", "Øyvind", "Priya", "Quentin", "Rania", "Søren", "Tomás")  # fmt: skip
LAST = ("Abe", "Berg", "Costa", "Dahl", "Endo", "Fischer", "Grau", "Haddad", "Ivanov", "Jansen", "Kaya", "Lima",
        "Moreau", "Novák", "Okafor", "Petrov", "Quispe", "Rossi", "Sato", "Tanaka")  # fmt: skip
HOSTILE = (
    "<script>document.title='owned'</script>",
    "<img src=x onerror=document.title='owned'>",
    "javascript:document.title='owned'",
    "..%2f..%2fetc",
    "evil\u202edrowssap\u202c",
    "two\nlines",
    "long" * 50,
    "مريم الحسن",
    "' onclick='document.title=1' x='",
    "{{ 7*7 }}#x?y&z=%00",
)
REFUSED, FAILED = 41, 77


class MadeUp:
    """Gives every submission a drawn report; one is refused, at one the grader fails."""

    def __init__(self) -> None:
        self.numbers: dict[str, int] = {}

    def __call__(self, jobs: int) -> MadeUp:
        return self

    def prepare(self, isolation: str) -> list[str]:
        return []

    def run(self, tasks: Sequence[Task], on_step: OnStep) -> Generator[Attempt, None, None]:
        for number, task in enumerate(tasks):
            yield Attempt(task, self.status(task, number))

    def status(self, task: Task, number: int) -> ResultStatus:
        with tempfile.TemporaryDirectory() as staged:
            digest = stage_submission(str(task.submission), (), Path(staged)).digest
        key = task.conditions.key(digest)
        if number == FAILED:
            return ResultStatus(State.FAILED, "", "", task.label, f"{task.submission}: the worker ended (signal 9)")
        if number == REFUSED:
            problem = f"{task.submission}: expected a Python file, found none"
            return ResultStatus(State.REFUSED, key, digest, task.label, problem, "hand in a .py file")
        report = replace(class_reports.drawn_report(number, task.label), digest=digest)
        task.into.mkdir()
        (task.into / "report.json").write_text(dumps(report), encoding="utf-8")
        for name in ("report.html", "feedback.html"):
            (task.into / name).write_text(render_html(report, assets="../../assets"), encoding="utf-8")
        state = State.GRADED if report.final else State.UNDECIDED
        usage = {"processor_s": 2.5, "peak_bytes": 90 << 20}
        score, most = float(report.score), float(report.max_score)
        return ResultStatus(state, key, digest, task.label, score=score, max_score=most, usage=usage)


def names(count: int) -> list[str]:
    """Return so many names of students, the hostile ones among them."""
    draw = random.Random(5)
    pairs = [f"{first} {last}" for first in FIRST for last in LAST]
    more = [f"{pair} {k}" for k in range(2, 2 + count // len(pairs)) for pair in pairs]
    return [*draw.sample([*pairs, *more], count - len(HOSTILE)), *HOSTILE]


def make_class(folder: Path, count: int, **changes: Any) -> Path:
    """Grade a class of so many; return the folder with its results."""
    for name in names(count):
        (folder / "homework" / name[:120]).mkdir(parents=True)
        (folder / "homework" / name[:120] / "velocity_publisher.py").write_text("pass\n", encoding="utf-8")
    called = names(count)
    late = "\n".join(f"  {name}: {{days_late: {k % 3 + 1}}}" for k, name in enumerate(called[10:30]))
    decided = f"  {called[31]}: {{score: 80, reason: the lab machine was down}}\n  {called[32]}: {{ignore: a test}}\n"
    adjustments = folder / "late.yaml"
    adjustments.write_text(f"late:\n  per_day: 10 %\nstudents:\n{late}\n{decided}", encoding="utf-8")
    rows = "".join(f"{name},user{k},user{k}@example.org\n" for k, name in enumerate(called[5 : count - 10]))
    roster = folder / "roster.csv"
    roster.write_text(f"name,username,email\n{rows}Zoë Missing,zm,zm@example.org\n", encoding="utf-8")
    grading = course(folder / "homework", folder / "results", roster=roster, adjustments=adjustments, **changes)
    wanted = replace(grading, grading=replace(grading.grading, exercises=()))
    grade_class(wanted, Watcher(lambda line: None), lambda line: None, MadeUp())
    return folder / "results"
