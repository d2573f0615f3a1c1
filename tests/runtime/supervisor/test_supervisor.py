"""The supervisor's side of recording, before workers that die, hang, lie or talk without end."""

from __future__ import annotations

import json
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

import pytest
from waiting import wait_for

from grader.runtime.domains import Domains, PrivateDomains
from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import AssessedTrace, ClockKind
from grader.runtime.plan import Plan
from grader.runtime.ros_installation import PythonRuntime
from grader.runtime.sandbox.exposure import View
from grader.runtime.sandbox.protocol import Command, Isolation
from grader.runtime.supervisor.real_time_budget import RealTimeBudget
from grader.runtime.supervisor.supervisor import OF_WORKERS, ExecutedWorker, Job, Recorder, WorkerLimits

RUNTIME = PythonRuntime(Path(sys.executable), (), (), (), {})

#: Stands in for the worker: each start takes the next behaviour from a folder, and writes down that it lived.
WORKER = """
import ctypes, json, os, signal, socket, sys, time
ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # as the tiers of isolation do: it ends with the thread that started it
folder, request = sys.argv[1], json.loads(sys.argv[2])
lines = [request["line"], *request["lines_of_forks"]]
own = lines[0]
for fork in lines[1:]:
    if not os.fork():
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)
        own = fork
        break
for other in {*lines} - {own}:
    try:
        os.close(other)
    except OSError:
        pass  # closed before the fork
for number in range(1000):
    try:
        os.mkdir(os.path.join(folder, f"start-{number}"))
        break
    except FileExistsError:
        continue
behaviours = json.load(open(os.path.join(folder, "behaviours.json")))
behaviour = behaviours[min(number, len(behaviours) - 1)]
# Whoever looks for the file finds it whole.
started = os.path.join(folder, f"start-{number}")
open(os.path.join(started, "unfinished"), "w").write(str(os.getpid()))
os.rename(os.path.join(started, "unfinished"), os.path.join(started, "pid"))
line = socket.socket(fileno=own)
if own != lines[0]:
    line.send(b"\\n")
plans = 0
def trace(plan, note):
    return {"format": "grader/trace/v1", "scenario": plan["scenario"], "clock": plan["clock"], "clock_reason": "",
            "stop_ns": plan["duration_ns"], "notes": [note], "harness_problem": "", "observations": []}
for command in line.makefile("r"):
    asked = json.loads(command)
    open(os.path.join(started, "asked"), "w").close()
    if behaviour in ("answers", "rests"):
        said = json.dumps({"trace": trace(asked["plan"], f"worker {number}, domain {asked['domain']}")}).encode()
    elif behaviour.startswith("tells of"):
        told = behaviour[9:].split("|")
        found = trace(asked["plan"], f"plan {plans}")
        text = told[min(plans, len(told) - 1)]
        plans += 1
        unexplained = text[9:] if text.startswith("ended by") and "limit" not in text else ""
        details = [None, unexplained, None]
        found["observations"] = [["fault", 0, "a.py", "killed", text, "", 0, [], details]] if text else []
        said = json.dumps({"trace": found}).encode()
    elif behaviour.startswith("loses something"):
        found = trace(asked["plan"], f"plan {plans}")
        found["incomplete"] = plans < int(behaviour.split()[2])
        plans += 1
        said = json.dumps({"trace": found}).encode()
    elif behaviour in ("is worn", "works and is worn"):
        while behaviour == "works and is worn" and time.process_time() < 0.25:
            pass
        said = json.dumps({"trace": trace(asked["plan"], f"worker {number}"), "worn": True}).encode()
    elif behaviour == "costs":
        cost = {"real_ns": 100, "starved_ns": 90 if asked["plan"]["scenario"] == "starved" else 0}
        said = json.dumps({"trace": trace(asked["plan"], asked["budget"]), **cost}).encode()
    elif behaviour == "reaches its processor time":
        os.kill(os.getpid(), signal.SIGXCPU)
    elif behaviour == "computes":
        while True:
            pass
    elif behaviour == "grows":
        grown = b"x" * (200 << 20)
        signal.pause()
    elif behaviour == "wants to be alone":
        try:
            os.mkdir(os.path.join(folder, "busy"))
            time.sleep(0.05)
            os.rmdir(os.path.join(folder, "busy"))
            said = json.dumps({"trace": trace(asked["plan"], "alone")}).encode()
        except FileExistsError:
            said = json.dumps({"trace": trace(asked["plan"], "not alone")}).encode()
    elif behaviour == "meets the others":
        os.mkdir(os.path.join(folder, f"here-{asked['plan']['scenario']}"))
        while sum(name.startswith("here-") for name in os.listdir(folder)) < 3:
            time.sleep(0.005)
        said = json.dumps({"trace": trace(asked["plan"], f"worker {number}")}).encode()
    elif behaviour == "dies":
        os._exit(1)
    elif behaviour == "dies in its sentence":
        line.sendall(b'{"trace": {"form')
        os._exit(1)
    elif behaviour == "hangs":
        signal.pause()
    elif behaviour == "talks without end":
        while True:
            line.sendall(b"x" * 65536)
    elif behaviour == "says why not":
        said = json.dumps({"problem": "Traceback\\n  File x\\nValueError: no such thing"}).encode()
    else:
        said = behaviour.encode()
    line.sendall(said + b"\\n")
    if behaviour == "rests":
        time.sleep(0.5)
"""


