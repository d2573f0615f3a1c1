"""Judges one exercise: asks every check, lets causes block what depends on them, and adds up what is known."""

from __future__ import annotations

from collections.abc import Mapping

from grader.core.exercise import Exercise, variant_notes
from grader.core.report import ExerciseReport, ReportedFault, Verdict
from grader.core.submission import Submission
from grader.core.trace import ClockKind, Fault, GraphSnapshot, StartWay, Trace
from grader.judging.asking import Answer, ask
from grader.judging.diagnosis.diagnose import diagnose
from grader.judging.diagnosis.notes import placed
from grader.judging.silence import on_student_topic
from grader.judging.verdicts import Bench


def judge_exercise(
    exercise: Exercise,
    traces: Mapping[str, Trace],
    submission: Submission,
    sources: Mapping[str, str] | None = None,
) -> ExerciseReport:
    """Return the report of one exercise; pure.

    Args:
        exercise: What is asked.
        traces: Scenario id -> what was recorded; scenarios with a missing file have none.
        submission: Says which files were found, and what was found instead.
        sources: Wanted file name -> its text, to find the causes of lost points in; None leaves them unexplained.

    One cause costs one criterion: a criterion that fails for a file, a fault or another criterion that has been named
    before is blocked by it, not lost once more. A check that raises, and a recording that failed, leave a criterion
    undecided.
    """
    answers: dict[str, Answer] = {c.id: ask(c, exercise, traces, submission, sources) for c in exercise.criteria}
    bench = Bench(exercise, answers, submission)
    recorded = [(s.id, traces[s.id]) for s in exercise.scenarios if s.id in traces]
    reasons = [t.clock_reason for _, t in recorded if t.clock is ClockKind.WALL]
    return ExerciseReport(
        id=exercise.id,
        number=exercise.number,
        title=exercise.title,
        required=exercise.required,
        clock=ClockKind.WALL if reasons else ClockKind.VIRTUAL,
        clock_reason=next((r for r in reasons if r), ""),
        verdicts=_explained(bench.verdicts(), exercise, traces, submission, sources),
        faults=_faults(recorded),
        notes=(*variant_notes(exercise.variant), *_notes(recorded, submission, sources)),
        graph=_graph(exercise, traces),
        feedback={c.id: c.feedback for c in exercise.criteria},
        situations={c.id: c.scenario for c in exercise.criteria},
        variant=exercise.variant,
        starts=tuple(dict.fromkeys(start for _, t in recorded for start in t.starts)),
    )


def _explained(
    verdicts: tuple[Verdict, ...],
    exercise: Exercise,
    traces: Mapping[str, Trace],
    submission: Submission,
    sources: Mapping[str, str] | None,
) -> tuple[Verdict, ...]:
    return verdicts if sources is None else diagnose(verdicts, exercise, traces, submission, sources)


def _notes(
    recorded: list[tuple[str, Trace]], submission: Submission, sources: Mapping[str, str] | None
) -> tuple[str, ...]:
    said = (note for _, t in recorded for note in (*started(t), *t.notes))
    notes = tuple(dict.fromkeys(said))
    return notes if sources is None else placed(notes, submission, sources)


def started(trace: Trace) -> tuple[str, ...]:
    """Return which files were started in another way than `python3 FILE`, and in which."""
    return tuple(f"{s.file}: run {s.words}" for s in trace.starts if s.way is not StartWay.SCRIPT)


def _faults(recorded: list[tuple[str, Trace]]) -> tuple[ReportedFault, ...]:
    """Return the faults of all scenarios; the same one in several scenarios once."""
    first: dict[tuple[str, str, str, int, str], tuple[str, Fault]] = {}
    for scenario, trace in recorded:
        for fault in trace.faults():
            key = (fault.process, fault.kind.value, fault.file, fault.line, fault.text)
            first.setdefault(key, (scenario, fault))
    return tuple(
        ReportedFault(f.kind.value, f.file or f.process, f.line, f.text, f.t_ns, scenario, f.frames)
        for scenario, f in first.values()
    )


def _graph(exercise: Exercise, traces: Mapping[str, Trace]) -> GraphSnapshot | None:
    """Return the fullest graph, the last of equals, of the last scenario in which all files ran."""
    whole = [s for s in exercise.scenarios if set(s.processes) == set(exercise.files) and s.id in traces]
    graphs = traces[whole[-1].id].graphs() if whole else ()
    return max(reversed(graphs), key=_edge_count, default=None)


def _edge_count(graph: GraphSnapshot) -> int:
    ends = [e for e in graph.endpoints if on_student_topic(e)]
    publishers = [e for e in ends if e.kind == "publisher"]
    subscriptions = [e for e in ends if e.kind == "subscription"]
    return sum((p.topic, p.type) == (s.topic, s.type) for p in publishers for s in subscriptions)
