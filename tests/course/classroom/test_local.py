"""The processes that grade a class: whatever becomes of it, the others and the class go on."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from class_samples import DONE, LASTING
from waiting import wait_for

from grader.course.classroom.local import WAITING_PER_JOB, Grading, GradingProcesses, LocalScheduler, Task
from grader.course.classroom.store import Conditions, ResultStatus, State
from grader.grading.model.grading_options import GradingOptions

CONDITIONS = Conditions("0", (("a", "sha256:1"),), "", GradingOptions())

#: What stands in for the grader: does as the label of its task says.
PROGRAM = f"""
import json, os, sys, time
task = json.loads(sys.stdin.readline())["task"]
print(json.dumps({{"step": "grading"}}), flush=True)
done = json.dumps({{"done": {DONE!r}}})
if task["label"] == "crashes":
    os.abort()
if task["label"] == "exits":
    sys.exit(7)
if task["label"] == "hangs":
    time.sleep(600)
if task["label"] == "talks nonsense":
    print("\\x00 not JSON")
    print("[1, 2]")
    print("[" * 100000)
    print(json.dumps({{"done": {{"state": "graded"}}}}))
    sys.exit(0)
if task["label"] == "lingers":
    print(done, flush=True)
    os.close(1)
    sys.exit(0)
print("noise")
print(done)
"""


def task(tmp_path: Path, label: str, deadline_s: float = 600.0) -> Task:
    return Task(label, label, tmp_path, tmp_path / label, CONDITIONS, 1, False, deadline_s)


def scheduler(jobs: int = 2, **options: Any) -> LocalScheduler:
    return LocalScheduler(jobs, (sys.executable, "-c", PROGRAM), **options)


def graded(
    tasks: Sequence[Task], jobs: int = 2, on_step: Callable[..., Any] = lambda name, step: None
) -> dict[str, ResultStatus]:
    return {a.task.name: a.status for a in scheduler(jobs).run(tasks, on_step)}


def test_one_disaster_touches_nobody_else(tmp_path: Path) -> None:
    """A crash, an exit, nonsense: each is a failure of ours, and the others have their results."""
    labels = ("fine", "crashes", "exits", "talks nonsense", "lingers", "fine too")
    found = graded([task(tmp_path, label) for label in labels])
    assert {label: s.state.value for label, s in found.items()} == {
        "fine": "graded",
        "crashes": "failed",
        "exits": "failed",
        "talks nonsense": "failed",
        "lingers": "graded",
        "fine too": "graded",
    }
    assert found["exits"].problem == "the grader ended without a result (exit code 7)"


def test_a_process_is_kept_for_the_next_submission(tmp_path: Path) -> None:
    """Until it fails or ends. A submission that a kept process fails on is graded once more in a new one."""
    heard: list[str] = []
    here = LocalScheduler(1, (sys.executable, "-c", LASTING))
    labels = ("a", "b", "fails", "c", "d", "ends", "e")
    tasks = [task(tmp_path, label) for label in labels]
    found = {a.task.name: a.status.state.value for a in here.run(tasks, lambda _, step: heard.append(step))}
    assert [label for label, state in found.items() if state == "failed"] == ["fails", "ends"]
    pids = [step for step in heard if step != "starting"]
    order = {pid: number for number, pid in enumerate(dict.fromkeys(pids))}
    assert [order[pid] for pid in pids] == [0, 0, 0, 1, 2, 2, 2, 3, 4]
    assert [pid for pid in pids if Path(f"/proc/{pid}").exists()] == []


def pid_of(processes: GradingProcesses, one: Task, class_: str) -> str:
    """Grade a submission, and return the process that did."""
    heard: list[str] = []
    attempt = processes.grade(Grading(one, lambda _, step: heard.append(step), one.submission, class_))
    assert attempt.status.state is State.GRADED
    return heard[-1]


def test_a_process_serves_one_class(tmp_path: Path) -> None:
    """It remembers files by their paths, which may be others in another class; two classes may take turns."""
    processes = GradingProcesses((sys.executable, "-c", LASTING))
    one = task(tmp_path, "a")
    pids = [pid_of(processes, one, class_) for class_ in ("x", "y", "x", "y")]
    assert pids[:2] == pids[2:]
    assert len(set(pids)) == 2
    processes.close()
    assert [pid for pid in pids if Path(f"/proc/{pid}").exists()] == []


def test_a_process_outlives_the_thread_that_asked_for_it(tmp_path: Path) -> None:
    """It asks the kernel to be killed together with the thread that started it, so that one has to last."""
    processes = GradingProcesses((sys.executable, "-c", f"import ctypes; ctypes.CDLL(None).prctl(1, 9)\n{LASTING}"))
    pids = []
    for _ in range(2):
        asking = threading.Thread(target=lambda: pids.append(pid_of(processes, task(tmp_path, "a"), "x")))
        asking.start()
        asking.join()
    processes.close()
    assert pids[0] == pids[1]


def test_a_process_that_waits_in_vain_ends(tmp_path: Path) -> None:
    """The next submission gets another one."""
    processes = GradingProcesses((sys.executable, "-c", LASTING), idle_s=0.05)
    first = pid_of(processes, task(tmp_path, "a"), "x")
    wait_for(lambda: not Path(f"/proc/{first}").exists())
    assert pid_of(processes, task(tmp_path, "a"), "x") != first
    processes.close()


def test_a_result_that_nobody_wants_is_not_waited_for(tmp_path: Path) -> None:
    """What a listener raises comes out, and nothing is left of the process."""
    processes = GradingProcesses((sys.executable, "-c", PROGRAM))

    def unwanted(name: str, step: str) -> None:
        if step == "grading":
            raise LookupError

    with pytest.raises(LookupError):
        processes.grade(Grading(task(tmp_path, "hangs"), unwanted, tmp_path))
    assert not processes._running


#: Says that it records on the wall clock, if its label says so, and ends once every submission has been begun.
WAITING = f"""
import json, os, sys, time
from pathlib import Path
for line in sys.stdin:
    task = json.loads(line)["task"]
    begun = Path(task["submission"], "begun")
    begun.mkdir(exist_ok=True)
    (begun / task["label"]).touch()
    if task["label"].startswith("waits"):
        print(json.dumps({{"wall_clock": True}}), flush=True)
        while len(os.listdir(begun)) < 4:
            time.sleep(0.01)
    print(json.dumps({{"step": str(len(os.listdir(begun)))}}), flush=True)
    print(json.dumps({{"done": {DONE!r}}}), flush=True)