class Stage:
    """Isolation whose workers behave as a test says, one behaviour for each start and the last for all others.

    Attributes:
        forks: How many forks each worker that was started makes, in order.
    """

    name = "stage"
    submission_seen_at = ""
    host_seen_at = ""
    can_fork = False

    def __init__(self, folder: Path, behaviours: list[str]) -> None:
        self._folder = folder
        self.forks: list[int] = []
        (folder / "behaviours.json").write_text(json.dumps(behaviours), encoding="utf-8")

    def worker_command(
        self, argv: Sequence[str], environment: Mapping[str, str], pass_fds: Sequence[int], view: View | None = None
    ) -> Command:
        self.forks.append(len(json.loads(argv[-1])["lines_of_forks"]))
        # The supervisor knows a worker by the name of its module.
        command = (sys.executable, "-I", "-S", "-c", WORKER, str(self._folder), argv[-1], argv[-2])
        return Command(command, dict(environment), tuple(pass_fds))

    def pids(self) -> list[int]:
        """Return the processes that were started, in order."""
        starts = sorted(self._folder.glob("start-*/pid"), key=lambda path: int(path.parent.name[6:]))
        return [int(path.read_text()) for path in starts]

    def was_asked(self) -> bool:
        """Return whether a plan has reached any of them; they start at their own pace."""
        return any(self._folder.glob("start-*/asked"))


def plan(scenario: str = "alone", clock: str = "virtual") -> Plan:
    return Plan(scenario, (("a.py", "a.py"),), "/nowhere", "ab" * 32, 5, "", 5, clock)


def jobs(*scenarios: str) -> list[Job]:
    return [Job(f"exercise 1: {scenario}", plan(scenario)) for scenario in scenarios]


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Callable[..., tuple[Recorder, Stage]]]:
    """Return a recorder with workers that behave as told; all is ended afterwards."""
    made = []

    def make_one(
        *behaviours: str,
        workers: int = 1,
        domains: Domains | None = None,
        limits: WorkerLimits = OF_WORKERS,
    ) -> tuple[Recorder, Stage]:
        stage = Stage(tmp_path, list(behaviours))
        domains = PrivateDomains() if domains is None else domains
        isolation = cast("Isolation", stage)
        recorder = Recorder(isolation, RUNTIME, domains, scratch=tmp_path, workers=workers, limits=limits)
        made.append(recorder)
        return recorder, stage

    yield make_one
    for recorder in made:
        recorder.close()


def note(trace: AssessedTrace) -> str:
    """Return what the worker of a trace said of itself."""
    assert trace.harness_problem == ""
    return trace.notes[0]


def nothing(step: str) -> None:
    """Hear a step, and do nothing."""


