"""What a rubric withholds from students is in no format that they read."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import fields, replace

import pytest
from places import ROOT
from report_samples import criterion, endpoint, exercise, hostile, report

from grader.grading.model.chart import Chart, Excerpt, GraphFigure, Panel, Series, Stage
from grader.grading.model.exercise import Audience, Feedback, Location, Outcome, Problem, ProblemKind, Shows
from grader.grading.model.report import ExerciseReport, Report, ReportedFault, Reproduction, Verdict
from grader.grading.reporting.audience import Readers, for_student, told, withholds
from grader.grading.reporting.formats import FORMATS, PageLayout, rendered
from grader.grading.reporting.platforms.classroom50 import COMMIT_DATETIME, VARIABLES
from grader.runtime.model.trace import ClockKind, GraphSnapshot

#: The formats that students read without a word, and those that instructors read, as a page tells both.
PUBLISHED = [
    set(re.findall("`(\\w+)`", cell)) - {"evidence"}
    for cell in re.findall(
        r"^\| read by students \| read by instructors \|\n\|---\|---\|\n\|(.*)\|(.*)\|$",
        (ROOT / "docs/how-to/feedback.md").read_text(encoding="utf-8"),
        re.MULTILINE,
    )[0]
]
LAYOUT = PageLayout(width=100, colour=False)
BEFORE, AFTER = "2026-12-01", "2026-12-02"
STUDENT, INSTRUCTOR = Readers(Audience.STUDENT, BEFORE), Readers(Audience.INSTRUCTOR, BEFORE)
#: Stands in every text of a report that some criterion keeps from students; 7357 is what a number may be known by.
NUMBER, SECRET = "7357", "hushhush"


def chart(id_: str, *criteria: str) -> Chart:
    points = ((0.0, 7357.0),)
    panel = Panel(f"{SECRET} panel", "Hz", (Series(f"{SECRET} series", points, texts=(SECRET,)),))
    return Chart(f"x-{id_}", f"{SECRET} chart", f"{SECRET} {NUMBER}", criteria, "time", "s", (panel,))


def fault(scenario: str, line: int) -> ReportedFault:
    text = f"ValueError: {NUMBER}" if scenario == "numbers" else f"ValueError: {SECRET} {NUMBER}"
    return ReportedFault("exception", "pump.py", line, text, 7_357_000_000, scenario, ("pump.py:9 in tick",))


def sample(shown: Shows = Shows.NOTHING, until: str = BEFORE, clock: ClockKind = ClockKind.WALL) -> Report:
    """Return a report with an open criterion, one without numbers, one of `shown`, and one that needs it."""
    graph = GraphSnapshot(0, (f"/{SECRET}", "/b"), (endpoint("publisher", f"/{SECRET}_{NUMBER}", f"/{SECRET}"),))
    words = f"/flow: average rate: {NUMBER}.25 Hz, expected {NUMBER} ± 1 Hz over 0.0 to {NUMBER} s"
    secret_id = f"{SECRET}_id" if shown is Shows.NOTHING else "closed"
    needs = {"reason": f"not judged: needs {secret_id} (not met)", "blocked_by": secret_id}
    told_all = {
        "reason": f"{SECRET}: {NUMBER} Hz",
        "hint": f"{SECRET} {NUMBER}",
        "location": Location(f"{SECRET}.py", 7357),
        "evidence": {SECRET: NUMBER, "rate_hz": 7357.5},
        "problem": Problem(ProblemKind.STOPPED, (f"/{SECRET}_{NUMBER}",), SECRET),
    }
    title = f"{SECRET} title" if shown is Shows.NOTHING else "Closed"
    return report(
        exercise(
            "pump",
            "1",
            "Pump",
            criterion("open", "Open", 6, Outcome.NOT_MET, reason="/flow: 4 Hz, expected 5 Hz", evidence={"rate_hz": 4}),
            criterion(
                "numbers",
                "Without numbers",
                10,
                Outcome.PARTLY,
                reason=words,
                hint=f"the period is 1/{NUMBER}; use a timer",
                location=Location("pump.py", 17),
                evidence={"rate_hz": 7357.25},
                problem=Problem(ProblemKind.STOPPED, (f"/{SECRET}_{NUMBER}",), SECRET),
            ),
            criterion(secret_id, title, 20, Outcome.NOT_MET, **told_all),
            criterion("needs", "Needs it", 4, Outcome.BLOCKED, **needs),
            faults=(fault("alone", 3), fault("numbers", 4), fault("nobody", 5)),
            notes=(f"{SECRET}: {NUMBER} messages",),
            clock=clock,
            clock_reason=f"{SECRET} used {NUMBER} ms",
            graph=graph,
            figures=(
                chart("closed", secret_id),
                chart("numbers", "numbers"),
                chart("both", "open", secret_id),
                chart("timeline"),
                GraphFigure("x-graph", SECRET, SECRET, ("open",), (Stage(SECRET, graph),)),
            ),
            excerpts=(Excerpt(f"{SECRET}.py", 7357, 7357, (SECRET,)), Excerpt("pump.py", 17, 17, (SECRET,))),
            expected={"numbers": f"{NUMBER} Hz", secret_id: f"{SECRET} {NUMBER}", "open": "5 Hz"},
            feedback={
                "numbers": Feedback(Shows.WITHOUT_NUMBERS, until),
                secret_id: Feedback(shown, until),
            },
            situations={"open": "free", "numbers": "numbers", secret_id: "alone", "needs": "free"},
        ),
        seed=7357,
        reproduce=Reproduction(("grade", SECRET, "--seed", NUMBER), (("pump", "sha256:" + NUMBER * 16),)),
    )


#: Fields of a report that tell nothing which a rubric could withhold; every other one has a secret in `sample`.
OPEN_FIELDS = {
    *(f"Report.{name}" for name in ("name", "path", "digest", "environment", "duration_s", "pending", "audience")),
    *(f"Report.{name}" for name in ("notes", "staff_notes", "interfaces")),
    *(f"ExerciseReport.{name}" for name in ("id", "number", "title", "required", "clock")),
    *(f"ExerciseReport.{name}" for name in ("sources", "variant", "starts", "unchecked")),
    *(f"Verdict.{name}" for name in ("outcome", "score", "max_score", "missing_file", "same_cause_as")),
    *("Verdict.brief", "Verdict.recording"),
}


def test_whoever_adds_a_field_decides_whether_it_is_withheld() -> None:
    """With a secret in `sample`, which `for_student` has to take out, or with a row in OPEN_FIELDS."""
    shown = sample()
    (part,) = shown.exercises
    secret, every = set[str](), set[str]()
    values: list[Report | ExerciseReport | Verdict] = [shown, part, *part.verdicts]
    for value in values:
        for one in fields(value):
            name, told = f"{type(value).__name__}.{one.name}", repr(getattr(value, one.name))
            every.add(name)
            secret |= {name} if SECRET in told or NUMBER in told else set()
    assert every - secret == OPEN_FIELDS


@pytest.fixture(autouse=True)
def classroom(monkeypatch: pytest.MonkeyPatch) -> None:
    """Classroom 50's variables, which its format needs."""
    values = dict.fromkeys(VARIABLES.values(), "x") | {"SUBMISSION_TAG": "submit/1", "ASSIGNMENT_TYPE": "group"}
    for name, value in {**values, COMMIT_DATETIME: "2026-01-31T10:00:00Z"}.items():
        monkeypatch.setenv(name, value)


