"""Grades a class from end to end, and compares its submissions if requested."""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from fractions import Fraction
from functools import partial
from pathlib import Path

import grader
from grader.course.class_page.class_links import with_class_links
from grader.course.class_page.contents import PageLink
from grader.course.classroom.adjustments import Adjustments, read_adjustments, with_criteria
from grader.course.classroom.class_page import RunOfClass, folder_spellings, links_between, title_of, without_folders
from grader.course.classroom.final_marks import MARK, dump_mark, kept_mark, shown_mark
from grader.course.classroom.gradebook import Gradebook, Row, Status, decisions_for, make_gradebook, points_text
from grader.course.classroom.grading import (
    ClassRequest,
    ClassRun,
    due_now,
    handed_in_digest,
    own_conditions,
    refuse_without_key,
    with_known_students,
)
from grader.course.classroom.intake import HandedInEntry, Intake, check_places, take_in
from grader.course.classroom.last_run import RUN, LastRun, dump_last_run, read_last_run
from grader.course.classroom.local import LocalScheduler, MakeScheduler
from grader.course.classroom.outputs import (
    CHANGES,
    CLASS,
    GRADEBOOK,
    Graded,
    class_files,
    exports,
    reveals,
    summary_json,
)
from grader.course.classroom.renaming import with_renamed_files
from grader.course.classroom.roster import RosterMatch, Table, match, read_roster
from grader.course.classroom.store import BEFORE, REPORT, SEED_KEY, Conditions, Store, open_store
from grader.course.classroom.watching import Watcher
from grader.course.classroom.worker import EVIDENCE, GRADESCOPE, HANDED_BACK, HANDED_BACK_PAGE, PAGE
from grader.course.similarity.finding import find_similar, read_compared
from grader.course.similarity.library import ComparedProgram, ComparedTopic, Handed, Similar
from grader.course.similarity.pages import MOST_PAGES, OVERVIEW, page_name, render_overview, render_pair, render_table
from grader.grading.app.bags import read_given, read_recordings, recordings_digest
from grader.grading.app.grade import read_exercises, wanted_files
from grader.grading.app.interfaces import rubric_folders
from grader.grading.app.request import GradeRequest
from grader.grading.app.seeds import kept_key
from grader.grading.evidence.store import open_evidence, run_of
from grader.grading.model.exercise import Exercise
from grader.grading.model.grading_options import GradingOptions, values
from grader.grading.reporting.escape import json_value
from grader.grading.reporting.html.final_mark import render_refusal, with_final_mark
from grader.grading.reporting.json_report import ReportData
from grader.grading.reporting.rejudged import ReportChange, change, render_changes_table
from grader.grading.rubrics.draws import First
from grader.runtime.interface_packages import offered_digest
from grader.runtime.model.errors import ClassError, EvidenceError, GraderError, HarnessError, SubmissionError
from grader.runtime.model.wording import printable
from grader.runtime.temp_dirs import scratch_folder

__all__ = [
    "ClassRequest",
    "Status",
    "compare_class",
    "conditions_of",
    "grade_class",
    "link_of_earlier_run",
]

SIMILARITY_FOLDER, SIMILARITY_TABLE = "similarity", "similarity.csv"
#: Adjustments in the results folder, which count where no others are named.
ADJUSTMENTS = "adjust.yaml"
_SIMILARITY_TITLE = "Similar submissions"


