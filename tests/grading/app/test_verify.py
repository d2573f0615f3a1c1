"""`grade verify`: programs that repeat are told from those that do not, under conditions that really are made."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from places import GRADE
from verifying import differences, program, verified, written

from grader.cli.main import app
from grader.cli.verify import verification_exit_code
from grader.grading.app import verify as verifying
from grader.grading.app.request import GradeRequest
from grader.grading.app.verify import LOOPS, VerifyCondition, VerifyRequest, verify, verify_conditions
from grader.grading.model.verification import ConditionState, Verification
from grader.runtime.model.errors import HarnessError

#: What differs from run to run, and the cause that is found; none where the text tells nothing.
DIFFERING = {
    "address": (program(each='self.get_logger().info(f"sent by {id(object())}")'), "address"),
    "shown_object": (program(each="self.get_logger().info(str(self.executor))"), "address"),
    # The hash of a tuple mixes that of the object in it, which is its address. So the order is another one whenever the
    # address of the heap is, which Linux draws from 2**28. That of the bare objects is often the same: only the address
    # within 64 KiB matters to it, which are 16 pages.
    "set_of_objects": (
        program(
            imports="class Step:\n    def __init__(self, number):\n        self.number = number",
            begin="self.steps = [step.number for (step,) in {(Step(n),) for n in range(1000)}]",
            each="self.get_logger().info(str(self.steps.pop()))",
        ),
        None,
    ),
    "processor_time": (
        program(imports="import time", each='self.get_logger().info(f"{time.process_time():.9f}")'),
        "processor_time",
    ),
    "count_of_the_kernel": (
        program(each='self.get_logger().info(open("/proc/self/schedstat").read())'),
        "kernel",
    ),
    "file_time": (
        program(
            imports="import os", each='open("x", "w").close(); self.get_logger().info(str(os.stat("x").st_mtime_ns))'
        ),
        "kernel",
    ),
}
#: Nodes in one executor, which keeps them in a set, with timers that are due at the same instants.
SEVERAL_NODES = """
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String


class One(Node):
    def __init__(self, number):
        super().__init__(f"node_{number}")
        self.publisher = self.create_publisher(String, f"/note_{number}", 10)
        self.create_timer(0.1, self.tick)

    def tick(self):
        self.get_logger().info("tick")
        self.publisher.publish(String(data=self.get_name()))


rclpy.init()
executor = SingleThreadedExecutor()
for node in {One(number) for number in range(9)}:
    executor.add_node(node)