def visible(name: str, text: str) -> str:
    """Return what a student sees of a rendered report."""
    if name == "classroom":
        return base64.b64decode(text).decode()
    if name == "gradescope":
        data = json.loads(text)
        data["tests"] = [test for test in data["tests"] if test["visibility"] == "visible"]
        del data["score"], data["extra_data"]  # the platform's own, and what no page shows
        return json.dumps(data)
    if name == "html":  # the library that draws has numbers of its own
        return text.split("<body>", 1)[1].split("<script>", 1)[0]
    return text


@pytest.mark.parametrize("shown", [Shows.OUTCOME, Shows.NOTHING])
@pytest.mark.parametrize("name", FORMATS)
def test_nothing_withheld_is_in_any_format(name: str, shown: Shows) -> None:
    """Neither words nor numbers: not in evidence, pictures, source, graph, faults, notes, or what repeats the run."""
    text = visible(name, rendered(name, sample(shown), LAYOUT, STUDENT))
    assert SECRET not in text
    assert NUMBER not in text
    assert "5 Hz" in text  # what is open is there


@pytest.mark.parametrize("name", FORMATS)
def test_an_instructor_sees_everything(name: str) -> None:
    """The very same report, if asked for in every format."""
    text = rendered(name, sample(), LAYOUT, INSTRUCTOR)
    assert text == FORMATS[name](sample(), LAYOUT)
    assert SECRET in (base64.b64decode(text).decode() if name == "classroom" else text)