def grade_class(
    course: ClassRequest,
    watcher: Watcher,
    warn: Callable[[str], None],
    make_scheduler: MakeScheduler = LocalScheduler,
) -> Graded:
    """Grade a class, or resume grading it; raises a GraderError whose class tells who must act.

    Warnings for the instructor are passed to `warn` before grading begins. The scheduler is made for a number of
    parallel submissions.
    """
    exercises = read_exercises(replace(course.grading, draw=First()), course.sources)
    refuse_without_key(course, exercises)
    conditions = conditions_of(course.grading, exercises)
    roster = None if course.roster is None else read_roster(course.roster)
    check_places(course.sources, course.results)
    with open_store(course.results) as store:
        adjustments = _adjustments(course, exercises, warn)
        wanted = wanted_files(exercises)
        intake = take_in(course.sources, course.results, layout=course.layout, pattern=course.pattern, wanted=wanted)
        _warn_of_another_class(course, store, intake, warn)
        matching = match(intake.entries, roster)
        intake = replace(intake, entries=with_known_students(intake.entries, matching.people, exercises))
        own = own_conditions(course, intake.entries, matching.people, exercises, conditions)
        decisions = decisions_for(intake.entries, matching, adjustments)  # reports mistakes before hours of grading
        unpacked = course.results / "unpacked"
        intake = replace(intake, entries=with_renamed_files(intake.entries, decisions, unpacked, wanted))
        with scratch_folder() as scratch:
            read = {entry.name: _digest(entry, scratch, wanted) for entry in intake.entries}
        digests = {name: digest for name, (digest, _) in read.items()}
        refusals = {name: error for name, (_, error) in read.items() if error is not None}
        own = _seeded(own, digests, course)
        # If a digest is unknown, grading the submission in its own process will report why.
        keys = {name: own[name].key(digest) if digest else "" for name, digest in digests.items()}
        due = due_now(store, intake.entries, keys, course.rerun)
        run = ClassRun(course, exercises, own, store, watcher, refusals, digests).with_recordings(due)
        before = len(intake.entries) - len(due)
        watcher.begin(len(due), before, recorded=run.from_recordings)
        extra = sum((exercise.bonus for exercise in exercises), Fraction(0))
        book = partial(_book, store, intake, matching, adjustments, keys, extra, course.platforms.moodle)
        store.write(RUN, dump_last_run(_kept_options(course, adjustments)))
        began = time.monotonic()
        try:
            now = run.grade(due, warn, make_scheduler)
            made = Graded(book(), len(due), before, now, changes=_changes(store))
            graded = _compared(made, intake, course, store, exercises)
        except (KeyboardInterrupt, HarnessError):
            with suppress(GraderError):  # the error that stopped the run is more useful
                stopped = book()
                _write(class_files(stopped, {}, _run(course, conditions, began), standalone=course.standalone), store)
                _link_students(stopped, store)
                _hand_back(stopped, _run(course, conditions, began), store)
            raise
        return _written(graded, _run(course, conditions, began, graded), store, course)


def _adjustments(course: ClassRequest, exercises: Sequence[Exercise], warn: Callable[[str], None]) -> Adjustments:
    """Read the decisions that were named, or else those kept in the results folder, if any.

    Raises ClassError if the last run applied decisions and this one was given none: marks would change in silence.
    """
    kept = course.results / ADJUSTMENTS
    there = kept if kept.is_file() else None
    path = course.adjustments or there
    if path is None:
        for applied in read_last_run(course.results).options.get("adjust", ()):
            text = f"{course.results / RUN}: --adjust: expected {applied}, which the last run used, found nothing there"
            raise ClassError(text, "give it again with --adjust, or delete the line to leave it out")
        return Adjustments()
    if there is not None and path.resolve() != there.resolve():
        warn(f"{there} is not applied, because --adjust names {path}")
    points = {f"{e.id}/{criterion.id}": criterion.points for e in exercises for criterion in e.criteria}
    bonus = sum((e.bonus for e in exercises), Fraction(0))
    return with_criteria(read_adjustments(path), points, bonus=bonus, files=wanted_files(exercises))


def _kept_options(course: ClassRequest, adjustments: Adjustments) -> LastRun:
    """Return what the next run needs to know of this one."""
    applied = {} if adjustments.path is None else {"adjust": (str(adjustments.path.absolute()),)}
    return LastRun({**course.options, **applied}, _places(course.sources))


def _places(sources: Sequence[Path]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(str(source.resolve()) for source in sources))