executor.spin()
"""
#: What repeats although it is drawn, or differs between machines.
REPEATING = {
    "plain": program(),
    "set_of_texts": program(each='self.get_logger().info(str({f"step {n}" for n in range(50)}))'),
    "randomness": program(
        imports="import random, secrets, uuid, tempfile",
        each="self.get_logger().info(str((random.random(), secrets.token_hex(), uuid.uuid4(), tempfile.mktemp())))",
    ),
    "randomness_after_numpy": program(
        imports="import secrets\nimport numpy",
        begin="self.generator = numpy.random.default_rng()",
        each="self.get_logger().info(str((self.generator.random(), numpy.random.rand(), secrets.token_hex())))",
    ),
    "clocks": program(
        imports="import time, datetime",
        each="self.get_logger().info(str((time.time(), time.monotonic(), datetime.datetime.now())))",
    ),
    "machine": program(
        imports="import os, locale",
        each="self.get_logger().info(str((os.cpu_count(), os.getuid(), sorted(os.environ.get('TZ', '')))))",
    ),
    "depth_of_recursion": program(
        imports="def deep(n=0):\n    try:\n        return deep(n + 1)\n    except RecursionError:\n        return n",
        begin="print(deep())",
    ),
    "two_topics_at_once": program(
        begin="self.others = [self.create_publisher(Twist, f'/x{n}', 10) for n in (3, 1, 2)]",
        each="[other.publish(message) for other in self.others]",
    ),
    "several_nodes": SEVERAL_NODES,
    "thread_that_raises": program(
        imports="import threading",
        begin="threading.Thread(target=int, args=('no number',)).start()",
    ),
    "threads": program(
        imports="import threading, time",
        begin="[threading.Thread(target=self.work, args=(n,), daemon=True).start() for n in range(4)]",
        each="pass\n\n    def work(self, number):\n        while True:\n            time.sleep(0.1)\n            "
        "self.get_logger().info(str(number))",
    ),
}
#: What is decided on the wall clock, where which comes first is up to the machine.
RACING = {
    "race": program(
        imports="import subprocess",
        each='subprocess.run(["true"]); self.get_logger().info("done")',
    ),
}


@pytest.mark.nightly
@pytest.mark.ros
def test_programs_that_repeat_are_told_from_those_that_do_not(open_folder: Path) -> None:
    """By recording again, also with everything changed and under load; those of the wall clock are neither."""
    texts = {**{name: text for name, (text, _) in DIFFERING.items()}, **REPEATING, **RACING}
    code, found = verified(written(open_folder, texts))
    assert code == 1
    assert found["result"] == "different"
    assert {name: one["cause"] for name, one in differences(found).items()} == {
        name: cause for name, (_, cause) in DIFFERING.items()
    }
    assert [Path(one["submission"]).name for one in found["not_comparable"]] == [*RACING]
    assert [one["name"] for one in found["conditions"]] == ["again", "together", "load"]
    assert {one["compared"] for one in found["conditions"]} == {found["scenarios"] - len(RACING)}


@pytest.mark.nightly
@pytest.mark.ros
def test_the_first_difference_says_where_it_is(open_folder: Path) -> None:
    """With both events, and with the line that logged."""
    text = program(imports="import itertools", each="self.get_logger().info(str(id(object())))")
    (path,) = written(open_folder, {"ada": text})
    done = subprocess.run([GRADE, "verify", path], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    line = 1 + text.splitlines().index("        self.get_logger().info(str(id(object())))")
    assert "  DIFFERENT  again, with nothing changed: 1 of 1 scenario\n" in done.stdout
    assert f", velocity_publisher, alone, event 1, velocity_publisher.py:{line}" in " ".join(done.stdout.split())
    assert "  kind   content: another event\n" in done.stdout
    assert "  first  t = 0.050 s  INFO [velocity_publisher] 1" in done.stdout


@pytest.mark.nightly
@pytest.mark.ros
def test_only_the_wall_clock_can_decide(open_folder: Path) -> None:
    """Then nothing is verified, and the reason is said."""
    (path,) = written(open_folder, RACING)
    done = subprocess.run([GRADE, "verify", path], capture_output=True, text=True, check=False)
    assert done.returncode == 3
    assert "Not comparable event by event, because the wall clock decides:" in done.stdout
    assert "there is nothing to compare" in done.stdout


@pytest.mark.nightly
@pytest.mark.ros
def test_the_result_in_evidence(open_folder: Path) -> None:
    """The kept recordings are compared too; evidence of other files is refused, and judging again works as before."""
    (path,) = written(open_folder, {"ada": REPEATING["plain"]})
    kept = open_folder / "kept"
    command = [GRADE, path, "--exercise", "velocity_publisher", "-o", f"evidence={kept}"]
    subprocess.run(command, capture_output=True, check=False)
    code, found = verified([path], "--evidence", str(kept))
    assert (code, [(one["name"], one["state"]) for one in found["conditions"]]) == (
        0,
        [("kept", "same"), ("again", "same"), ("together", "same"), ("load", "same")],
    )
    assert json.loads((kept / "verification.json").read_text(encoding="utf-8")) == found
    before = json.loads((kept / "report.json").read_text(encoding="utf-8"))
    judged = subprocess.run([GRADE, "rejudge", str(kept), "--json"], capture_output=True, text=True, check=False)
    assert json.loads(judged.stdout)["exercises"] == before["exercises"]
    other = written(open_folder, {"bob": REPEATING["clocks"]})
    done = subprocess.run(
        [GRADE, "verify", *other, "--evidence", str(kept)], capture_output=True, text=True, check=False
    )
    assert (done.returncode, "found that of other files" in done.stderr) == (2, True)
    subprocess.run(command, capture_output=True, check=False)  # a new recording has not been verified
    assert not (kept / "verification.json").exists()


@pytest.mark.nightly
@pytest.mark.ros
def test_changed_evidence_differs(open_folder: Path) -> None:
    """What was recorded of another version of the grader or on another machine is compared event by event."""
    (path,) = written(open_folder, {"ada": REPEATING["plain"]})
    kept = open_folder / "kept"
    command = [GRADE, path, "--exercise", "velocity_publisher", "--seed", "1", "-o", f"evidence={kept}"]
    subprocess.run(command, capture_output=True, check=False)
    manifest = json.loads((kept / "evidence.json").read_text(encoding="utf-8"))
    manifest["run"]["seed"] = 2
    (kept / "evidence.json").write_text(json.dumps(manifest), encoding="utf-8")
    done = subprocess.run([GRADE, "verify", path, "--evidence", str(kept)], capture_output=True, text=True, check=False)
    assert done.returncode == 2  # the recording says with which seed it was made
    assert "one that shows something else" in done.stderr


# --- the conditions ---------------------------------------------------------------------------------------------------

#: Stands in for the program that records, and says what it was started with.
SAYS = """
import json, os, sys
told = json.load(sys.stdin)
parent = os.getppid()
names = [name for name in os.listdir("/proc") if name.isdecimal() and int(name) != os.getpid()]
loops = 0
for name in names:
    try:
        status = open(f"/proc/{name}/stat").read().rpartition(")")[2].split()
        loops += int(status[1]) == parent and b"while os.getppid() ==" in open(f"/proc/{name}/cmdline", "rb").read()
    except OSError:
        pass