"""


def test_another_submission_is_begun_beside_one_that_waits_for_the_wall_clock(tmp_path: Path) -> None:
    """It would never end otherwise."""
    here = LocalScheduler(2, (sys.executable, "-c", WAITING))
    tasks = [task(tmp_path, label) for label in ("waits", "waits too", "a", "b", "c")]
    heard: dict[str, str] = {}
    found = [a.status.state for a in here.run(tasks, lambda name, step: heard.update({name: step}))]
    assert found == [State.GRADED] * 5
    assert heard["waits"] >= "4"


def test_a_process_that_others_were_begun_beside_ends_with_its_submission(tmp_path: Path) -> None:
    """Otherwise two processes for each job would be kept, with all that they have started."""
    program = WAITING.replace("str(len(os.listdir(begun)))", "str(os.getpid())")
    here = LocalScheduler(1, (sys.executable, "-c", program))
    pids: dict[str, str] = {}
    for attempt in here.run([task(tmp_path, label) for label in ("waits", "a", "b", "c", "d")], pids.__setitem__):
        if attempt.task.name == "waits":
            assert not Path(f"/proc/{pids['waits']}").exists()
    assert len({pids[label] for label in "abcd"}) == 1 < len(set(pids.values()))


def test_a_class_that_is_checked_keeps_the_processes_that_wait(tmp_path: Path) -> None:
    """As many as may wait at a time: each submission leaves its place, and no other needs a new process for that."""
    program = WAITING.replace("str(len(os.listdir(begun)))", "str(os.getpid())").replace("< 4", "< 3")
    here = LocalScheduler(1, (sys.executable, "-c", program))
    labels = [f"waits {number}" for number in range(12)]
    pids: dict[str, str] = {}
    tasks = [replace(task(tmp_path, label), spot_check=True) for label in labels]
    found = [a.status.state for a in here.run(tasks, pids.__setitem__)]
    assert found == [State.GRADED] * 12
    assert len(set(pids.values())) <= 1 + WAITING_PER_JOB < len(pids)
    assert [pid for pid in pids.values() if Path(f"/proc/{pid}").exists()] == []


def test_spot_checks_begin_early_and_leave_room_for_others(tmp_path: Path) -> None:
    """Three times as many as jobs are graded at a time, while there are others.

    Those that wait end once `b` is begun too, because the first that ends makes room for the last of them.
    """
    here = LocalScheduler(1, (sys.executable, "-c", WAITING.replace("< 4", "< 5")))
    labels = ("a", "b", "waits", "waits too", "waits as well", "waits last")
    tasks = [replace(task(tmp_path, label), spot_check=label[0] == "w") for label in labels]
    begun: list[str] = []
    assert all(a.status.state is State.GRADED for a in here.run(tasks, lambda name, _: begun.append(name)))
    assert list(dict.fromkeys(begun)) == ["waits", "waits too", "waits as well", "a", "b", "waits last"]


@pytest.mark.parametrize("clock", ["wall", "auto"])
def test_a_class_that_is_graded_on_the_wall_clock_keeps_to_its_jobs(tmp_path: Path, clock: str) -> None:
    """Recordings in real time disturb each other, so only single ones have others beside them."""
    program = WAITING.replace("< 4", "< 2") if clock == "auto" else WAITING.replace("< 4", "< 1")
    here = LocalScheduler(1, (sys.executable, "-c", program))
    conditions = replace(CONDITIONS, options=GradingOptions(clock=clock))
    tasks = [replace(task(tmp_path, label), conditions=conditions) for label in ("waits", "b")]
    heard: dict[str, str] = {}
    assert all(a.status.state is State.GRADED for a in here.run(tasks, lambda name, step: heard.update({name: step})))
    assert heard["waits"] == {"wall": "1", "auto": "2"}[clock]


def test_what_does_not_end_is_given_up(tmp_path: Path) -> None:
    """After its deadline; nothing is left of it."""
    found = graded([task(tmp_path, "hangs", deadline_s=0.2)])
    assert found["hangs"].problem.startswith("the grader was not done after")
    assert found["hangs"].state is State.FAILED


def test_whoever_listens_hears_what_is_running(tmp_path: Path) -> None:
    """By name and step."""
    heard = []
    graded([task(tmp_path, "fine")], on_step=lambda name, step: heard.append((name, step)))
    assert heard == [("fine", "starting"), ("fine", "grading")]


def test_giving_up_leaves_no_process(tmp_path: Path) -> None:
    """Closing the iterator, as Ctrl-C does, ends everything that is under way."""
    started = threading.Event()
    here = scheduler()
    running = here.run(
        [task(tmp_path, "fine"), task(tmp_path, "hangs"), task(tmp_path, "hangs")],
        lambda name, step: started.set() if (name, step) == ("hangs", "grading") else None,
    )
    with closing(running):
        next(running)
        assert started.wait(60)
        pids = [process.pid for process in here._processes._running]
    assert pids
    assert [pid for pid in pids if Path(f"/proc/{pid}").exists()] == []


def test_a_program_that_cannot_be_started_is_a_failure(tmp_path: Path) -> None:
    """Of ours, not of the student's."""
    here = LocalScheduler(1, ("/nothing/there",))
    attempt = next(here.run([task(tmp_path, "fine")], lambda name, step: None))
    assert attempt.status.problem == "the grader cannot be started: No such file or directory"


