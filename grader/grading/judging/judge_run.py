"""Judges a run: turns findings into verdicts and a report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, field, replace
from fractions import Fraction
from typing import TYPE_CHECKING

from grader.grading.judging.figures import excerpts_for, illustrated, on_recordings
from grader.grading.judging.findings import FAULT_KEY, SEND_LATER, fault_evidence
from grader.grading.judging.installs import notes_on_installing
from grader.grading.judging.run_check import Answer, check_name, run_check
from grader.grading.judging.simulations import unheard_by_simulations
from grader.grading.judging.values import HIDDEN_TOPICS, on_student_topic
from grader.grading.model.exercise import (
    Criterion,
    Exercise,
    Finding,
    Outcome,
    reads_packages,
    roles_of,
    texts_under,
    variant_notes,
)
from grader.grading.model.report import (
    AUTHOR_MISTAKE,
    NOT_JUDGED,
    SUBMISSION_SUSPECTED,
    ExerciseReport,
    Report,
    ReportedFault,
    Verdict,
)
from grader.grading.model.run import Run
from grader.grading.model.wording import first_few, quote
from grader.runtime.model.author_files import AuthorMistake
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.scenario import Scenario, is_launch_file
from grader.runtime.model.submission import EXPORT_NOTEBOOK, Submission, is_notebook
from grader.runtime.model.trace import AssessedTrace, ClockKind, Fault, GraphSnapshot, StartWay, Trace, same_node_name
from grader.runtime.model.wording import listed

if TYPE_CHECKING:  # only who lost points needs diagnosis, whose modules take a twentieth of a short `grade`
    from grader.grading.judging.diagnosis.rules import Case, Clue, Rule


@dataclass(frozen=True, slots=True)
class TriedRules:
    """A criterion that lost points, and every rule that explains it."""

    criterion: str  # as `exercise/criterion`
    verdict: Verdict  # without a cause
    clues: tuple[tuple[Rule, Clue], ...]  # in the order of the rules: reports show the first
    silent: tuple[Rule, ...]  # the exercise's own that were asked and return nothing


def judge_run(
    exercises: Sequence[Exercise], run: Run, *, pictures: bool = True, pending: Collection[str] = ()
) -> Report:
    """Return the report of a run; pure, so the same run and the same exercises give the same report.

    Args:
        exercises: The exercises, in the order of the report.
        run: The recordings.
        pictures: Whether to draw figures, which takes about as long as judging and only some formats show.
        pending: Ids of the exercises that are not yet recorded; the report is then partial.
    """
    asked = any(reads_packages(criterion.check) for exercise in exercises for criterion in exercise.criteria)
    return Report(
        name=run.submission.name,
        path=run.submission.path,
        digest=run.submission.digest,
        environment=run.environment,
        seed=run.seed,
        exercises=tuple(
            not_graded_yet(exercise) if exercise.id in pending else _exercise_report(exercise, run, pictures=pictures)
            for exercise in exercises
        ),
        duration_s=run.duration_s,
        notes=(*run.notes, *(() if asked else notes_on_installing(run.submission.packages))),
        staff_notes=tuple(note for note in run.notes if note not in run.submission.notes),
        reproduce=run.reproduce,
        pending=tuple(exercise.id for exercise in exercises if exercise.id in pending),
        interfaces=run.interfaces,
    )


def _exercise_report(exercise: Exercise, run: Run, *, pictures: bool) -> ExerciseReport:
    own = {scenario: trace for (owner, scenario), trace in run.traces.items() if owner == exercise.id}
    report = judge_exercise(exercise, own, run.submission, run.sources)
    if pictures:
        recorded = {scenario: trace.recorded for scenario, trace in own.items()}
        return illustrated(report, exercise, recorded, run.submission, run.sources)
    return replace(report, excerpts=excerpts_for(report, run.submission, run.sources))


def judge_exercise(
    exercise: Exercise,
    traces: Mapping[str, AssessedTrace],
    submission: Submission,
    sources: Mapping[str, str] | None = None,
) -> ExerciseReport:
    """Return the report of one exercise; pure.

    Args:
        exercise: The exercise.
        traces: Scenario id -> trace; scenarios with a missing file have none.
        submission: Tells which files were found, and similar names for missing ones.
        sources: Wanted file name -> its text, for finding the causes of lost points; None skips that.

    One cause costs one criterion: a criterion that fails because of a file, a fault or another criterion that was
    already reported is blocked, and loses no points of its own. If a check raises, or a recording failed, the criterion
    is undecided.
    """
    verdicts, facts = undiagnosed(exercise, traces, submission, sources)
    assessed = [(s.id, traces[s.id]) for s in exercise.scenarios if s.id in traces]
    recorded = [(id_, t.recorded) for id_, t in assessed]
    reasons = [t.clock_reason for _, t in assessed if t.clock is ClockKind.WALL and t.bag is None]
    mistakes: list[AuthorMistake] = []
    if sources is not None and any(v.outcome in (Outcome.NOT_MET, Outcome.PARTLY) for v in verdicts):
        from grader.grading.judging.diagnosis import cases_of, diagnose, rules_of  # noqa: PLC0415 - see above

        cases = cases_of(verdicts, on_recordings(exercise, verdicts), traces, submission, sources, facts)
        verdicts = diagnose(verdicts, cases, rules_of(exercise), mistakes) if any(cases) else verdicts
    notes = (f"the rubric has a mistake: {mistake}" for mistake in dict.fromkeys(mistakes))
    return replace(
        not_graded_yet(exercise),
        clock=ClockKind.WALL if reasons else ClockKind.VIRTUAL,
        clock_reason=next((r for r in reasons if r), ""),
        verdicts=verdicts,
        faults=_faults(recorded),
        notes=(
            *variant_notes(exercise.variant),
            *notes_on_bags(exercise, dict(recorded)),
            *_notes(recorded, submission, sources),
            *notes,
        ),
        graph=_graph(exercise, traces),
        starts=tuple(dict.fromkeys(start for _, t in recorded for start in t.starts)),
        unchecked=next((t.unchecked for _, t in assessed if t.unchecked), ""),
    )


def undiagnosed(
    exercise: Exercise, traces: Mapping[str, AssessedTrace], submission: Submission, sources: Mapping[str, str] | None
) -> tuple[tuple[Verdict, ...], Mapping[str, object]]:
    """Return the verdicts without causes, in rubric order, and what each criterion's check hands to hint rules."""
    answers: dict[str, Answer] = {c.id: run_check(c, exercise, traces, submission, sources) for c in exercise.criteria}
    facts = {id_: answer.finding.facts for id_, answer in answers.items() if answer.finding is not None}
    return VerdictBuilder(exercise, answers, submission).verdicts(), facts