@pytest.mark.parametrize("name", FORMATS)
def test_after_the_date_students_see_everything(name: str) -> None:
    """The day after, a report for students is the whole one, but for what only staff can use."""
    after = Readers(Audience.STUDENT, AFTER)
    assert rendered(name, sample(), LAYOUT, after) == FORMATS[name](
        replace(sample(), audience=Audience.STUDENT), LAYOUT
    )


def test_without_a_word_formats_for_platforms_are_for_students() -> None:
    """The person who runs the command reads the others."""
    found = {name: SECRET in visible(name, rendered(name, sample(), LAYOUT, Readers(None, BEFORE))) for name in FORMATS}
    assert sorted(name for name, there in found.items() if there) == sorted(PUBLISHED[1])
    assert sorted(name for name, there in found.items() if not there) == sorted(PUBLISHED[0])


def test_a_report_of_an_open_rubric_is_left_as_it_is() -> None:
    """Not even copied, so that nothing can differ."""
    whole = hostile()
    assert for_student(whole, BEFORE) is whole
    assert not withholds(whole, BEFORE)


def test_a_criterion_that_is_not_shown_counts_in_no_sum() -> None:
    """Else its outcome could be had by subtraction; how many points it has is no secret."""
    whole, seen = sample(), for_student(sample(), BEFORE)
    assert (whole.max_score, seen.max_score) == (40, 20)
    assert [v.id for v in seen.exercises[0].verdicts] == ["open", "numbers", "needs"]
    assert seen.exercises[0].notes[0] == "1 criterion with 20 points is not shown until 2026-12-01 has passed"
    waits = seen.exercises[0].verdicts[2]
    assert (waits.reason, waits.blocked_by) == ("not judged: needs a criterion that is not shown", "")


@pytest.mark.parametrize("shown", [Shows.ALL, Shows.WITHOUT_NUMBERS])
def test_a_criterion_that_is_not_shown_has_no_name_in_another(shown: Shows) -> None:
    """Neither where it explains a cause, nor where it names a file that both miss; the file may be named."""
    same = {"hint": f"this has the same cause as {SECRET}: fix that first", "same_cause_as": SECRET}
    missing = {"reason": "not judged: needs a.py, which is missing", "blocked_by": SECRET, "missing_file": "a.py"}
    whole = report(
        exercise(
            "pump",
            "1",
            "Pump",
            criterion(SECRET, "Closed", 4, Outcome.NOT_MET, reason="no"),
            criterion("same", "Same", 4, Outcome.NOT_MET, reason="no", **same),
            criterion("missing", "Missing", 4, Outcome.BLOCKED, **missing),
            feedback={SECRET: Feedback(Shows.NOTHING), "same": Feedback(shown), "missing": Feedback(shown)},
        )
    )
    seen = for_student(whole, BEFORE).exercises[0].verdicts
    assert SECRET not in repr(seen)
    assert seen[0].hint == "this has the same cause as a criterion that is not shown"
    assert seen[1].reason == missing["reason"]