def _warn_of_another_class(course: ClassRequest, store: Store, intake: Intake, warn: Callable[[str], None]) -> None:
    """Warn before the gradebook of other sources is replaced, of which no submission is in these."""
    last, results = read_last_run(course.results).sources, set(store.names())
    if last and results and not results & {entry.name for entry in intake.entries}:
        count = f"{len(results)} result{'' if len(results) == 1 else 's'}"
        where = ", ".join(printable(place, 200) for place in last)
        kept = f"{course.results} holds {count} of another class, of {where}"
        warn(f"{kept}: they stay, but gradebook and page show this class; name another folder with -o to keep both")


def conditions_of(grading: GradeRequest, exercises: Sequence[Exercise]) -> Conditions:
    """Collect what all results of a class depend on; raises RecordingError for an unusable recording."""
    return Conditions(
        grader=grader.__version__,
        rubrics=tuple((exercise.id, exercise.digest) for exercise in exercises),
        recording=recordings_digest(read_given(grading, read_recordings(grading, exercises))),
        options=GradingOptions(**values(grading)),
        interfaces=offered_digest(grading.interfaces, rubric_folders(exercises)),
    )


def _digest(entry: HandedInEntry, scratch: Path, wanted: Sequence[str]) -> tuple[str, SubmissionError | None]:
    with tempfile.TemporaryDirectory(dir=scratch) as folder:
        return handed_in_digest(entry, Path(folder), wanted)


def _seeded(own: Mapping[str, Conditions], digests: Mapping[str, str], course: ClassRequest) -> dict[str, Conditions]:
    """Add the seed of each submission to its conditions: the grading process gets the seed, never the key."""
    if course.grading.seed is not None:
        return dict(own)
    key = course.seed_key or kept_key(course.results / SEED_KEY)
    return {name: each.of_submission(key.seed(digests[name]), each.variants) for name, each in own.items()}


def _book(  # noqa: PLR0913  each comes from a different source
    store: Store,
    intake: Intake,
    matching: RosterMatch,
    adjustments: Adjustments,
    keys: Mapping[str, str],
    extra: Fraction,
    worksheet: Table | None,
) -> Gradebook:
    names = {entry.name for entry in intake.entries}
    return make_gradebook(
        intake,
        matching,
        adjustments,
        kept={name: store.kept(name) for name in names},
        keys=keys,
        report_of=lambda name: _report(store.place(name) / REPORT),
        handed_back_of=lambda name: _report(store.place(name) / HANDED_BACK),
        foreign=[name for name in store.names() if name not in names],
        extra=extra,
        worksheet=worksheet,
    )


def _compared(
    graded: Graded, intake: Intake, course: ClassRequest, store: Store, exercises: Sequence[Exercise]
) -> Graded:
    """Compare the submissions if requested, and add the result to the class."""
    if course.given is None:
        return replace(graded, links=link_of_earlier_run(store))
    found, files = compare_class(intake.entries, graded.book.rows, course.given, store, exercises)
    return replace(graded, links=(_link(found),), remarks=(f"similar submissions: {found}",), files=files)


def _run(course: ClassRequest, conditions: Conditions, began_s: float, graded: Graded | None = None) -> RunOfClass:
    """Describe this run; it counts as stopped if there is no result."""
    return RunOfClass(
        conditions=conditions,
        title=course.title.strip() or title_of(course.sources),
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        jobs=course.jobs or len(os.sched_getaffinity(0)),
        took_s=time.monotonic() - began_s,
        graded=0 if graded is None else graded.graded,
        kept=0 if graded is None else graded.kept_before,
        stopped=graded is None,
        folders=folder_spellings([*course.sources, course.results, Path.cwd(), Path(tempfile.gettempdir())]),
    )