def tried_rules(exercise: Exercise, run: Run, mistakes: list[AuthorMistake]) -> tuple[TriedRules, ...]:
    """Return every rule that applies to a recorded run of an exercise, by the criteria that lost points.

    Mistakes in the exercise's own rules are appended to `mistakes`.
    """
    from grader.grading.judging.diagnosis import cases_of, rules_of  # noqa: PLC0415 - see above

    traces = {scenario: trace for (owner, scenario), trace in run.traces.items() if owner == exercise.id}
    verdicts, facts = undiagnosed(exercise, traces, run.submission, run.sources)
    cases = cases_of(verdicts, on_recordings(exercise, verdicts), traces, run.submission, run.sources, facts)
    rules = rules_of(exercise) if any(cases) else ()
    return tuple(_tried(exercise, case, rules, mistakes) for case in cases if case is not None)


def _tried(exercise: Exercise, case: Case, rules: Sequence[Rule], mistakes: list[AuthorMistake]) -> TriedRules:
    from grader.grading.judging.diagnosis import clues_for  # noqa: PLC0415 - see above
    from grader.grading.judging.diagnosis.rules import is_asked  # noqa: PLC0415

    clues = tuple(clues_for(case, rules, mistakes))
    applied = [rule for rule, _ in clues]
    silent = tuple(rule for rule in rules if rule.file and is_asked(rule, case) and rule not in applied)
    return TriedRules(f"{exercise.id}/{case.criterion.id}", case.verdict, clues, silent)


