"""Words that all formats share: outcomes, points, places, faults, and warnings that belong to the score."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from fractions import Fraction
from math import floor

from grader.grading.model.exercise import Audience, Outcome, exercise_name
from grader.grading.model.report import NOT_JUDGED, ExerciseReport, Report, ReportedFault, Verdict
from grader.grading.reporting.escape import shell_quoted, shown
from grader.runtime.model.checkup import NO_SANDBOX, summarised
from grader.runtime.model.quantities import seconds
from grader.runtime.model.trace import ClockKind

#: More faults or notes than this are counted, not shown.
MOST_FAULTS = 10
MOST_NOTES = 20
#: Longest name of a submission, a scenario or a node that is shown, in characters.
NAME_LIMIT = 100
# No path is longer; cutting a word would change the command.
_WORD_LIMIT = 20_000
_DIGEST_LENGTH = len("sha256:") + 12
#: Words state the outcome, so that nothing is lost without colour.
OUTCOME_WORDS = {
    Outcome.MET: "met",
    Outcome.PARTLY: "partly",
    Outcome.NOT_MET: "not met",
    Outcome.BLOCKED: "blocked",
    Outcome.UNDECIDED: "undecided",
}
_LOST = (Outcome.NOT_MET, Outcome.PARTLY)
_WHAT_HAPPENED = {
    "syntax_error": "could not be compiled",
    "exception": "raised an exception",
    "exited": "ended by itself",
    "hung": "did not return",
    "killed": "was ended",
}
# The first frames show where the failure began, the last where it ended; deep recursion repeats in between.
_FIRST_FRAMES, _LAST_FRAMES = 3, 5


def points(value: Fraction) -> str:
    """Return points with at most two decimals, and none if they are zero."""
    return f"{float(value):.2f}".rstrip("0").rstrip(".")


def headline(report: Report) -> str:
    """Return the submission's name and the score; safe to show as a line of text."""
    return f"{shown(report.name, limit=NAME_LIMIT)}: {score_line(report)}"


def score_line(report: Report) -> str:
    """Return the score, e.g. `87.5 of 100 points`."""
    return f"{points(report.score)} of {points(report.max_score)} points"


def exercise_line(exercise: ExerciseReport) -> str:
    """Return number, title and score of an exercise; safe to show as a line of text."""
    number, title = (shown(text, limit=NAME_LIMIT) for text in (exercise.number, exercise.title))
    score = f"{points(exercise.score)} of {points(exercise.max_score)} points"
    return f"{exercise_name(number)}: {title} ({score}{'' if exercise.required else ', optional'})"


def warnings(report: Report) -> list[str]:
    """Return warnings that belong to the score: the report is partial or not final, or there was no sandbox."""
    lines = [_partial(report)] if report.pending else []
    judged = [verdict for e in report.exercises if e.id not in report.pending for verdict in e.verdicts]
    undecided = [verdict for verdict in judged if verdict.outcome is Outcome.UNDECIDED]
    causes = {verdict.id: _author_mistake(verdict, judged) for verdict in undecided}
    lines += [
        _rubric_wrong(mistake, [verdict for verdict in undecided if causes[verdict.id] == mistake])
        for mistake in dict.fromkeys(filter(None, causes.values()))
    ]
    others = [verdict for verdict in undecided if not causes[verdict.id]]
    lines += [_not_final(others)] if others else []
    return lines + [_unchecked(why) for why in dict.fromkeys(e.unchecked for e in report.exercises) if why]


def author_mistakes(report: Report) -> list[str]:
    """Return the mistakes of the rubrics' authors that leave criteria undecided, each once, with its place."""
    found = (verdict.author_mistake for exercise in report.exercises for verdict in exercise.verdicts)
    return list(dict.fromkeys(filter(None, found)))


def summary(report: Report) -> str:
    """Return how many criteria have each outcome."""
    return summary_of([verdict.outcome for e in report.exercises for verdict in e.verdicts], final=report.final)


def summary_of(outcomes: Sequence[Outcome], *, final: bool) -> str:
    """Return how many criteria have each outcome, given the outcome of each, as a sentence."""
    return f"{'Final' if final else 'So far'}: {outcome_counts(outcomes)}."