def _written(graded: Graded, run: RunOfClass, store: Store, course: ClassRequest) -> Graded:
    """Write the files for the whole class, and return the class with the list of files."""
    wanted = course.platforms
    names = [row.name for row in graded.book.rows if row.report is not None] if wanted.gradescope else []
    results = {name: text for name in names if (text := _text(store.place(name) / GRADESCOPE))}
    made = exports(graded.book, wanted, results)
    left_out = {platform: export.left_out for platform, export in made.items() if export.left_out}
    remarks = (*graded.remarks, *(export.remark for export in made.values() if export.remark))
    remarks = (*remarks, *([reveals(graded.book)] if made and reveals(graded.book) else []))
    remarks = (*remarks, *_hand_back(graded.book, run, store))
    graded = replace(graded, left_out=left_out, remarks=remarks, moved=_moved(graded.book, store))
    files = class_files(graded.book, made, run, links=graded.links, standalone=course.standalone)
    if any(each.criteria for each in graded.changes):  # an empty record would replace that of a real change
        files = {CHANGES: render_changes_table(graded.changes).encode(), **files}
    written = _write({CLASS: summary_json(graded).encode(), **files}, store)
    _link_students(graded.book, store)
    store.forget_before()
    return replace(graded, files=(*graded.files, *written))


def _moved(book: Gradebook, store: Store) -> tuple[str, ...]:
    """Return the final marks that differ from those that the last run wrote, whatever changed them."""
    try:
        students = json.loads((store.folder / CLASS).read_bytes())["students"]
        before = {(each["name"], each["person"]): each["score"] for each in students}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return ()
    found = []
    for row in book.rows:
        person = None if row.person is None else json_value(row.person.name)
        old, new = before.get((row.name or None, person)), row.adjusted.score
        if old is not None and (new is None or json_value(new) != old):
            found.append(f"{row.distinct_name} {points_text(old)} -> {points_text(new) or 'no score'}")
    return tuple(found)


def _changes(store: Store) -> tuple[ReportChange, ...]:
    """Compare each submission that was graded again with its report from before."""
    found = []
    for name in store.names():
        before, after = _report(store.place(name) / BEFORE), _report(store.place(name) / REPORT)
        if before is not None and after is not None:
            with suppress(KeyError, TypeError, ValueError):  # a report that somebody edited
                found.append(change(name, before, after))
    return tuple(found)


def _write(files: Mapping[str, bytes], store: Store) -> tuple[Path, ...]:
    return tuple(store.write(name, data) for name, data in files.items())


def _link_students(book: Gradebook, store: Store) -> None:
    """Link each student's page for instructors to the class page and to its neighbours; feedback has no such links."""
    for name, links in links_between(book).items():
        page = _text(store.place(name) / PAGE)
        linked = with_class_links(page, links)
        if linked != page:
            store.write(f"students/{name}/{PAGE}", linked.encode())


def _hand_back(book: Gradebook, run: RunOfClass, store: Store) -> tuple[str, ...]:
    """Put name, final mark and decisions into everybody's page; who was refused gets a page that says why.

    Returns a remark for each submission whose files cannot be written because of what they hold: the others are.
    """
    remarks = []
    for row in book.rows:
        if not row.name:
            continue
        try:
            _hand_back_one(row, run, store)
        except (LookupError, TypeError, ValueError, RecursionError) as error:
            cause = f"{type(error).__name__}: {error}"
            remarks.append(f"the pages of {row.name} do not show the final mark, which is in {GRADEBOOK}: {cause}")
    return tuple(remarks)


def _hand_back_one(row: Row, run: RunOfClass, store: Store) -> None:
    mark = kept_mark(row)
    if row.status is Status.REFUSED:
        problem, hint = (without_folders(text, run.folders) for text in (row.refusal, row.hint))
        page = render_refusal(shown_mark(mark, None), problem, hint)
        store.write(f"students/{row.name}/{HANDED_BACK_PAGE}", page.encode())
    if row.report is None:
        return
    store.write(f"students/{row.name}/{MARK}", dump_mark(mark))
    for name, report in ((PAGE, row.report), (HANDED_BACK_PAGE, row.handed_back)):
        page = _text(store.place(row.name) / name)
        marked = page if report is None else with_final_mark(page, shown_mark(mark, report))
        if marked != page:
            store.write(f"students/{row.name}/{name}", marked.encode())