def _notes(
    recorded: list[tuple[str, Trace]], submission: Submission, sources: Mapping[str, str] | None
) -> tuple[str, ...]:
    found = (
        note
        for _, t in recorded
        for note in (*unusual_starts(t), *same_names(t), *notes_on_unheard(t), *unheard_by_simulations(t), *t.notes)
    )
    notes = tuple(dict.fromkeys(found))
    if sources is None or not notes:
        return notes
    from grader.grading.judging.diagnosis import placed  # noqa: PLC0415 - see above

    return placed(notes, submission, sources)


def notes_on_bags(exercise: Exercise, traces: Mapping[str, Trace]) -> tuple[str, ...]:
    """Return a note for each recording that was handed in, with the criteria that rest on it."""
    found: dict[str, list[str]] = {}
    for criterion in exercise.criteria:
        trace = traces.get(criterion.scenario)
        if trace is not None and trace.bag is not None:
            found.setdefault(trace.bag.file, []).append(criterion.id)
    return tuple(
        f"{quote(file)}: recorded by the student, not observed: {listed(names, 'and')} "
        f"{'rests' if len(names) == 1 else 'rest'} on it"
        for file, names in found.items()
    )


def notes_on_unheard(trace: Trace) -> tuple[str, ...]:
    """Return notes on the topics whose first messages nobody would have heard outside, because they came too early."""
    early = Counter(m.topic for m in trace.messages() if m.before_discovery and m.topic not in HIDDEN_TOPICS)
    return tuple(_unheard(quote(topic), count, len(trace.messages(topic))) for topic, count in early.items())


def _unheard(topic: str, early: int, messages: int) -> str:
    which = ("all" if early > 1 else "the only") if early == messages else "the first"
    what, it = ("messages were", "them") if early > 1 else ("message was", "it")
    return (
        f"{topic}: {which} {what} published as soon as the publisher was created; on a real system no subscription "
        f"would have received {it}, because discovery takes a moment: {SEND_LATER}"
    )


def unusual_starts(trace: Trace) -> tuple[str, ...]:
    """Return the files that were not started as `python3 FILE` alone, and how they were started."""
    plain = [s.way is StartWay.SCRIPT and not s.arguments and not s.launched_by for s in trace.starts]
    return tuple(f"{s.file}: run {s.words}" for s, alone in zip(trace.starts, plain, strict=True) if not alone)


def same_names(trace: Trace) -> tuple[str, ...]:
    """Return a note for each name that nodes of several processes have at the same time."""
    found: dict[str, None] = {}
    for graph in trace.graphs():
        owners: dict[str, set[int]] = {}
        for end in filter(on_student_topic, graph.endpoints):
            owners.setdefault(end.node, set()).add(end.participant)
        found.update(dict.fromkeys(name for name, processes in owners.items() if len(processes) > 1))
    return tuple(same_node_name(quote(name)) for name in found)


#: Where the name of an action becomes that of its services, and the one of them that a client calls first.
_ACTION, _GOAL = "/_action/", "/_action/send_goal"
#: Prefixes of the types of services that every node has, which no graph lists.
_OF_EVERY_NODE = ("rcl_interfaces/", "type_description_interfaces/")


