"""Limits reached by real nodes: told in words, never as a failure of the grader, and with what came before kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tiers import each

from grader.runtime.model.trace import AssessedTrace
from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from hostile import hostile, record

from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import KIB, MIB, NS_PER_S
from grader.runtime.model.trace import FaultKind

pytestmark = pytest.mark.ros

#: Harm begins at the 40th tick, at two seconds.
BEGIN_NS = 2 * NS_PER_S
REST = "the rest was ignored"


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., AssessedTrace]:
    """Record a program that does harm at its 40th tick."""
    tmp_path.chmod(0o755)

    def run_one(harm: str, limits: Limits | None = None, *, busy: bool = False, **fields: Any) -> AssessedTrace:
        folded = "\n".join(f"    {line}" for line in harm.splitlines())
        trace = record(
            session, tmp_path / "s", hostile(later=f"if self.count == 40:\n{folded}"), limits=limits, **fields
        )
        assert not trace.harness_problem or (busy and "too busy" in trace.harness_problem)
        return trace

    return run_one


def words(trace: AssessedTrace) -> str:
    """Return the only fault's text."""
    (fault,) = trace.faults()
    assert fault.t_ns >= BEGIN_NS
    return fault.text


def test_filled_memory_is_told_as_memory(run: Callable[..., AssessedTrace]) -> None:
    """Not as a signal from nowhere; what was published before stays in the trace."""
    trace = run("self.hoard = [bytearray(b'x' * (1 << 20)) for _ in range(5000)]", Limits(memory_bytes=256 * MIB))
    assert words(trace) == "stopped at 256 MiB of memory"
    assert trace.faults()[0].kind is FaultKind.KILLED
    assert len(trace.messages("/cmd_vel")) >= 39
    assert trace.stop_ns == 10 * NS_PER_S


@pytest.mark.long
def test_memory_of_children_counts(run: Callable[..., AssessedTrace]) -> None:
    """Several processes below the limit are together above it."""
    trace = run(
        "import subprocess\n"
        "code = 'import time; a = bytearray(b\"x\" * (90 << 20)); time.sleep(60)'\n"
        "self.children = [subprocess.Popen([sys.executable, '-I', '-S', '-c', code]) for _ in range(3)]\n"
        "time.sleep(0) or [os.read(os.pipe()[0], 1)]",
        Limits(memory_bytes=200 * MIB),
        clock="wall",
        duration_ns=60 * NS_PER_S,  # it ends with the node, however long a busy machine takes to start the children
    )
    assert words(trace) == "stopped at 200 MiB of memory"


@pytest.mark.parametrize(
    ("harm", "said"),
    each(
        [
            ("bytearray(1 << 34)", "MemoryError (the limit is 512 MiB of memory)"),
            (
                "for _ in range(1000): threading.Thread(target=time.sleep, args=(999,), daemon=True).start()",
                "(the limit is 64 processes and threads)",
            ),
            ("self.files = [open('/dev/null') for _ in range(1000)]", "(the limit is 128 open files)"),
            ("open('/tmp/x', 'wb').write(bytes(9 << 20))", "(the limit is 3 MiB in one file)"),
        ],
        4,
    ),
)
def test_an_error_at_a_limit_names_it_and_the_line(run: Callable[..., AssessedTrace], harm: str, said: str) -> None:
    """Python's own words say nothing to a beginner."""
    trace = run(harm, Limits(file_bytes=3 * MIB))
    assert said in words(trace)
    assert trace.faults()[0].line > 0
    assert len(trace.messages("/cmd_vel")) >= 39


@pytest.mark.long
def test_a_full_folder_is_told(run: Callable[..., AssessedTrace]) -> None:
    """Many files below the limit of one file fill a folder too."""
    trace = run("for n in range(9): open(f'/tmp/{n}', 'wb').write(bytes(4 << 20))")
    assert words(trace).endswith("(the limit is 16 MiB in one folder)")


@pytest.mark.long
def test_processor_time_is_told_as_such(run: Callable[..., AssessedTrace]) -> None:
    """Counted by the system, not by what the program says."""
    assert words(run("while True: pass", Limits(processor_ns=2 * NS_PER_S))) == "stopped at 2 s of processor time"


@pytest.mark.long
def test_real_time_is_told_as_such(run: Callable[..., AssessedTrace]) -> None:
    """A node that keeps the grader waiting is at fault itself, unless the machine gave it no time."""
    trace = run("time.sleep(99)", Limits(wall_ns=5 * NS_PER_S), busy=True, clock="wall")
    assert trace.harness_problem or words(trace) == "stopped after 5 s of real time"