def outcome_counts(outcomes: Sequence[Outcome]) -> str:
    """Return how many criteria have each outcome, as a phrase."""
    counts = Counter(outcomes)
    parts = [f"{counts[outcome]} {word}" for outcome, word in OUTCOME_WORDS.items() if counts[outcome]]
    return ", ".join([f"{counts[Outcome.MET]} of {len(outcomes)} criteria met", *parts[bool(counts[Outcome.MET]) :]])


def first_to_fix(report: Report) -> tuple[ExerciseReport, Verdict] | None:
    """Return the criterion that a student should look at first: one on a file that exists, or that has another name.

    An exercise that nothing was handed in for comes first only if there is no other.
    """
    begun = [e for e in report.exercises if not all(map(_is_absent, e.verdicts))] or report.exercises
    lost = [(e, v) for e in begun for v in e.verdicts if v.outcome in _LOST and not v.same_cause_as]
    return next((found for found in lost if not _is_absent(found[1])), lost[0] if lost else None)


def _is_absent(verdict: Verdict) -> bool:
    """Return whether a verdict says only that a file is missing, and no other may be meant."""
    known = verdict.evidence
    return bool(verdict.missing_file) and not (known.get("similar") or known.get("likely"))


def reason(verdict: Verdict) -> str:
    """Return a verdict's reason; for a blocked criterion, only what it needs. Not yet safe to show."""
    return verdict.reason.removeprefix(NOT_JUDGED) if verdict.outcome is Outcome.BLOCKED else verdict.reason


def explanation(verdict: Verdict) -> list[str]:
    """Return the reason, the hint and the place of a verdict; each safe to show as a line of text."""
    lines = [shown(reason(verdict))]
    if verdict.hint:
        lines.append(f"hint: {shown(verdict.hint)}")
    if verdict.location is not None:
        where = place(verdict.location.file, verdict.location.line)
        lines += [f"at {where}"] if where not in lines[0] else []
    return lines


def opening(report: Report) -> list[str]:
    """Return the lines before the criteria; each safe to show as a line of text."""
    blocked = any(v.outcome is Outcome.BLOCKED for e in report.exercises for v in e.verdicts)
    return [
        headline(report),
        *warnings(report),
        summary(report),
        *(["Blocked criteria are judged once the criteria that they need are met."] if blocked else []),
        *notes(report),
    ]


def notes(report: Report) -> list[str]:
    """Return the notes on the whole run that its reader needs; each safe to show as a line of text."""
    return _capped([f"note: {shown(note)}" for note in relevant_notes(report)], MOST_NOTES, "notes")


def relevant_notes(report: Report) -> list[str]:
    """Return the notes on the whole run, for students without those for staff. Not yet safe to show."""
    left_out = report.staff_notes if report.audience is Audience.STUDENT else ()
    return [note for note in report.notes if note not in left_out]


def remarks(exercise: ExerciseReport) -> list[str]:
    """Return faults, clock and notes of an exercise; each safe to show as a line of text."""
    faults = [f"fault: {happened(fault)}: {shown(fault.text)}" for fault in exercise.faults]
    notes = [f"note: {shown(note)}" for note in exercise.notes]
    clock_note = f"note: judged on the wall clock: {shown(exercise.clock_reason)}"
    return [
        *_capped(faults, MOST_FAULTS, "faults"),
        *([clock_note] if exercise.clock is ClockKind.WALL else []),
        *_capped(notes, MOST_NOTES, "notes"),
    ]


def ending_lines(report: Report) -> list[str]:
    """Return the lines that help to reproduce the report, the command last; each safe to show as a line of text."""
    rows = [f"{name}: {value}" for name, value in reproduction_lines(report)]
    words = reproducing_command(report)
    return [*rows, f"reproduce: {' '.join(words)}"] if words else rows


def overview(report: Report) -> list[str]:
    """Return the whole report but its criteria, for a platform that shows these as tests."""
    lines = [*opening(report), *([] if report.audience is Audience.STUDENT else [run_line(report)])]
    for exercise in report.exercises:
        found = remarks(exercise)
        lines += ["", exercise_line(exercise), *found] if found else []
    return [*lines, "", *ending_lines(report)]