def unserved(trace: Trace, served: Iterable[str] = ()) -> tuple[str, ...]:
    """Return a note for each service and action of which a node has a client, and that nobody ever offers.

    Args:
        trace: The recording.
        served: The services that the grader offers.
    """
    graphs = trace.graphs()
    ends = dict.fromkeys(end for graph in graphs for end in graph.services)
    offered = {end.service for end in ends if end.kind == "service"} | {*served}
    nodes = {node for graph in graphs for node in graph.nodes}
    notes: dict[str, None] = {}
    for end in ends:
        of_node = end.type.startswith(_OF_EVERY_NODE) and end.service.rpartition("/")[0] in nodes
        if end.kind != "client" or end.service in offered or of_node:
            continue
        if end.service.endswith(_GOAL):
            name = end.service.removesuffix(_GOAL)
            notes[f"{quote(end.node)} waits for the action {quote(name)}, which nobody offers"] = None
        elif _ACTION not in end.service:
            notes[f"{quote(end.node)} waits for the service {quote(end.service)}, which nobody offers"] = None
    return tuple(notes)


def _faults(recorded: list[tuple[str, Trace]]) -> tuple[ReportedFault, ...]:
    """Return the faults of all scenarios, without duplicates."""
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
    """Return the graph with most edges, the last of equals, from the last scenario with all files."""
    whole = [s for s in exercise.scenarios if _runs_all(s, exercise) and s.id in traces and traces[s.id].bag is None]
    graphs = traces[whole[-1].id].graphs() if whole else ()
    return max(reversed(graphs), key=_edge_count, default=None)


def _runs_all(scenario: Scenario, exercise: Exercise) -> bool:
    """Return whether every program of an exercise runs in a scenario, as far as a launch file does not decide it."""
    programs = {n for n in exercise.files if is_launch_file(n) or not n.endswith((".yaml", ".yml"))}
    return programs == set(scenario.processes) or any(map(is_launch_file, scenario.processes))


def _edge_count(graph: GraphSnapshot) -> int:
    ends = [e for e in graph.endpoints if on_student_topic(e)]
    publishers = [e for e in ends if e.kind == "publisher"]
    subscriptions = [e for e in ends if e.kind == "subscription"]
    return sum((p.topic, p.type) == (s.topic, s.type) for p in publishers for s in subscriptions)


_EARNED = (Outcome.MET, Outcome.PARTLY)
_SAID = {Outcome.NOT_MET: "not met", Outcome.BLOCKED: "not judged", Outcome.UNDECIDED: "undecided"}