def test_a_flood_of_messages_ends_the_recording_in_words(run: Callable[..., AssessedTrace]) -> None:
    """What came before the flood stays."""
    trace = run("for _ in range(30000): self.publisher.publish(Twist())", Limits(messages=500))
    (mark,) = trace.marks("limit")
    assert mark.detail == f"more than 500 messages on /cmd_vel: {REST}"
    assert mark.detail in trace.notes
    assert len(trace.messages("/cmd_vel")) == 500
    assert BEGIN_NS <= trace.stop_ns < 10 * NS_PER_S


@pytest.mark.long
def test_a_large_message_is_counted_but_not_read(run: Callable[..., AssessedTrace]) -> None:
    """Its time and topic are evidence, its five megabytes are nobody's; everything else goes on."""
    trace = run(
        "from std_msgs.msg import String\n"
        "self.big = self.create_publisher(String, '/big', 10)\n"
        "self.big.publish(String(data='x' * (5 << 20)))",
        Limits(message_bytes=32 * KIB),
    )
    (big,) = trace.messages("/big")
    assert (big.cdr, big.value) == (b"", {})
    assert len(trace.messages("/cmd_vel")) == 199
    assert trace.notes == ("/big: the content of messages larger than 32 KiB was ignored (1 in all)",)


@pytest.mark.nightly
def test_output_without_end_is_cut_and_the_run_goes_on(run: Callable[..., AssessedTrace]) -> None:
    """A gigabyte costs the student nothing but the output."""
    trace = run("for _ in range(1000): os.write(1, b'y\\n' * (1 << 19))", Limits(output_bytes=MIB, lines=1000))
    assert len(trace.lines()) == 1000
    assert len(trace.messages("/cmd_vel")) == 199
    assert f"a.py: more than 1 MiB on stdout: {REST}" in trace.notes
    assert f"a.py: more than 1,000 lines and log records: {REST}" in trace.notes


@pytest.mark.long
def test_log_records_without_end_are_cut_and_the_run_goes_on(run: Callable[..., AssessedTrace]) -> None:
    """Records count as lines do."""
    trace = run("for n in range(3000): self.get_logger().info(str(n))", Limits(lines=1000))
    assert [r.text for r in trace.records()] == [str(n) for n in range(1000)]
    assert len(trace.messages("/cmd_vel")) == 199


@pytest.mark.long
def test_participants_without_end_are_told(run: Callable[..., AssessedTrace]) -> None:
    """A process may have several contexts, and not any number of them."""
    trace = run(
        "from rclpy.context import Context\n"
        "self.kept = []\n"
        "for n in range(6):\n"
        "    context = Context()\n"
        "    context.init()\n"
        "    node = Node(f'n{n}', context=context)\n"
        "    self.kept += [context, node, node.create_publisher(Twist, f'/t{n}', 10)]",
        Limits(participants=4, processes=500),
    )
    assert [mark.detail for mark in trace.marks("limit")] == [f"more than 4 DDS participants: {REST}"]


@pytest.mark.long
def test_a_hundred_and_fifty_participants_are_ended_by_their_threads(run: Callable[..., AssessedTrace]) -> None:
    """Each brings a dozen of them; the C++ below aborts, and the fault says at which limit."""
    trace = run(
        "from rclpy.context import Context\n"
        "self.kept = []\n"
        "for n in range(150):\n"
        "    self.kept.append(Context())\n"
        "    self.kept[-1].init()\n"
        "    self.kept.append(Node(f'n{n}', context=self.kept[-1]))"
    )
    assert "(the limit is 64 processes and threads)" in words(trace)


@pytest.mark.long
def test_endpoints_without_end_are_told(run: Callable[..., AssessedTrace]) -> None:
    """The grader's node would have to subscribe to every one of them."""
    trace = run("self.many = [self.create_publisher(Twist, f'/t{n}', 10) for n in range(1500)]")
    assert [mark.detail for mark in trace.marks("limit")] == [
        f"more than 1,000 endpoints and parameters of a.py: {REST}"
    ]


def test_a_process_that_halts_itself_is_ended_at_once(run: Callable[..., AssessedTrace]) -> None:
    """Nobody waits for it to come back."""
    assert words(run("os.kill(os.getpid(), 19)")) == "stopped: a signal had halted it for good"