said = {name: os.environ.get(name) for name in ("TZ", "LANG", "PYTHONHASHSEED", "TMPDIR", "HOME", "GRADER_SEED_KEY")}
said |= {"loops": loops, "cwd": os.getcwd(), "folder": os.path.isdir(said["TMPDIR"] or "/"), "changed": told["changed"]}
print(json.dumps({"isolation": "x", "said": said}))
"""


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[VerifyCondition], dict[str, Any]]:
    """Start the stand-in under a condition, and return what it said."""
    monkeypatch.setenv("GRADER_SEED_KEY", "a key that nobody else may read")
    tmp_path.chmod(0o755)

    def start(condition: VerifyCondition) -> dict[str, Any]:
        (line,) = verifying._recorded(tmp_path, [], condition, "bubblewrap", (sys.executable, "-c", SAYS))
        said: dict[str, Any] = line["said"]
        return said

    return start


MADE = {one.name: one for one in verify_conditions()}


def test_each_condition_is_made(started: Callable[[VerifyCondition], dict[str, Any]]) -> None:
    """And nothing else is changed by it."""
    usual = started(MADE["again"])
    assert (usual["cwd"], usual["PYTHONHASHSEED"], usual["GRADER_SEED_KEY"], usual["loops"]) == ("/", "1", None, 0)
    assert not usual["changed"]
    assert started(MADE["load"]) == {**usual, "loops": LOOPS * len(os.sched_getaffinity(0))}
    together = started(MADE["together"])
    assert together.pop("TMPDIR").endswith("/another temporary folder")
    changes = {
        "changed": True,
        "TZ": "Asia/Kathmandu",
        "LANG": "de_DE.ISO-8859-1",
        "PYTHONHASHSEED": "2",
        "folder": True,
    }
    assert together == {name: value for name, value in {**usual, **changes}.items() if name != "TMPDIR"}


def test_no_loop_is_left(started: Callable[[VerifyCondition], dict[str, Any]]) -> None:
    """Neither after a recording, nor if the one who started them is killed."""
    started(MADE["load"])
    assert started(MADE["again"])["loops"] == 0
    # It holds the output of the one who started it, and ends at once, because that is another process than it is told.
    loop = f"import subprocess, sys; subprocess.Popen([sys.executable, '-c', {verifying.LOOP!r}, str(2**22)])"
    subprocess.run([sys.executable, "-c", loop], capture_output=True, check=True, timeout=300)


# --- failures ---------------------------------------------------------------------------------------------------------


def run(*words: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, ["verify", *words])
    return done.exit_code, done.output


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("nothing-here",), "expected a folder, a .py file or an archive, found nothing there"),
        (("a", "b", "--evidence", "e"), "expected one SUBMISSION, found several"),
        (("a", "--evidence", "e", "--seed", "7"), "leave out the other options"),
        (("a", "--evidence", "e"), "e/evidence.json"),
        (("a", "--seed", "7", "--seed-key", "k"), "--seed and --seed-key exclude each other"),
    ],
)
def test_what_cannot_be_used(
    words: Sequence[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Is said before anything is recorded."""
    monkeypatch.chdir(tmp_path)
    for name in "ab":
        written(tmp_path, {name: REPEATING["plain"]})
    code, output = run(*words)
    assert (code, message in " ".join(output.split())) == (2, True), output