def test_an_outcome_alone_has_its_points() -> None:
    """What is withheld is why."""
    seen = for_student(sample(Shows.OUTCOME), BEFORE)
    closed = seen.exercises[0].verdicts[2]
    assert (closed.outcome, closed.score, closed.max_score) == (Outcome.NOT_MET, 0, 20)
    assert (closed.reason, closed.hint, closed.location, closed.evidence) == ("the reason is not shown", "", None, {})
    assert seen.max_score == 40


def test_a_reason_without_numbers_still_says_what_is_wrong() -> None:
    """In a sentence of its own; hints with numbers go, the place in the student's own file stays."""
    numbers = for_student(sample(), BEFORE).exercises[0].verdicts[1]
    assert numbers.reason == "it stopped before the end"
    assert numbers.hint == "use a timer"
    assert (numbers.location, numbers.evidence) == (Location("pump.py", 17), {})


def test_faults_are_shown_as_openly_as_what_is_judged_on_their_scenario() -> None:
    """A fault's text may contain whatever the program received."""
    free = replace(fault("free", 8), text="ValueError: 12")
    whole = sample()
    whole = replace(whole, exercises=(replace(whole.exercises[0], faults=(*whole.exercises[0].faults, free)),))
    faults = for_student(whole, BEFORE).exercises[0].faults
    assert [(f.scenario, f.text, f.t_ns) for f in faults] == [
        ("numbers", "the message is not shown, because it holds numbers", 0),
        ("free", "ValueError: 12", 7_357_000_000),
    ]


def test_pictures_stay_where_nothing_of_their_scenario_is_withheld() -> None:
    """A chart of an open criterion on a scenario of its own shows nothing else."""
    own = chart("open", "open")
    whole = sample()
    whole = replace(whole, exercises=(replace(whole.exercises[0], figures=(*whole.exercises[0].figures, own)),))
    assert for_student(whole, BEFORE).exercises[0].figures == (own,)


def test_an_exercise_of_which_nothing_is_shown_is_gone() -> None:
    """A note mentions it; the report can still be written in every format."""
    whole = sample()
    closed = dict.fromkeys([v.id for v in whole.exercises[0].verdicts], Feedback(Shows.NOTHING))
    whole = replace(whole, exercises=(replace(whole.exercises[0], feedback=closed),), pending=("pump",))
    seen = for_student(whole, BEFORE)
    assert (seen.exercises, seen.pending) == ((), ())
    assert seen.notes == ("exercise 1 is not shown: 4 criteria with 40 points are not shown",)
    for name in FORMATS:
        assert SECRET not in visible(name, rendered(name, whole, LAYOUT, STUDENT))


@pytest.mark.parametrize(
    ("until", "visibility"),
    [("", "hidden"), ("2026-12-01", "hidden"), ("due_date", "after_due_date"), ("published", "after_published")],
)
def test_gradescope_hides_in_its_own_way(until: str, visibility: str) -> None:
    """A test that it shows later is whole; one that it never shows has no reason; the score counts all."""
    data = json.loads(rendered("gradescope", sample(until=until), LAYOUT, STUDENT))
    hidden = [test for test in data["tests"] if test["visibility"] != "visible"]
    assert [test["visibility"] for test in hidden] == [visibility]
    assert (SECRET in hidden[0]["output"]) is (visibility != "hidden")
    assert data["extra_data"]["max_score"] == 40
    assert [test["number"] for test in data["tests"]] == ["1.1", "1.2", "1.3", "1.4"]


def test_an_exit_code_tells_students_no_more_than_their_report() -> None:
    """With --audience student, other output is from the same report."""
    whole = sample()
    assert told(whole, Readers(None, BEFORE)) is whole
    assert told(whole, STUDENT) == for_student(whole, BEFORE)