def _capped(lines: list[str], most: int, what: str) -> list[str]:
    left_out = len(lines) - most
    return [*lines[:most], f"and {left_out} more {what}; all are in the JSON report"] if left_out > 0 else lines


def place(file: str, line: int) -> str:
    """Return a place in the form that terminals make clickable; safe to show as a line of text."""
    return f"{shown(file)}:{line}" if line else shown(file)


def happened(fault: ReportedFault) -> str:
    """Return kind, place and time of a fault, without its text; safe to show as a line of text."""
    what = _WHAT_HAPPENED.get(fault.kind, shown(fault.kind))
    when = f" at t = {seconds(fault.t_ns):.3f} s" if fault.t_ns else ""
    where = place(fault.file, fault.line) or "the node"
    return f"{where} {what}{when} (scenario {shown(fault.scenario, limit=NAME_LIMIT)})"


def frames(all_frames: Sequence[str]) -> list[str]:
    """Return the frames worth reading, each safe to show as a line of text."""
    left_out = len(all_frames) - _FIRST_FRAMES - _LAST_FRAMES
    if left_out <= 1:
        return [shown(frame) for frame in all_frames]
    first, last = all_frames[:_FIRST_FRAMES], all_frames[-_LAST_FRAMES:]
    return [*map(shown, first), f"({left_out} more calls)", *map(shown, last)]


def versions(report: Report) -> str:
    """Return the versions that made the report."""
    made_with = report.environment
    return (
        f"grader {made_with.grader}, rclpy {made_with.rclpy} ({made_with.ros_distro}), "
        f"{made_with.rmw}, Python {made_with.python}"
    )


def clock(report: Report) -> str:
    """Return which clock the nodes ran on."""
    on_wall = [exercise.number for exercise in report.exercises if exercise.clock is ClockKind.WALL]
    if not on_wall:
        return "virtual"
    first = exercise_name(on_wall[0]).replace("Exercise", "exercise", 1)
    return f"virtual, but the wall clock in {', '.join([first, *on_wall[1:]])}"


def isolation(report: Report) -> str:
    """Return how the student's code was isolated, in capitals if it was not."""
    return summarised(report.environment.isolation, report.environment.containment)


def ran_without_sandbox(report: Report) -> bool:
    """Return whether the student's code ran without a sandbox."""
    return report.environment.isolation == NO_SANDBOX


def run_line(report: Report) -> str:
    """Return the path and the duration: the only line that differs between two runs."""
    return f"graded {shown(report.path)} in {report.duration_s:.1f} s"


def starts(report: Report) -> list[str]:
    """Return how each file was started; each safe to show as a line of text."""
    found = dict.fromkeys(start for exercise in report.exercises for start in exercise.starts)
    return [shown(f"{start.process}: run {start.words}", limit=_WORD_LIMIT) for start in found]


def reproduction_lines(report: Report) -> list[tuple[str, str]]:
    """Return names and values that reproduce the report, except the command; safe to show as lines of text.

    Students get the seed and the clock: the rest helps whoever runs the grader.
    """
    seed = [] if report.seed is None else [("seed", str(report.seed))]
    if report.audience is Audience.STUDENT:
        return [*seed, ("clock", clock(report))]
    rows = [*seed, ("versions", versions(report)), ("isolation", isolation(report)), ("clock", clock(report))]
    if report.reproduce.rubrics:
        rows.append(("rubrics", ", ".join(f"{id_} {_short(digest)}" for id_, digest in report.reproduce.rubrics)))
    if report.reproduce.recording:
        rows.append(("recording", _short(report.reproduce.recording)))
    return [(name, shown(value, limit=_WORD_LIMIT)) for name, value in rows]


def reproducing_command(report: Report) -> list[str]:
    """Return the command that reproduces the report, quoted for a shell and safe to show as text; none for students.

    Join the pieces with spaces; an option and its value are one piece.
    """
    pieces: list[str] = []
    if report.audience is Audience.STUDENT:
        return pieces
    for word in report.reproduce.command:
        text = shown(shell_quoted(word), limit=_WORD_LIMIT)
        if pieces and pieces[-1].startswith("--") and " " not in pieces[-1]:
            pieces[-1] += f" {text}"
        else:
            pieces.append(text)
    return pieces