def recorded_by(code: str, path: str) -> Verification:
    """Verify a submission of which other code makes the recordings."""
    program = (sys.executable, "-c", f"import json, sys\ntold = json.load(sys.stdin)\n{code}")
    request = VerifyRequest((path,), GradeRequest("", seed=1), program=program)
    return verify(request, lambda text: None)


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ('sys.exit("no memory")', "recording ended early: no memory"),
        ("sys.exit(7)", "recording ended early: exit code 7"),
        ('print(json.dumps({"problem": "isolation: none holds", "hint": "install it"}))', "isolation: none holds"),
    ],
)
def test_a_first_recording_that_fails_is_no_difference(code: str, message: str, tmp_path: Path) -> None:
    """Nothing was compared: the machine has a problem, and it is said which."""
    (path,) = written(tmp_path, {"ada": REPEATING["plain"]})
    with pytest.raises(HarnessError, match=message):
        recorded_by(code, path)


#: Answers with the same empty trace each time, or as another one does from the second time on.
ANSWERS = """
import os, pathlib
mark = pathlib.Path({mark!r})
times = len(mark.read_text()) if mark.exists() else 0
mark.write_text("x" * (times + 1))
print(json.dumps({{"isolation": "none"}}))
trace = {{"format": "grader/trace/v1", "scenario": "alone", "clock": "virtual", "clock_reason": "", "stop_ns": 5}}
trace |= {{"notes": [], "harness_problem": "", "observations": []}}
line = {{"number": 0, "exercise": "velocity_publisher", "scenario": "alone", "trace": trace}}
if times:
    {then}
print(json.dumps(line))
print(json.dumps({{"number": 0, "sources": {{}}}}))
"""


@pytest.mark.breadth(3, 8)
@pytest.mark.parametrize(
    ("then", "code", "state"),
    [
        ("pass", 0, ConditionState.SAME),
        ('trace["stop_ns"] = 6', 1, ConditionState.DIFFERENT),
        ('trace["clock_reason"] = "it is late"', 1, ConditionState.DIFFERENT),
        ('trace["harness_problem"] = "the machine was too busy"', 3, ConditionState.FAILED),
        ('trace["incomplete"] = True; trace["notes"] = ["a message did not arrive"]', 3, ConditionState.FAILED),
        ('line = {"number": 0, "problem": "no space left", "hint": ""}', 3, ConditionState.FAILED),
        ("sys.exit(1)", 3, ConditionState.FAILED),
        ('line = {"number": 0, "sources": {}}', 3, ConditionState.FAILED),
    ],
)
def test_exit_codes(then: str, code: int, state: ConditionState, tmp_path: Path) -> None:
    """A recording that is missing or failed is no difference, and does not count as the same either."""
    (path,) = written(tmp_path, {"ada": REPEATING["plain"]})
    found = recorded_by(ANSWERS.format(mark=str(tmp_path / "mark"), then=then), path)
    assert verification_exit_code(found) == code, found
    assert {condition.state for condition in found.tried} == {state}