@pytest.mark.parametrize("odd", ["b a", "ö", "-x"])
def test_tasks_reach_the_process_as_they_are(tmp_path: Path, odd: str) -> None:
    """Paths with spaces, umlauts and hyphens."""
    program = (
        "import json,sys; t = json.loads(sys.stdin.readline())['task']; print(json.dumps({'step': t['submission']}))"
    )
    heard = []
    here = LocalScheduler(1, (sys.executable, "-c", program))
    one = Task("x", odd, tmp_path / odd, tmp_path / "into", CONDITIONS, 1, False, 600.0)
    list(here.run([one], lambda name, step: heard.append(step)))
    assert heard[-1] == str(tmp_path / odd)


@pytest.mark.parametrize(
    ("tier", "shares", "most"), [("landlock", True, 1), ("none", True, 3), ("bubblewrap", False, 3)]
)
def test_submissions_that_could_reach_each_other_go_one_at_a_time(
    tmp_path: Path, tier: str, shares: bool, most: int
) -> None:
    """Where the sandbox leaves them one network; without a sandbox it is the user's wish."""
    isolation = SimpleNamespace(name=tier, shares_network=shares)
    here = scheduler(jobs=3, sandbox=lambda wanted: SimpleNamespace(isolation=isolation, containment=()))
    warnings = here.prepare(tier)
    together = []
    tasks = [task(tmp_path, f"fine {n}") for n in range(6)]
    assert len(list(here.run(tasks, lambda name, step: together.append(len(here._processes._running))))) == 6
    assert [len(warnings), here._jobs] == [int(most == 1), most]
    assert max(together) <= most