@dataclass(slots=True)
class VerdictBuilder:
    """Processes an exercise's findings in rubric order and remembers the causes already reported."""

    exercise: Exercise
    answers: Mapping[str, Answer]
    submission: Submission
    done: dict[str, Verdict] = field(default_factory=dict)
    missing_owner: dict[str, str] = field(default_factory=dict)
    fault_owner: dict[tuple[object, ...], str] = field(default_factory=dict)

    def verdicts(self) -> tuple[Verdict, ...]:
        """Return one verdict for each criterion, in rubric order."""
        for criterion in self.exercise.criteria:
            self.done[criterion.id] = self._verdict(criterion)
        return tuple(self.done[c.id] for c in self.exercise.criteria)

    def _verdict(self, criterion: Criterion) -> Verdict:
        return replace(self._judged(criterion), recording=self.answers[criterion.id].recording)

    def _judged(self, criterion: Criterion) -> Verdict:
        answer = self.answers[criterion.id]
        if answer.missing:
            return self._missing(criterion, answer.missing)
        needed = next((n for n in criterion.needs if self._outcome(n) not in _EARNED), None)
        known = answer.finding is not None
        # A criterion that could not be judged is blocked by what it needs, if the student has to fix that.
        if needed is not None and (known or self._outcome(needed) is not Outcome.UNDECIDED):
            return self._blocked(criterion, needed, self._outcome(needed))
        if answer.finding is None:
            evidence: dict[str, object] = {"error": answer.error} if answer.error else {}
            evidence |= {AUTHOR_MISTAKE: asdict(answer.mistake)} if answer.mistake is not None else {}
            evidence |= {FAULT_KEY: fault_evidence(answer.fault)} if answer.fault is not None else {}
            evidence |= {SUBMISSION_SUSPECTED: True} if answer.suspected else {}
            problem, hint = answer.problem, answer.hint
            return _without_points(criterion, Outcome.UNDECIDED, problem, hint=hint, evidence=evidence)
        return self._found(criterion, answer.finding)

    def _found(self, criterion: Criterion, finding: Finding) -> Verdict:
        if finding.credit > 0:
            return _earned(criterion, finding)
        blocker = self._blocker(criterion, finding)
        if blocker is not None:
            return self._blocked(criterion, blocker, self._outcome(blocker))
        cause = _fault_of(finding)
        owner = self.fault_owner.get(cause, "") if cause else ""
        if owner:
            return self._blocked(criterion, owner, Outcome.NOT_MET)
        if cause:
            self.fault_owner[cause] = criterion.id
        return _earned(criterion, finding)

    def _outcome(self, id_: str) -> Outcome:
        """Return the outcome of a criterion; if it is still ahead, the outcome of its own finding."""
        if id_ in self.done:
            return self.done[id_].outcome
        answer = self.answers.get(id_)
        if answer is None:
            return Outcome.MET
        if answer.finding is None:
            return Outcome.NOT_MET if answer.missing else Outcome.UNDECIDED
        return _outcome_of(answer.finding)

    def _blocker(self, criterion: Criterion, finding: Finding) -> str | None:
        """Return the criterion that a finding waits for, unless that is met, unknown, or waits for this one."""
        if finding.blocked_by is None:
            return None
        target = self._named(criterion, finding.blocked_by)
        if target is None or target.id == criterion.id or self._outcome(target.id) in _EARNED:
            return None
        theirs = self.answers[target.id].finding
        back = self._named(target, theirs.blocked_by) if theirs is not None and theirs.blocked_by else None
        ahead = target.id not in self.done
        return None if ahead and back is not None and back.id == criterion.id else target.id

    def _named(self, criterion: Criterion, name: str) -> Criterion | None:
        """Return the criterion with that id, else the first whose check has that name or judges the logs of that topic.

        The criterion's own scenario comes first, then those in which the same processes run.
        """
        criteria = self.exercise.criteria
        by_id = next((c for c in criteria if c.id == name), None)
        fitting = [c for c in criteria if name in (check_name(c), *texts_under(c.check, *roles_of(type(c.check)).logs))]
        same = [c for c in fitting if c.scenario == criterion.scenario]
        alike = [c for c in fitting if self._processes(c) == self._processes(criterion)]
        return by_id or next(iter([*same, *alike]), None)

    def _processes(self, criterion: Criterion) -> tuple[str, ...]:
        return next((s.processes for s in self.exercise.scenarios if s.id == criterion.scenario), ())

    def _blocked(self, criterion: Criterion, needed: str, outcome: Outcome) -> Verdict:
        reason = f"{NOT_JUDGED}needs {needed} ({_SAID.get(outcome, 'not met')})"
        kind = Outcome.UNDECIDED if outcome is Outcome.UNDECIDED else Outcome.BLOCKED
        return replace(_without_points(criterion, kind, reason), blocked_by=needed)

    def _missing(self, criterion: Criterion, files: tuple[str, ...]) -> Verdict:
        unnamed = next((f for f in files if f not in self.missing_owner), None)
        if unnamed is None:
            file = files[0]
            verdict = _without_points(criterion, Outcome.BLOCKED, f"{NOT_JUDGED}needs {file}, which is missing")
            return replace(verdict, blocked_by=self.missing_owner[file], missing_file=file)
        self.missing_owner[unnamed] = criterion.id
        looked_for = self.submission.files[unnamed]
        similar, others = looked_for.similar, looked_for.candidates
        hint = f"hand in a file named {unnamed}"
        evidence: dict[str, object] = {"missing": unnamed, "similar": list(similar)}
        if similar and is_notebook(similar[0]):
            hint = f"{quote(similar[0], 80)} is a notebook: {EXPORT_NOTEBOOK}, named {unnamed}"
        elif similar:
            hint = f"rename {quote(similar[0], 80)} to {unnamed}"
        elif looked_for.likely:
            hint = f"if {quote(others[0], 80)} is your solution, rename it to {unnamed}"
            evidence["likely"] = others[0]
        if "/" in unnamed:  # an executable
            hint = _how_to_install(unnamed, self.submission)
            evidence.pop("likely", None)
        hint = looked_for.hint or hint
        reason = f"{unnamed}: {looked_for.problem or 'not in the submission'}"
        found = () if looked_for.problem else (*similar, *others)
        reason += f"; found {first_few(found, len(found))}{' instead' if similar else ''}" if found else ""
        verdict = _without_points(criterion, Outcome.NOT_MET, reason, hint=hint, evidence=evidence)
        return replace(verdict, missing_file=unnamed)


