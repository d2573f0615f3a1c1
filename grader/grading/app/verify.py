"""Records submissions again, with everything changed, and under load, and compares, for `grade verify`."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import field, replace
from pathlib import Path
from typing import IO, Any

from grader.grading.app.grade import Progress, begun, read_exercises, wanted_files
from grader.grading.app.recorded_again import Recordings, WantedRecording
from grader.grading.app.request import GradeRequest, request_of, request_to_json
from grader.grading.app.seeds import VARIABLE
from grader.grading.evidence.store import Evidence, open_evidence, run_of
from grader.grading.judging.repetition import events, first_difference
from grader.grading.model.exercise import Exercise
from grader.grading.model.verification import ConditionState, Difference, LeftOutScenario, Place, Tried, Verification
from grader.grading.submissions.sources import read_texts
from grader.grading.submissions.submission import collect_submission, stage_collected
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EvidenceError, HarnessError
from grader.runtime.model.trace import AssessedTrace, ClockKind
from grader.runtime.model.wording import printable
from grader.runtime.recording.codec import to_json
from grader.runtime.recording.packed import trace_from_json

#: Exercise and scenario.
Key = tuple[str, str]
#: The conditions: nothing is changed, all that must not matter is, and the machine is busy; and kept evidence.
AGAIN, TOGETHER, LOAD, KEPT = "again", "together", "load", "kept"
#: A time zone with an odd offset, and a language of another encoding.
ELSEWHERE: Mapping[str, str] = {"TZ": "Asia/Kathmandu", "LANG": "de_DE.ISO-8859-1", "LC_ALL": "C"}
#: The hash seeds of the grader's own processes: the usual one, and another one.
HASH_SEEDS = ("1", "2")
#: The name of the temporary folder when everything is changed.
OTHER_FOLDER = "another temporary folder"
#: Busy loops for each processor under load: a node then gets a third of one.
LOOPS = 2
#: The program that records under a condition.
PROGRAM = (sys.executable, "-m", "grader.grading.app.recorded_again")
#: A loop that keeps a processor busy as long as the process lives that started it, whose pid is its argument.
LOOP = "import os, sys\nwhile os.getppid() == int(sys.argv[1]):\n    for _ in range(1_000_000): pass\n"
#: Why a recording is not compared in which a wait for the middleware has timed out twice.
LATE = "the machine was too busy: something that was sent or created did not become known in time"
#: How much of the output of a failed program is shown, in characters.
_MOST_CHARACTERS = 300


@dataclass(frozen=True, slots=True)
class VerifyCondition:
    """One condition, and how it is made."""

    name: str
    words: str  # what is different under it, as a phrase
    changed: bool = False  # whether all that must not matter is another: order, processors, place, hashes, start
    loops: int = 0  # busy loops beside it


#: The first recording, which the others are compared with.
FIRST = VerifyCondition("first", "as grading records")


def verify_conditions() -> tuple[VerifyCondition, ...]:
    """Return what is recorded after the first recording, in this order."""
    loops = LOOPS * len(os.sched_getaffinity(0))
    return (
        VerifyCondition(AGAIN, "again, with nothing changed"),
        VerifyCondition(
            TOGETHER, "in another order, on one processor, elsewhere, with other hashes, each executed", changed=True
        ),
        VerifyCondition(LOAD, f"beside {loops} busy loops", loops=loops),
    )


@dataclass(frozen=True, slots=True)
class VerifyRequest:
    """What to verify, and how."""

    submissions: tuple[str, ...]  # paths as the user typed them
    how: GradeRequest  # how to grade each; its submission, workers and recordings are not read
    evidence: Path | None = None  # kept evidence of the one submission, to compare with as well
    program: Sequence[str] = PROGRAM  # the command that records; see `grader.grading.app.recorded_again`


@dataclass(slots=True)
class _Subject:
    """One submission while it is verified."""

    name: str  # its path as the user typed it
    wanted: WantedRecording
    kept: Mapping[Key, AssessedTrace] = field(default_factory=dict)  # recordings that were kept as evidence
    sources: Mapping[str, str] = field(default_factory=dict)  # wanted file name -> its text
    first: dict[Key, _First] = field(default_factory=dict)
    problem: str = ""  # why it could not be recorded first

    @property
    def comparable(self) -> tuple[Key, ...]:
        """The scenarios of which another recording should be the same."""
        return tuple(key for key, each in self.first.items() if each.is_comparable)


@dataclass(frozen=True, slots=True)
class _First:
    """The first recording of a scenario; packed, because those of a class would take much memory."""

    packed: bytes
    events: int
    problem: str  # why it cannot be compared: the grader or the machine failed
    clock_reason: str  # why virtual time does not suit it

    @property
    def trace(self) -> AssessedTrace:
        """The recording."""
        return trace_from_json(json.loads(zlib.decompress(self.packed)))

    @property
    def is_comparable(self) -> bool:
        """Whether another recording of the scenario should be the same."""
        return not self.problem and not self.clock_reason


def verify(request: VerifyRequest, progress: Progress) -> Verification:
    """Record submissions under each condition and compare the recordings event by event.

    Raises:
        GraderError: A submission, rubric or evidence cannot be used, or the first recording failed.
    """
    with tempfile.TemporaryDirectory(prefix="grade-verify-") as name:
        folder = Path(name)
        folder.chmod(0o755)  # a sandbox's user reads the staged submissions
        progress("reading the submissions")
        evidence = None if request.evidence is None else open_evidence(request.evidence)
        subjects = [_subject(request, path, folder / str(n), evidence) for n, path in enumerate(request.submissions)]
        isolation = request.how.isolation if evidence is None else str(evidence.manifest.environment.isolation)
        progress(f"recording {FIRST.words}")
        isolation = _record_first(folder, subjects, isolation, request.program)
        first = [(Place(one.name, *key), each) for one in subjects for key, each in one.first.items()]
        tried = [] if evidence is None else [_compared_with_evidence(subjects)]
        wanted = verify_conditions()
        for number, condition in enumerate(wanted, 1):
            progress(f"recording {condition.words} ({number} of {len(wanted)})")
            tried.append(_tried(folder, subjects, condition, isolation, request.program))
        return Verification(
            submissions=tuple(one.name for one in subjects),
            seeds=tuple(one.wanted.seed for one in subjects),
            isolation=isolation,
            scenarios=len(first),
            events=sum(each.events for _, each in first if each.is_comparable),
            tried=tuple(tried),
            left_out=tuple(LeftOutScenario(place, each.clock_reason) for place, each in first if each.clock_reason),
            problems=(
                *(f"{one.name}: {one.problem}" for one in subjects if one.problem),
                *(f"{place.submission}, {place.scenario}: {each.problem}" for place, each in first if each.problem),
            ),
        )


def _subject(request: VerifyRequest, path: str, into: Path, evidence: Evidence | None) -> _Subject:
    """Read a submission, and stage it in a folder that every user can read."""
    how = replace(request.how, submission=path)
    if evidence is not None:
        run = evidence.manifest.run
        how = request_of(dict(run.request), submission=path, seed=run.seed, rubrics=how.rubrics)
    every = not how.exercises
    others = [Path(one) for one in request.submissions]
    exercises: Sequence[Exercise] = read_exercises(replace(how, every=every), others)
    files = wanted_files(exercises)
    into.mkdir(mode=0o755)
    submission = stage_collected(collect_submission(path, files, into), path, files, into)
    if every:
        exercises, submission = begun(exercises, submission)
    if evidence is not None and evidence.manifest.submission.digest != submission.digest:
        where = printable(str(evidence.folder), 500)
        text = f"{where}: expected evidence of {printable(path, 500)}, found that of other files"
        raise EvidenceError(text, "name the submission as it was graded, or other evidence")
    seed = how.seed_key.seed(submission.digest) if how.seed is None else how.seed
    asked = replace(
        how,
        exercises=tuple(exercise.id for exercise in exercises),
        bags=tuple((name, path.absolute()) for name, path in how.bags),
        interfaces=tuple(folder.absolute() for folder in how.interfaces),
    )
    given = json.dumps(request_to_json(asked, exercises))
    wanted = WantedRecording(str(into), seed, given, tuple(str(rubric.absolute()) for rubric in how.rubrics))
    kept = run_of(evidence, exercises, verify=True).traces if evidence is not None else {}
    return _Subject(path, wanted, kept)


def _record_first(folder: Path, subjects: Sequence[_Subject], isolation: str, program: Sequence[str]) -> str:
    """Make the first recording of each submission, and return the sandbox; raises GraderError if none was made."""
    used = isolation
    for line in _recorded(folder, subjects, FIRST, isolation, program):
        if "number" not in line:
            if "problem" in line:
                raise HarnessError(str(line["problem"]), str(line["hint"]))
            used = str(line["isolation"])
            continue
        one = subjects[line["number"]]
        if "trace" in line:
            trace = trace_from_json(line["trace"])
            packed = zlib.compress(json.dumps(line["trace"]).encode(), 1)
            problem = "" if trace.clock_reason else trace.harness_problem or _missing(trace)
            one.first[_key(line)] = _First(packed, len(events(trace)), problem, trace.clock_reason)
        elif "sources" in line:
            one.sources = read_texts(line["sources"])
        else:
            one.problem = str(line["problem"])
    return used


def _key(line: Mapping[str, Any]) -> Key:
    return str(line["exercise"]), str(line["scenario"])


def _compared_with_evidence(subjects: Sequence[_Subject]) -> Tried:
    """Compare the first recording of the submission with what was kept of one, perhaps on another machine."""
    counted = _Counted(KEPT, "as the kept evidence has it")
    for one in subjects:
        for key, kept in one.kept.items():
            first = one.first.get(key)
            if first is None or not first.is_comparable or kept.harness_problem or kept.clock is ClockKind.WALL:
                continue
            # Suspicions are not kept.
            counted.add(Place(one.name, *key), first_difference(kept, replace(first.trace, reached=()), one.sources))
    return counted.tried()


def _tried(
    folder: Path, subjects: Sequence[_Subject], condition: VerifyCondition, isolation: str, program: Sequence[str]
) -> Tried:
    """Record under a condition and compare with the first recordings."""
    counted = _Counted(condition.name, condition.words)
    comparable = [one for one in subjects if one.comparable]
    if not comparable:
        return counted.tried()
    again = [replace(one, wanted=replace(one.wanted, scenarios=one.comparable)) for one in comparable]
    for line in _recorded(folder, again, condition, isolation, program):
        if "problem" in line:
            counted.problem = counted.problem or str(line["problem"])
        elif "trace" in line:
            one = again[line["number"]]
            trace = trace_from_json(line["trace"])
            failed = "" if trace.clock_reason else trace.harness_problem or _missing(trace)
            if failed:
                counted.problem = counted.problem or failed
                continue
            found = first_difference(one.first[_key(line)].trace, trace, one.sources)
            counted.add(Place(one.name, *_key(line)), found)
    missed = sum(len(one.comparable) for one in comparable) - counted.compared
    if missed and not counted.problem:
        counted.problem = f"{missed} scenarios were not recorded"
    return counted.tried()


def _missing(trace: AssessedTrace) -> str:
    """Return that a recording lacks something because the machine was too busy, even in the second attempt."""
    return LATE if trace.incomplete else ""


@dataclass(slots=True)
class _Counted:
    """What comparing under one condition has found so far."""

    name: str
    words: str
    problem: str = ""
    compared: int = 0
    different: list[tuple[Place, Difference]] = field(default_factory=list)

    def add(self, place: Place, difference: Difference | None) -> None:
        """Count a scenario that was compared."""
        self.compared += 1
        if difference is not None:
            self.different.append((place, difference))

    def tried(self) -> Tried:
        """Return the result."""
        state = (
            ConditionState.DIFFERENT
            if self.different
            else ConditionState.FAILED
            if self.problem
            else ConditionState.SAME
        )
        if state is ConditionState.SAME and not self.compared:
            state = ConditionState.NOT_TRIED
            self.problem = "there is nothing to compare"
        return Tried(self.name, self.words, state, self.problem, self.compared, tuple(self.different))


def _recorded(
    folder: Path,
    subjects: Sequence[_Subject],
    condition: VerifyCondition,
    isolation: str,
    command: Sequence[str],
) -> Iterator[Mapping[str, Any]]:
    """Record submissions under a condition with a command, and yield its lines; see `VerifyRequest.program`.

    If it ends without a word, there is a line with the problem.
    """
    recordings = Recordings(
        wanted=tuple(one.wanted for one in subjects),
        isolation=isolation,
        changed=condition.changed,
    )
    variables = {name: value for name, value in os.environ.items() if name != VARIABLE}
    variables["PYTHONHASHSEED"] = HASH_SEEDS[condition.changed]
    with ExitStack() as stack:
        if condition.changed:
            own = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="condition-", dir=folder)))
            own.chmod(0o755)
            (own / OTHER_FOLDER).mkdir()
            variables |= {**ELSEWHERE, "TMPDIR": str(own / OTHER_FOLDER)}
        stack.enter_context(_busy(condition.loops))
        said = stack.enter_context(tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace"))
        program = stack.enter_context(_started(command, variables, said))
        assert program.stdin is not None
        assert program.stdout is not None
        with suppress(BrokenPipeError), program.stdin as told:  # if it has ended, its exit code says so
            json.dump(to_json(recordings), told)
        for line in program.stdout:
            yield json.loads(line)
        if program.wait() != 0:
            said.seek(0)
            words = said.read().strip().splitlines()
            last = printable(words[-1], _MOST_CHARACTERS) if words else f"exit code {program.returncode}"
            yield {"problem": f"recording ended early: {last}", "hint": ""}


@contextmanager
def _started(command: Sequence[str], variables: Mapping[str, str], said: IO[str]) -> Iterator[subprocess.Popen[str]]:
    """Start the program that records, and end it with the block."""
    program = subprocess.Popen(
        command,
        env=dict(variables),
        cwd="/",  # the current folder may hold modules of a student
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=said,
        encoding="utf-8",
    )
    try:
        yield program
    finally:
        program.kill()
        program.wait()
        for stream in (program.stdin, program.stdout):
            if stream is not None:
                stream.close()


@contextmanager
def _busy(loops: int) -> Iterator[None]:
    """Keep so many processes in busy loops during the block; they end with this process, however it ends."""
    processes = [subprocess.Popen([sys.executable, "-I", "-S", "-c", LOOP, str(os.getpid())]) for _ in range(loops)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()