def test_a_worker_may_take_its_time_to_read_a_plan(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """A plan with a recording in it is more than the line holds at once."""
    recorder, stage = make("rests")
    large = replace(plan("large"), root="x" * 4_000_000)
    traces = recorder.record([*jobs("small"), Job("large", large)], nothing)
    assert [trace.harness_problem for trace in traces] == ["", ""]
    assert len(stage.pids()) == 1


def test_traces_come_back_in_the_order_of_the_jobs(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """However many workers there are; each scenario gets a domain of its own."""
    recorder, _ = make("answers", workers=3)
    names = [f"scenario {n}" for n in range(12)]
    steps: list[str] = []
    traces = recorder.record(jobs(*names), steps.append)
    assert [trace.scenario for trace in traces] == names
    assert len({note(trace).split(", ")[1] for trace in traces}) == 12
    assert sorted(steps) == sorted(f"exercise 1: {name}" for name in names)


def test_a_warm_worker_is_used_first_and_again(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """It was started before there was anything to do, and serves one plan after another."""
    recorder, stage = make("answers", workers=2)
    recorder.warm_up(1)
    for _ in range(3):
        assert note(recorder.record(jobs("alone"), nothing)[0]).startswith("worker 0")
    assert len(stage.pids()) == 1


def test_every_warm_worker_is_used(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """None is started and forgotten: one is started, and the others are forks of it."""
    recorder, stage = make("meets the others", workers=3)
    recorder.warm_up(5)
    traces = recorder.record(jobs(*"abc"), nothing)
    assert {note(trace) for trace in traces} == {"worker 0", "worker 1", "worker 2"}
    assert len(stage.pids()) == 3


def test_the_end_of_a_worker_with_forks_is_not_held_against_their_plans(
    make: Callable[..., tuple[Recorder, Stage]],
) -> None:
    """They may have ended with it. Each plan is tried twice after that, in a sandbox of its own."""
    recorder, stage = make("dies", "dies", "dies", "answers", workers=2)
    recorder.warm_up(2)
    wait_for(lambda: len(stage.pids()) == 2)
    assert [trace.harness_problem for trace in recorder.record(jobs("a", "b"), nothing)] == ["", ""]


def test_what_begins_first_takes_longest(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """So that no worker is alone with it at the end; with a single worker, the order is that of the exercises."""
    lengths = {"a": 1, "b": 5, "c": 2, "d": 9, "e": 3}
    long = [Job(name, replace(plan(name), duration_ns=length)) for name, length in lengths.items()]
    steps: list[str] = []
    both = threading.Barrier(2)

    def begins(step: str) -> None:
        steps.append(step)
        if step in "bd":  # neither is over before the other begins
            both.wait(60)

    assert [trace.scenario for trace in make("answers", workers=2)[0].record(long, begins)] == [*lengths]
    assert {*steps[:2]} == {"b", "d"}
    steps.clear()
    make("answers")[0].record(long, steps.append)
    assert steps == [*lengths]


def test_recordings_on_the_wall_clock_are_made_one_at_a_time(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """In real time they would disturb each other."""
    recorder, _ = make("wants to be alone", workers=3)
    on_the_wall = [Job(name, plan(name, "wall")) for name in "abcdef"]
    assert {note(trace) for trace in recorder.record(on_the_wall, nothing)} == {"alone"}


@pytest.mark.parametrize("clock", ["virtual", "wall"])
def test_other_recordings_are_made_at_the_same_time(make: Callable[..., tuple[Recorder, Stage]], clock: str) -> None:
    """In virtual time, and on the wall clock if they are said not to disturb each other: none ends until all began."""
    recorder, _ = make("meets the others", workers=3)
    together = [Job(name, plan(name, clock), parallel=clock == "wall") for name in "abc"]
    assert {note(trace) for trace in recorder.record(together, nothing)} == {"worker 0", "worker 1", "worker 2"}


def test_workers_outlive_the_call_that_started_them(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """The system ends a process with the thread that started it: that thread must live as long as the recorder."""
    recorder, stage = make("answers", workers=2)
    recorder.record(jobs("a", "b", "c", "d"), nothing)
    first = stage.pids()
    recorder.record(jobs("a", "b", "c", "d"), nothing)
    assert stage.pids() == first


@pytest.mark.parametrize(
    "behaviour",
    [
        "dies",
        "dies in its sentence",
        "says why not",
        "no json",
        "[]",
        "{}",
        '{"trace": null}',
        '{"trace": {"format": "grader/trace/v2"}}',
        '{"trace": [1, 2]}',
        "\ud83e",
        "[" * 200_000,
    ],
)
def test_a_worker_that_fails_is_replaced_and_the_plan_tried_again(
    make: Callable[..., tuple[Recorder, Stage]], behaviour: str
) -> None:
    """The second try is the one that counts."""
    behaviour = behaviour.encode("utf-8", "replace").decode()
    recorder, stage = make(behaviour, "answers")
    (trace,) = recorder.record(jobs("alone"), nothing)
    assert note(trace).startswith("worker 1")
    assert not alive(stage.pids()[0])


def test_a_second_failure_is_a_problem_of_ours(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """The trace says why, and forbids judging; the next plan gets a new worker."""
    recorder, stage = make("says why not", "says why not", "answers")
    failed, fine = recorder.record([Job("one", plan("one", "wall")), *jobs("two")], nothing)
    assert failed.harness_problem == "worker: ValueError: no such thing"
    assert (failed.scenario, failed.clock, failed.observations) == ("one", ClockKind.WALL, ())
    assert note(fine).startswith("worker 2")
    assert len(stage.pids()) == 3


@pytest.mark.parametrize(
    ("behaviours", "suspected"),
    [
        (['{"problem": "ValueError: x", "has_started": true}'] * 2, True),
        (["dies", '{"problem": "ValueError: x", "has_started": true}'], True),
        (["dies", "dies"], True),
        (['{"problem": "ValueError: x", "has_started": false}', "dies"], False),
        (['{"problem": "ValueError: x", "has_started": 1}'] * 2, False),
        (["says why not"] * 2, False),
    ],
)
def test_a_problem_that_comes_back_with_the_submission_may_be_its_doing(
    make: Callable[..., tuple[Recorder, Stage]], behaviours: Sequence[str], suspected: bool
) -> None:
    """In a fresh worker, after the submission's code had started; one that comes before is the grader's own."""
    recorder, _ = make(*behaviours)
    (trace,) = recorder.record(jobs("alone"), nothing)
    assert trace.suspected == suspected
    said = "(2 times, each time in another worker, while this submission was recorded)"
    assert trace.harness_problem.endswith(said) == suspected


@pytest.mark.parametrize("behaviour", ["", '{"problem": ""}', '{"problem": 7}', "dies"])
def test_a_problem_without_words_still_has_some(make: Callable[..., tuple[Recorder, Stage]], behaviour: str) -> None:
    """No line of a report is empty, or shows how Python writes a list."""
    recorder, _ = make(behaviour)
    problem = recorder.record(jobs("alone"), nothing)[0].harness_problem
    assert problem.startswith("worker: ")
    assert "[" not in problem
    assert len(problem) > len("worker: ")


def test_a_worker_that_hangs_is_given_up(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """It is ended, whatever it does."""
    recorder, stage = make("hangs", limits=WorkerLimits(margin_s=0.05))
    hurried = replace(plan(), limits=Limits(wall_ns=0))
    (trace,) = recorder.record([Job("exercise 1: alone", hurried)], nothing)
    assert trace.harness_problem.startswith("worker: expected a trace of alone, found none")
    assert not any(map(alive, stage.pids()))


def test_an_answer_without_end_is_not_read_to_its_end(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """Memory stays ours."""
    recorder, stage = make("talks without end", limits=WorkerLimits(answer_bytes=1 << 20))
    (trace,) = recorder.record(jobs("alone"), nothing)
    assert "did not end" in trace.harness_problem
    assert not any(map(alive, stage.pids()))


def test_one_lost_scenario_does_not_cost_the_others(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """Each plan stands for itself."""
    recorder, _ = make("answers", "dies", "dies", "answers", workers=2)
    traces = recorder.record(jobs(*"abcdef"), nothing)
    assert sum(bool(trace.harness_problem) for trace in traces) <= 1
    assert [trace.scenario for trace in traces] == list("abcdef")


def test_any_other_problem_is_raised_and_nothing_hangs(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """A machine without a free domain is not the worker's failure; the recorder can be closed all the same."""
    recorder, _ = make("answers", workers=2, domains=Failing(1))
    with pytest.raises(EnvironmentFault):
        recorder.record(jobs("alone"), nothing)
    recorder.close()


class Failing(PrivateDomains):
    """Domains, of which the first are not to be had."""

    def __init__(self, failures: int) -> None:
        super().__init__()
        self._left = failures

    def take(self) -> int:
        """Return one, or raise."""
        self._left -= 1
        if self._left >= 0:
            raise EnvironmentFault("ROS domains: expected a free one, found all in use")
        return super().take()


def test_a_worker_is_not_lost_with_a_problem_of_another_kind(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """As many plans as there were workers failed; the next one finds a worker."""
    recorder, _ = make("answers", workers=2, domains=Failing(3))
    for _ in range(3):
        with pytest.raises(EnvironmentFault):
            recorder.record(jobs("alone"), nothing)
    assert recorder.record(jobs("alone"), nothing)[0].harness_problem == ""


def test_no_two_workers_have_one_domain(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """However many scenarios the others record meanwhile; what ended workers had is given back."""
    domains = PrivateDomains([range(10, 14)])
    recorder, _ = make("answers", "answers", "dies", "answers", workers=3, domains=domains)
    used = {note(trace).partition("domain ")[2] for trace in recorder.record(jobs(*map(str, range(30))), nothing)}
    assert used <= {"10", "11", "12", "13"}
    recorder.close()
    assert sorted(domains.take() for _ in range(4)) == [10, 11, 12, 13]


def test_closing_ends_every_worker(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """Idle ones too, and closing again does no harm."""
    recorder, stage = make("answers", workers=3)
    recorder.warm_up(3)
    recorder.record(jobs("alone"), nothing)
    wait_for(lambda: len(stage.pids()) == 3)
    recorder.close()
    recorder.close()
    wait_for(lambda: not any(map(alive, stage.pids())))
    with pytest.raises(RuntimeError):
        recorder.record(jobs("alone"), nothing)


def test_closing_while_scenarios_are_under_way_ends_them(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """After Ctrl-C nobody waits for what a worker does; nothing is started any more."""
    recorder, stage = make("hangs", workers=2)
    ended: list[BaseException | None] = []

    def record() -> None:
        try:
            recorder.record(jobs(*"abcdef"), nothing)
        except BaseException as error:
            ended.append(error)
        else:
            ended.append(None)

    thread = threading.Thread(target=record)
    thread.start()
    wait_for(lambda: len(stage.pids()) == 2)
    recorder.close()
    thread.join()
    assert len(ended) == 1
    assert len(stage.pids()) == 2
    assert not any(map(alive, stage.pids()))


def test_a_recorder_closes_with_its_block(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """Also when the block raises."""
    recorder, stage = make("answers")
    recorder.record(jobs("alone"), nothing)
    with pytest.raises(KeyboardInterrupt), recorder:
        raise KeyboardInterrupt
    assert not any(map(alive, stage.pids()))


def test_a_worker_inherits_nothing_of_the_callers_environment(
    make: Callable[..., tuple[Recorder, Stage]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tokens of a build server stay outside."""
    monkeypatch.setenv("GITHUB_TOKEN", "canary")
    recorder, stage = make("answers")
    recorder.record(jobs("alone"), nothing)
    (pid,) = stage.pids()
    assert b"canary" not in Path(f"/proc/{pid}/environ").read_bytes()


def test_a_worker_keeps_no_descriptor_of_another(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """Lines between the supervisor and one worker are nobody else's."""
    recorder, stage = make("answers", workers=2)
    recorder.warm_up(2)
    recorder.record(jobs("a", "b"), nothing)
    wait_for(lambda: len(stage.pids()) == 2)
    for pid in stage.pids():
        links = [str(link.readlink()) for link in Path(f"/proc/{pid}/fd").iterdir() if link.is_symlink()]
        assert len([link for link in links if link.startswith("socket:")]) == 1


def alive(pid: int) -> bool:
    """Return whether a process runs; a zombie does not."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] not in "ZX"


@pytest.mark.parametrize(
    ("told", "kept", "times"),
    [
        ("ended by SIGABRT|", "", 2),
        ("ended by SIGABRT|ended by SIGSEGV|", "ended by SIGSEGV", 2),
        ("stopped at 512 MiB of memory|", "stopped at 512 MiB of memory", 1),
        ("ended by SIGABRT (the limit is 64 processes and threads)|", "ended by SIGABRT (the limit", 1),
        ("|ended by SIGABRT", "", 1),
    ],
)
def test_a_signal_that_no_limit_explains_has_to_come_twice(
    make: Callable[..., tuple[Recorder, Stage]], told: str, kept: str, times: int
) -> None:
    """A machine that was out of threads for a moment costs nobody a point; a node that aborts does so again."""
    recorder, _ = make(f"tells of {told}")
    (found,) = recorder.record(jobs("alone"), lambda step: None)
    assert "".join(fault.text for fault in found.faults()).startswith(kept)
    assert bool(found.faults()) is bool(kept)
    assert found.notes == (f"plan {times - 1}",)


@pytest.mark.parametrize(("incomplete", "kept"), [(0, "plan 0"), (1, "plan 1"), (9, "plan 1")])
def test_what_was_lost_has_to_be_lost_twice(
    make: Callable[..., tuple[Recorder, Stage]], incomplete: int, kept: str
) -> None:
    """A machine that stood still for a moment costs nobody a point; a node that nothing reaches is the same again."""
    recorder, _ = make(f"loses something {incomplete}")
    (found,) = recorder.record(jobs("alone"), nothing)
    assert found.notes == (kept,)


def test_a_worn_worker_does_no_more(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """The next scenario gets a fresh one."""
    recorder, stage = make("is worn", "is worn", "answers")
    found = [note(recorder.record(jobs("alone"), nothing)[0]) for _ in range(4)]
    assert [text.partition(",")[0] for text in found] == ["worker 0", "worker 1", "worker 2", "worker 2"]
    assert len(stage.pids()) == 3


def test_worn_workers_are_replaced_by_one_with_forks(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """Once none is busy, and some are needed: forks share the memory of the worker that made them."""
    recorder, stage = make("is worn", workers=3)
    for names in ("abc", "abc", "a", "a"):
        recorder.record(jobs(*names), nothing)
    assert stage.forks == [2, 2, 2]


def test_processor_time_of_replaced_workers_is_not_lost(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """Without it, a submission would seem to take less than nothing."""
    recorder, _ = make("works and is worn", "answers")
    recorder.record(jobs("a"), nothing)
    recorder.record(jobs("a"), nothing)
    assert recorder.ended_ns >= 200_000_000


def test_a_worn_worker_is_not_replaced_while_others_go_on(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """Only the last one is, and then by one without forks."""
    recorder, stage = make(*["is worn"] * 4, "answers", workers=3)
    assert len(recorder.record(jobs(*"abcdef"), nothing)) == 6
    assert stage.forks == [2, 0, 0]
    recorder.record(jobs(*"abc"), nothing)
    assert stage.forks == [2, 0, 0, 2]


@pytest.mark.long
def test_callers_at_the_same_time_wear_workers_and_lose_no_place(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """While the places of one are filled again, nobody else takes or drops one of them: all would wait for it."""
    recorder, _ = make("is worn", workers=2)

    def record() -> None:
        for _ in range(20):
            recorder.record(jobs("a", "b"), nothing)

    callers = [threading.Thread(target=record, daemon=True) for _ in range(3)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join(600)
    assert not any(caller.is_alive() for caller in callers)


def test_a_lost_worker_with_forks_is_replaced_by_another(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """Its forks end with it; the plans that come next find all places taken again."""
    recorder, stage = make("answers", workers=3)
    recorder.record(jobs(*"abc"), nothing)
    wait_for(lambda: len(stage.pids()) == 3)
    for worker in list(recorder._alive):
        if isinstance(worker, ExecutedWorker):
            worker.close()
    traces = recorder.record(jobs(*"abc"), nothing)
    assert [trace.harness_problem for trace in traces] == ["", "", ""]
    assert stage.forks == [2, 2]


#: What workers may use that reach it soon.
SMALL = WorkerLimits(memory_bytes=100 << 20, processor_s=lambda limits, lasts_ns: 1, spare_cpu_s=0)
LIMITS = {
    "reaches its processor time": "1 s of processor time",
    "computes": "1 s of processor time",
    "grows": "100 MiB of memory",
}


@pytest.mark.breadth(1, 3)
@pytest.mark.parametrize("behaviour", LIMITS)
def test_two_workers_at_a_limit_of_theirs_are_the_nodes_doing(
    make: Callable[..., tuple[Recorder, Stage]], behaviour: str
) -> None:
    """They do it again and again: a fault of theirs, and no third try."""
    recorder, stage = make(behaviour, behaviour, "answers", limits=SMALL)
    (trace,) = recorder.record(jobs("alone"), nothing)
    words = f"stopped: receiving what the nodes sent took the grader's process to {LIMITS[behaviour]}"
    assert [(fault.process, fault.text) for fault in trace.faults()] == [("a.py", words)]
    assert (trace.harness_problem, trace.stop_ns, len(stage.pids())) == ("", 5, 2)


@pytest.mark.breadth(1, 3)
@pytest.mark.parametrize("behaviour", LIMITS)
def test_one_worker_at_a_limit_decides_nothing(make: Callable[..., tuple[Recorder, Stage]], behaviour: str) -> None:
    """The plan is tried again."""
    recorder, _ = make(behaviour, "answers", limits=SMALL)
    assert note(recorder.record(jobs("alone"), nothing)[0]).startswith("worker 1")


@pytest.mark.breadth(1, 4)
@pytest.mark.parametrize("first", [*LIMITS, "dies"])
def test_different_ends_of_workers_decide_nothing(make: Callable[..., tuple[Recorder, Stage]], first: str) -> None:
    """A limit and a failure without one, in any order."""
    recorder, _ = make(first, "dies", "answers", limits=SMALL)
    (trace,) = recorder.record(jobs("alone"), nothing)
    assert trace.harness_problem.startswith("worker: expected a trace of alone, found none")
    assert trace.faults() == ()


def test_a_worker_that_took_all_its_time_is_not_tried_again(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """A second try would take as long."""
    recorder, stage = make("hangs", "answers", limits=WorkerLimits(margin_s=0.2))
    recorder.warm_up(1)
    wait_for(lambda: len(stage.pids()) == 1)
    short = replace(plan(), limits=Limits(wall_ns=1))
    (trace,) = recorder.record([Job("alone", short)], nothing)
    assert trace.harness_problem == "worker: expected a trace of alone, found none (it did not answer in time)"
    assert len(stage.pids()) == 1


def test_without_time_nothing_is_recorded(make: Callable[..., tuple[Recorder, Stage]]) -> None:
    """It is told as a fault of every process, the same in every run; no worker is even asked."""
    recorder, stage = make("answers")
    job = replace(jobs("alone")[0], budget=RealTimeBudget(0))
    (trace,) = recorder.record([job], nothing)
    words = "stopped: the recordings of this submission took more than 0 s of real time"
    assert [(fault.process, fault.text) for fault in trace.faults()] == [("a.py", words)]
    assert (trace.harness_problem, trace.stop_ns, stage.was_asked()) == ("", 5, False)


@pytest.mark.parametrize(("scenario", "undecided"), [("starved", True), ("alone", False)])
def test_time_that_others_took_is_nobodys_fault(
    make: Callable[..., tuple[Recorder, Stage]], scenario: str, undecided: bool
) -> None:
    """Workers say how long nodes waited for a processor; where that is much, what is not recorded is not judged."""
    recorder, _ = make("costs")
    now_s = 0
    budget = RealTimeBudget(3600, now_ns=lambda: now_s * NS_PER_S)
    (first,) = recorder.record([replace(jobs(scenario)[0], budget=budget)], nothing)
    assert note(first) == "stopped: the recordings of this submission took more than 3600 s of real time"
    now_s = 3600
    (trace,) = recorder.record([replace(jobs("next")[0], budget=budget)], nothing)
    assert (bool(trace.harness_problem), bool(trace.faults())) == (undecided, not undecided)
