"""Runs the tests of rubrics on submissions: pytest in a process of the grader's, programs in the sandbox of a worker.

The process of pytest is trusted, as the author's checks are, and runs beside the supervisor. It has no worker of its
own: each command of a test passes through the supervisor to a worker of the recording session. The supervisor reads
from the answers what was observed, and makes the trace. What the test finds is sent as a value, and is part of it.
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import Any, TypeVar

from grader.runtime.model.author_files import AuthorMistake
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EnvironmentFault, HarnessError
from grader.runtime.model.extras import pip_install
from grader.runtime.model.quantities import NS_PER_S, duration
from grader.runtime.model.scenario import RubricTest
from grader.runtime.model.trace import AssessedTrace, ClockKind, Observation, Tested
from grader.runtime.plan import Plan
from grader.runtime.recording.codec import from_json, to_json
from grader.runtime.shipped import PACKAGE
from grader.runtime.supervisor.real_time_budget import RealTimeBudget
from grader.runtime.supervisor.supervisor import TRIES, Recorder, WorkerLostError, WorkerProcess

Key = TypeVar("Key", bound=Hashable)
#: The module that runs pytest; it is started, and never imported here.
MODULE = "grader.world.graded"
#: Tells code in the process of pytest that it is one: its programs run nowhere but in the worker of the supervisor.
VARIABLE = "GRADER_RUBRIC_TESTS"
#: Real seconds in which pytest has to have collected the tests; it takes about one.
COLLECT_S = 60.0
#: The real time of a scenario is what the code of a test may take; the test as a whole may take so many times as long,
#: because its programs have limits of their own, which they reach late on a busy machine. The monitor of the worker
#: waits longer still: it would take the end of the time for the programs' fault.
WHOLE, BEYOND = 4, 8


@dataclass(frozen=True, slots=True)
class TestJob:
    """A test to run on a submission.

    Attributes:
        title: For progress messages.
        plan: Limits, clock, seed and folder of the programs; the processes are up to the test.
        test: The test.
        seed: What the test draws from.
        files: Name, file in the submission and entry point of each program that was handed in.
        missing: Names of programs that were not.
        known: As for a launch file: the name of each program by its file.
        provided: Name and text of the rubric's own files.
        paths: Folders of modules that the test may import, besides those that are installed.
    """

    __test__ = False  # no class of tests

    title: str
    plan: Plan
    test: RubricTest
    seed: int
    files: tuple[tuple[str, str, str], ...] = ()
    missing: tuple[str, ...] = ()
    known: tuple[tuple[str, str], ...] = ()
    provided: tuple[tuple[str, str], ...] = ()
    paths: tuple[str, ...] = ()


def record_tests(
    recorder: Recorder,
    jobs: Mapping[Key, TestJob],
    progress: Callable[[str], None],
    budget: RealTimeBudget | None = None,
) -> dict[Key, AssessedTrace]:
    """Run tests and return their traces, in the same order; tests of the same file share a process of pytest.

    Raises:
        EnvironmentFault: pytest is not installed.
    """
    if jobs:
        _ask_for_pytest()
    budget = budget or RealTimeBudget()
    found: dict[Key, AssessedTrace] = {}
    groups: dict[tuple[RubricTest, Plan], dict[str, Key]] = {}
    for key, job in jobs.items():
        shared = replace(job.plan, scenario="", host_seed="", hash_seed=0, duration_ns=0)
        groups.setdefault((replace(job.test, name=""), shared), {})[job.test.name] = key
    for keys in groups.values():
        found |= _record_file(recorder, {key: jobs[key] for key in keys.values()}, progress, budget)
    return {key: found[key] for key in jobs}


def _ask_for_pytest() -> None:
    if importlib.util.find_spec("pytest") is None:
        hint = f"{pip_install('tests')}, or pip install pytest"
        raise EnvironmentFault("the rubric has tests for pytest, which is not installed", hint)


def collected_tests(test: RubricTest, paths: Sequence[str] = ()) -> tuple[list[str], AuthorMistake | None]:
    """Return the tests that pytest collects from a file, and the mistake that keeps it from doing so, if any.

    Raises:
        EnvironmentFault: pytest is not installed.
    """
    _ask_for_pytest()
    with _Process(test, paths) as process:
        return process.collected()


def _mistake_in(line: Mapping[str, Any], test: RubricTest) -> AuthorMistake | None:
    told = line.get("mistake")
    return (
        None
        if told is None
        else AuthorMistake(str(told.get("file") or test.file), int(told["line"]), str(told["text"]))
    )


def _ended(test: RubricTest, what: str) -> AuthorMistake:
    return AuthorMistake(test.file, 0, f"the process of pytest ended before {test.name} was {what}")


def _record_file(
    recorder: Recorder, jobs: Mapping[Key, TestJob], progress: Callable[[str], None], budget: RealTimeBudget
) -> dict[Key, AssessedTrace]:
    """Run the tests of one file; those that are left when a process of pytest ends are run in another one."""
    found: dict[Key, AssessedTrace] = {}
    tries: dict[Key, int] = {}
    while waiting := {key: job for key, job in jobs.items() if key not in found}:
        if not budget.left_ns:
            found |= {key: budget.unrecorded(job.plan) for key, job in waiting.items()}
            break
        before = len(found)
        for key, trace, again in _round(recorder, waiting, progress, budget):
            tries[key] = tries.get(key, 0) + 1
            if not (again and tries[key] < TRIES):
                found[key] = trace
        if len(found) == before and not any(tries.get(key) for key in waiting):
            mistakes = {key: _ended(job.test, "run") for key, job in waiting.items()}
            found |= {key: _without_run(waiting[key], mistake) for key, mistake in mistakes.items()}
    return found


def _without_run(job: TestJob, mistake: AuthorMistake) -> AssessedTrace:
    return AssessedTrace(job.plan.scenario, ClockKind.VIRTUAL, stop_ns=0, observations=(), author_mistake=mistake)


def _round(
    recorder: Recorder, jobs: Mapping[Key, TestJob], progress: Callable[[str], None], budget: RealTimeBudget
) -> Iterator[tuple[Key, AssessedTrace, bool]]:
    """Yield the traces of tests, until the process of pytest ends, each with whether it is worth another try."""
    keys = {job.test.name: key for key, job in jobs.items()}
    some = next(iter(jobs.values()))
    with _Process(some.test, some.paths) as process:
        collected, mistake = process.collected()
        if mistake is not None:
            yield from ((key, _without_run(job, mistake), False) for key, job in jobs.items())
            return
        there = {name: key for name, key in keys.items() if name in collected}
        for name in keys.keys() - there.keys():
            missed = AuthorMistake(some.test.file, 0, f"pytest does not collect {name}")
            yield keys[name], _without_run(jobs[keys[name]], missed), False
        process.tell({"tests": {name: to_json(jobs[key]) for name, key in there.items()}})
        while True:
            try:
                line = process.hear(COLLECT_S)
            except TimeoutError:
                return
            if line is None:
                return
            key = there[line["begin"]]
            progress(jobs[key].title)
            run = _TestRun(recorder, process, jobs[key], budget)
            trace = run.trace()
            yield key, trace, run.is_worth_another
            if run.has_ended_process:
                return


@dataclass(slots=True)
class _TestRun:
    """One test while it runs."""

    recorder: Recorder
    process: _Process
    job: TestJob
    budget: RealTimeBudget
    observations: list[Observation] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    now_ns: int = 0
    unsuitable: str = ""
    worker: WorkerProcess | None = None
    problem: str = ""
    over: threading.Event = field(default_factory=threading.Event)
    is_worth_another: bool = False
    has_ended_process: bool = False

    def trace(self) -> AssessedTrace:
        """Pass on commands until the test has ended, and return what was recorded."""
        began_ns = time.monotonic_ns()
        own_s = self.job.plan.limits.wall_ns / NS_PER_S
        timer = threading.Timer(min(WHOLE * own_s, self.budget.left_ns / NS_PER_S), self._end_at_once)
        timer.daemon = True
        timer.start()
        try:
            end = self._until_end(own_s)
        except TimeoutError:
            self._end_at_once()
            end = None
        finally:
            timer.cancel()
            self._give_back(usable=False)
        self.budget.charge(time.monotonic_ns() - began_ns, 0)
        trace = AssessedTrace(
            self.job.plan.scenario,
            ClockKind.VIRTUAL,
            self.now_ns + 1,
            tuple(self.observations),
            notes=tuple(self.notes),
        )
        if self.over.is_set():
            self.has_ended_process = True
            spent = duration(round((time.monotonic_ns() - began_ns) / NS_PER_S) * NS_PER_S)
            what = f"the test did not end within {spent} of real time"
            return replace(trace, harness_problem=f"{self.job.test.file}: {self.job.test.name}: {what}")
        self.has_ended_process = end is None
        if self.problem:
            self.is_worth_another = True
            return replace(trace, harness_problem=self.problem, suspected=bool(self.observations))
        return self._judged(trace, end)

    def _judged(self, trace: AssessedTrace, end: Mapping[str, Any] | None) -> AssessedTrace:
        """Return the trace with what the test has found, or with the reason why that does not count."""
        mistake = _ended(self.job.test, "done") if end is None else _mistake_in(end, self.job.test)
        problem = "" if end is None else str(end.get("problem", ""))
        if self.unsuitable:
            problem = f"virtual time does not suit the programs of this test: {self.unsuitable}"
            return replace(trace, harness_problem=problem)
        if mistake is not None:
            return replace(trace, author_mistake=mistake)
        if end is None or problem:
            return replace(trace, harness_problem=problem)
        return replace(trace, tested=_tested(end["tested"]))

    def _until_end(self, own_s: float) -> Mapping[str, Any] | None:
        """Return the last line about the test; None if the process of pytest has ended before.

        Raises TimeoutError if the code of the test takes more than so many seconds, without what its programs take.
        """
        while True:
            began = time.monotonic()
            line = self.process.hear(own_s)
            own_s -= time.monotonic() - began
            if line is None or "end" in line:
                return line
            try:
                answer = self._answered(line)
            except HarnessError as error:
                self.problem = self.problem or error.message
                answer = {"lost": error.message}
            self.process.tell(answer)

    def _answered(self, line: Mapping[str, Any]) -> Mapping[str, Any]:
        if "lend" in line:
            self._lend(from_json(Plan, line["lend"]))
            return {}
        if "back" in line:
            self._give_back(usable=line["back"])
            return {}
        if self.worker is None:
            raise HarnessError("the test has no worker")
        answer = self.worker.exchange(line["tell"])
        if "news" in answer:
            from grader.runtime.recording.packed import observations_from_json  # noqa: PLC0415 - as in `Worker.run`

            self.observations += observations_from_json(answer["news"])
            self.now_ns = max(self.now_ns, int(answer.get("now_ns", 0)))
        if "unsuitable" in answer:
            self.unsuitable, self.notes = str(answer["unsuitable"]), [str(note) for note in answer["notes"]]
        return {"told": answer}

    def _lend(self, plan: Plan) -> None:
        limits = replace(plan.limits, wall_ns=BEYOND * plan.limits.wall_ns)
        for left in reversed(range(TRIES)):
            self.worker = self.recorder.lend(plan)
            try:
                self.worker.step(replace(plan, limits=limits))
                return
            except WorkerLostError:
                self._give_back(usable=False)
                if not left:
                    raise

    def _give_back(self, *, usable: bool) -> None:
        worker, self.worker = self.worker, None
        if worker is not None:
            self.recorder.take_back(worker, usable=usable)

    def _end_at_once(self) -> None:
        """End a test that takes too long; whoever waits for its process or its worker is woken."""
        self.over.set()
        self.process.kill()
        self._give_back(usable=False)


def _tested(told: Mapping[str, Any]) -> Tested:
    """Return what a test has found, from its JSON values."""
    from grader.runtime.recording.packed import observations_from_json  # noqa: PLC0415 - as above

    fault: Any = observations_from_json([told["fault"]])[0] if told.get("fault") else None
    missing = tuple(map(str, told.get("missing", ())))
    return Tested(bool(told["passed"]), str(told.get("reason", "")), str(told.get("hint", "")), fault, missing)


class _Process:
    """A process of pytest, with the file of tests alone in a folder that nobody else reads.

    Args:
        test: Its file is run.
        paths: Folders of modules that it may import.
    """

    def __init__(self, test: RubricTest, paths: Sequence[str]) -> None:
        self._test = test
        self._stack = contextlib.ExitStack()
        folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="rubric-tests-")))
        place = folder / Path(test.file).name
        place.write_text(test.content, encoding="utf-8", errors="surrogateescape")
        (folder / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
        self._line, theirs = socket.socketpair()
        self._received = bytearray()
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTEST_", "COV_"))}
        searched = [str(PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH", "")]), *paths]
        environment = {
            **kept,
            "PYTHONPATH": os.pathsep.join(searched),
            "PYTHONHASHSEED": "0",
            "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
            VARIABLE: "1",
        }
        loud = None if os.environ.get("GRADER_DEBUG") == "1" else subprocess.DEVNULL
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-s", "-B", "-m", MODULE, str(theirs.fileno()), place.name],
                cwd=folder,
                env=environment,
                pass_fds=(theirs.fileno(),),
                stdin=subprocess.DEVNULL,
                stdout=loud,
                stderr=loud,
                start_new_session=True,
            )

    def __enter__(self) -> _Process:
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()
        self._process.wait()
        self._line.close()
        self._stack.close()

    def kill(self) -> None:
        """End the process, with whatever it has started."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, 9)

    def tell(self, what: Mapping[str, Any]) -> None:
        """Send a line; a process that has ended gets none."""
        with contextlib.suppress(OSError):
            self._line.settimeout(None)
            self._line.sendall(json.dumps(what).encode() + b"\n")

    def hear(self, seconds: float) -> Mapping[str, Any] | None:
        """Return what the process says next; None if it has ended, or the other end of the line is closed.

        Raises:
            TimeoutError: It says nothing for so many seconds.
        """
        deadline = time.monotonic() + seconds
        while b"\n" not in self._received:
            self._line.settimeout(max(0.001, deadline - time.monotonic()))
            try:
                found = self._line.recv(1 << 20)
            except TimeoutError:
                raise
            except OSError:
                return None
            if not found:
                return None
            self._received += found
        line, _, self._received = self._received.partition(b"\n")
        said: Mapping[str, Any] = json.loads(line)
        return said

    def collected(self) -> tuple[list[str], AuthorMistake | None]:
        """Return the tests that pytest collects, and the mistake that keeps it from doing so, if there is one."""
        try:
            line = self.hear(COLLECT_S)
        except TimeoutError:
            text = f"the file was not imported within {COLLECT_S:g} s"
            return [], AuthorMistake(self._test.file, 0, text)
        if line is None:
            return [], _ended(self._test, "collected")
        return list(line.get("collected", ())), _mistake_in(line, self._test)