def _short(digest: str) -> str:
    """Return the part of a digest that tells files apart; the JSON report has all of it."""
    return digest[:_DIGEST_LENGTH]


def _partial(report: Report) -> str:
    open_ones = [e for e in report.exercises if e.id in report.pending]
    numbers = ", ".join(shown(e.number, limit=NAME_LIMIT) for e in open_ones)
    rest = points(sum((e.max_score for e in open_ones), Fraction(0)))
    several = "exercises" if len(open_ones) > 1 else "exercise"
    return f"This report is partial: it was made before {several} {numbers} ({rest} points) had been graded."


def _not_final(undecided: Sequence[Verdict]) -> str:
    criteria, open_points = _open(undecided)
    suspected = [verdict for verdict in undecided if verdict.suspected]
    if suspected:
        some = "" if len(suspected) == len(undecided) else "some of them "
        return (
            f"This score is not final: {criteria} undecided, {some}perhaps because of what the submission does; "
            f"{open_points} points are still open. The reasons say more."
        )
    return (
        f"This score is not final: {criteria} undecided through no fault of the student, "
        f"{open_points} points are still open. Grade again."
    )


def _unchecked(why: str) -> str:
    return f"This score is not final: {shown(why)}. Grade again."


def _rubric_wrong(mistake: str, undecided: Sequence[Verdict]) -> str:
    criteria, open_points = _open(undecided)
    return (
        f"This score is not final: the rubric has a mistake, {shown(mistake)}. Because of it, {criteria} undecided and "
        f"{open_points} points are still open."
    )


def _open(undecided: Sequence[Verdict]) -> tuple[str, str]:
    """Return how many criteria are undecided, as the beginning of a clause, and how many points they have."""
    count = len(undecided)
    open_points = points(sum((v.max_score for v in undecided), Fraction(0)))
    return "1 criterion is" if count == 1 else f"{count} criteria are", open_points


def _author_mistake(verdict: Verdict, judged: Sequence[Verdict]) -> str:
    """Return the mistake that leaves a criterion undecided, also through one that it needs; empty if none does."""
    seen: set[str] = set()
    while not verdict.author_mistake and verdict.blocked_by not in {"", *seen}:
        seen.add(verdict.blocked_by)
        verdict = next((one for one in judged if one.id == verdict.blocked_by), verdict)
    return verdict.author_mistake


def whole_points(scores: Sequence[Fraction], max_scores: Sequence[Fraction]) -> list[tuple[int, int]]:
    """Return whole-number score and maximum of each row, by the largest remainder method.

    The totals are the exact ones rounded half up, and the rows add up to them. No row earns more than its maximum, and
    only a score without any loss becomes the full one.
    """
    tops = largest_remainder(max_scores, _rounded(sum(max_scores, Fraction(0))), [floor(m) + 1 for m in max_scores])
    exact = sum(scores, Fraction(0))
    total = min(_rounded(exact), sum(tops))
    if exact < sum(max_scores):
        total = min(total, max(sum(tops) - 1, 0))
    earned = largest_remainder(scores, total, tops)
    return list(zip(earned, tops, strict=True))


def largest_remainder(shares: Sequence[Fraction], total: int, most: Sequence[int]) -> list[int]:
    """Return whole numbers close to `shares`, at least 0 and at most `most`, that add up to `total`.

    Each share is rounded down, and the missing points go to the largest remainders, the first of equal ones first. If
    the rounded shares exceed the total, which is at most the sum of `most`, the smallest remainders lose points.
    """
    found = [min(floor(share), top) for share, top in zip(shares, most, strict=True)]
    by_remainder = sorted(range(len(found)), key=lambda row: (found[row] - shares[row], row))
    while sum(found) < total:
        row = next(row for row in by_remainder if found[row] < most[row])
        found[row] += 1
        by_remainder.remove(row)
        by_remainder.append(row)
    for row in reversed(by_remainder):
        if sum(found) > total and found[row] > 0:
            found[row] -= 1
    return found


def _rounded(value: Fraction) -> int:
    return floor(value + Fraction(1, 2))