def _report(path: Path) -> ReportData | None:
    try:
        report: ReportData = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return report if isinstance(report, dict) and "exercises" in report else None


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ""


def compare_class(
    entries: Sequence[HandedInEntry],
    rows: Sequence[Row],
    given: Sequence[ComparedProgram],
    store: Store,
    exercises: Sequence[Exercise] = (),
) -> tuple[str, tuple[Path, ...]]:
    """Compare all submissions, write pages and a table, and return what was found and the files to open.

    The files handed out to everyone, `given`, are left out. Recordings that exercises ask for are compared by the
    evidence that was kept of them. Raises HarnessError if the pages cannot be written.
    """
    row_of = {row.name: row for row in rows}
    bags = [replace(e, scenarios=own) for e in exercises if (own := tuple(s for s in e.scenarios if s.handed_in))]
    handed = [
        replace(_handed(entry, row_of.get(entry.name)), recorded=_recorded(store.place(entry.name) / EVIDENCE, bags))
        for entry in entries
    ]
    similar = find_similar(_with_distinct_labels(handed), given)
    pages = [page_name(rank) for rank in range(min(MOST_PAGES, len(similar.pairs)))]
    for rank, name in enumerate(pages):
        store.write(f"{SIMILARITY_FOLDER}/{name}", render_pair(similar, rank).encode())
    table = store.write(SIMILARITY_TABLE, render_table(similar).encode())
    overview = store.write(f"{SIMILARITY_FOLDER}/{OVERVIEW}", render_overview(similar).encode())
    for old in (store.folder / SIMILARITY_FOLDER).glob("pair-*.html"):
        if old.name not in pages:
            old.unlink(missing_ok=True)
    return _counted(similar), (table, overview)


def link_of_earlier_run(store: Store) -> tuple[PageLink, ...]:
    """Return the link to the similarity page of an earlier run, if there is one."""
    return (_link("of an earlier run"),) if (store.folder / SIMILARITY_FOLDER / OVERVIEW).is_file() else ()


def _link(note: str) -> PageLink:
    return PageLink(_SIMILARITY_TITLE, f"{SIMILARITY_FOLDER}/{OVERVIEW}", note)


def _handed(entry: HandedInEntry, row: Row | None) -> Handed:
    programs, passed_over = ((), ()) if entry.problem else read_compared(entry.path)
    return Handed(
        name=entry.name,
        label=entry.label if row is None else row.shown_name,
        programs=programs,
        passed_over=("it cannot be used",) if entry.problem else passed_over,
        own=() if row is None else row.twin_of,
        reported=row is not None and row.report is not None,
    )


def _recorded(evidence: Path, exercises: Sequence[Exercise]) -> tuple[ComparedTopic, ...]:
    """Return what was judged of the recordings that one submission handed in; nothing without evidence of any."""
    if not exercises:
        return ()
    try:
        kept = open_evidence(evidence)
        held = [one for one in exercises if one.id in kept.exercises]
        traces = run_of(kept, held).traces.values() if held else ()
    except EvidenceError:
        return ()
    return tuple(
        ComparedTopic(trace.bag.file, topic, different, digest)
        for trace in traces
        if trace.bag is not None
        for topic, different, digest in trace.bag.contents
    )


def _with_distinct_labels(handed: Sequence[Handed]) -> list[Handed]:
    """Add the name of the submission to labels that occur more than once."""
    count = Counter(one.label for one in handed)
    return [replace(one, label=f"{one.label} ({one.name})") if count[one.label] > 1 else one for one in handed]


def _counted(similar: Similar) -> str:
    parts = [f"{len(similar.pairs)} pair{'' if len(similar.pairs) == 1 else 's'}"]
    for count, what in ((len(similar.same), "file"), (len(similar.messages), "recording")):
        parts += [f"{count} {what}{'' if count == 1 else 's'} handed in more than once"] if count else []
    return ", ".join(parts)