def _how_to_install(executable: str, submission: Submission) -> str:
    """Return the hint on an executable that is not there, by how its package is built."""
    package, name = executable.split("/")
    here = [project for project in submission.projects if package in ("*", project.name)]
    by_cmake = bool(here) and all(project.by_cmake for project in here)
    if by_cmake or name.endswith(".py"):
        file = name if name.endswith(".py") else f"{name}.py"
        rename = "" if file == name else f" RENAME {name}"
        return f"add install(PROGRAMS scripts/{file} DESTINATION lib/${{PROJECT_NAME}}{rename}) to CMakeLists.txt"
    named = package.replace("*", "my_package")
    return f'add it to console_scripts in setup.py, such as "{name} = {named}.{name}:main"'


def _outcome_of(finding: Finding) -> Outcome:
    if finding.credit == 1:
        return Outcome.MET
    return Outcome.PARTLY if finding.credit > 0 else Outcome.NOT_MET


def _earned(criterion: Criterion, finding: Finding) -> Verdict:
    outcome = _outcome_of(finding)
    # a fault is its own cause: then the criterion's needs do not matter
    supposed = "" if FAULT_KEY in finding.evidence else criterion.hint
    hint = "" if outcome is Outcome.MET else finding.hint or supposed
    return Verdict(
        id=criterion.id,
        title=criterion.title,
        outcome=outcome,
        score=finding.credit * criterion.points,
        max_score=criterion.points,
        reason=finding.reason,
        hint=hint,
        location=finding.location,
        evidence=finding.evidence,
        problem=finding.problem,
        brief=finding.brief,
    )


def _without_points(
    criterion: Criterion, outcome: Outcome, reason: str, *, hint: str = "", evidence: Mapping[str, object] | None = None
) -> Verdict:
    known, none = evidence or {}, Fraction(0)
    return Verdict(criterion.id, criterion.title, outcome, none, criterion.points, reason, hint=hint, evidence=known)


def _fault_of(finding: Finding) -> tuple[object, ...] | None:
    """Return a key that identifies a fault across scenarios, or None if the finding rests on none."""
    fault = finding.evidence.get(FAULT_KEY)
    if not isinstance(fault, Mapping):
        return None
    return tuple(fault[key] for key in ("process", "kind", "text", "file", "line"))


def not_graded_yet(exercise: Exercise) -> ExerciseReport:
    """Return a report with every criterion undecided, so that no part of it looks like a result."""
    verdicts = (_without_points(c, Outcome.UNDECIDED, "not graded yet") for c in exercise.criteria)
    return ExerciseReport(
        id=exercise.id,
        number=exercise.number,
        title=exercise.title,
        required=exercise.required,
        clock=ClockKind.VIRTUAL,
        clock_reason="",
        verdicts=tuple(verdicts),
        feedback={c.id: c.feedback for c in exercise.criteria},
        situations={c.id: c.scenario for c in exercise.criteria},
        notes=variant_notes(exercise.variant),
        variant=exercise.variant,
    )
