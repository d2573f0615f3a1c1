"""Whatever holds a node up in reality sends it to the wall clock, and nothing else does; on real nodes."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tiers import but, each

from grader.runtime.model.trace import AssessedTrace
from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from computing import library_call
from hostile import hostile, record

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.worker.virtual_runner import BUSY, OUTSIDE

pytestmark = pytest.mark.ros

SOCKET = "self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)\nself.socket.bind(('127.0.0.1', 0))\n"
#: What a node does at each tick of its 20 Hz timer, after what it does once; waits of 100 ms, where it has 50.
WAITS = {
    "socket": (SOCKET + "self.socket.settimeout(0.1)", "try: self.socket.recv(10)\nexcept OSError: pass"),
    "select": (SOCKET, "import select\nselect.select([self.socket], [], [], 0.1)"),
    "poll": (
        SOCKET + "import select\nself.poll = select.poll()\nself.poll.register(self.socket, select.POLLIN)",
        "self.poll.poll(100)",
    ),
    "selectors": (
        SOCKET + "import selectors\nself.s = selectors.DefaultSelector()\nself.s.register(self.socket, 1)",
        "self.s.select(0.1)",
    ),
    "usleep": ("import ctypes\nself.libc = ctypes.CDLL(None)", "self.libc.usleep(100_000)"),
    "subprocess": ("", "import subprocess\nsubprocess.run([sys.executable, '-c', 'import time; time.sleep(.1)'])"),
    "captured": (
        "",
        "import subprocess\nsubprocess.run([sys.executable, '-c', 'import time; time.sleep(.1)'], capture_output=True)",
    ),
    "fork": (
        "",
        "import multiprocessing\np = multiprocessing.Process(target=time.sleep, args=(.1,))\np.start()\np.join()",
    ),
    "spawn": (
        "",
        "import multiprocessing as m\nm.get_context('spawn').Process(target=time.sleep, args=(.1,)).start()",
    ),
    "forkserver": (
        "",
        "from multiprocessing import get_context\np = get_context('forkserver').Process(target=print)\np.start()",
    ),
    "signal": ("", "import signal\nsignal.sigtimedwait([signal.SIGUSR1], 0.1)"),
}


WORK = {
    "computing": ("", "end = os.times().user + 0.07\nwhile os.times().user < end: pass"),
    "hidden": (
        """
        for name, module in list(sys.modules.items()):
            if name.endswith("virtual") and hasattr(module, "VirtualTime"):
                lies = lambda self, say=module.VirtualTime.progress: say(self)._replace(charged=True, moved=10)
                module.VirtualTime.progress = lies
        """,
        "end = os.times().user + 0.07\nwhile os.times().user < end: pass",
    ),
    "library": ("import hashlib", library_call(0.1)),
}


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., AssessedTrace]:
    tmp_path.chmod(0o755)

    def run_one(harm: str, later: str, **fields: Any) -> AssessedTrace:
        program = hostile(harm=harm, later=later)
        return record(
            session, tmp_path / "s", program, **{"duration_ns": 3 * NS_PER_S, "stop_when_unfit": True, **fields}
        )

    return run_one


@pytest.mark.breadth(1, 4)
@pytest.mark.parametrize(("once", "later"), but([WAITS["usleep"]], WAITS.values()), ids=WAITS)
def test_waiting_outside_of_virtual_time_is_for_the_wall_clock(
    run: Callable[..., AssessedTrace], once: str, later: str
) -> None:
    assert run(once, later).clock_reason.startswith(OUTSIDE)  # and then what the program did, at which line


@pytest.mark.breadth(0, 1)
@pytest.mark.parametrize(("once", "later"), but([WORK["computing"]], WORK.values()), ids=WORK)
def test_long_computing_is_for_the_wall_clock(run: Callable[..., AssessedTrace], once: str, later: str) -> None:
    assert run(once, later).clock_reason == BUSY


@pytest.mark.long
def test_a_rare_block_that_delays_other_timers_is_noticed(run: Callable[..., AssessedTrace]) -> None:
    """200 ms once a second: three of twenty messages a second would come late."""
    assert run("", "if self.count % 20 == 0: __import__('ctypes').CDLL(None).usleep(200_000)").clock_reason == OUTSIDE


HOST = """
kept = [cell.cell_contents for cell in time.sleep.__call__.__closure__]
self.time = next(one._ask_for_time.__self__ for one in kept if hasattr(one, "_ask_for_time"))
"""
ARRIVED = """
import ctypes
for _ in range(10):
    ctypes.CDLL(None).usleep(10_000)
    self.time.running = False
    self.time._link._socket.sendall(b'{"kind": "arrived"}\\n')
"""
MATCHING = """
self.graph = self.time._ros.graph
wait = self.graph.await_matches
def slowly(*args):
    __import__("ctypes").CDLL(None).usleep(450_000)
    return wait(*args)
self.graph.await_matches = slowly
"""
AN_ENDPOINT = "self.made = self.create_publisher(Twist, f'/x{self.count % 2}', 10)"


@pytest.mark.parametrize(
    ("once", "later"), each([(HOST, ARRIVED), (HOST + MATCHING, AN_ENDPOINT)], 2), ids=["arrived", "matching"]
)
def test_what_a_process_says_hides_no_work(run: Callable[..., AssessedTrace], once: str, later: str) -> None:
    """That messages arrived, or that it waits for matches: neither takes as long as this."""
    assert run(once, later).clock_reason.startswith(OUTSIDE)  # and then what the program did, at which line


LOOP = """
import threading
def run():
    while True:
        self.tick()
        time.sleep(0.05)
self.destroy_timer(self.timer)
threading.Thread(target=run, daemon=True).start()
"""
AGAIN = "self.timer.cancel()\n{}\nself.timer.reset()"
COMPUTING = library_call(0.012)


@pytest.mark.parametrize(
    ("once", "later"), each([(LOOP, COMPUTING), ("", AGAIN.format(COMPUTING))], 2), ids=["loop", "again"]
)
def test_work_that_puts_off_the_next_message_is_for_the_wall_clock(
    run: Callable[..., AssessedTrace], once: str, later: str
) -> None:
    """Ten milliseconds fit between two ticks of a timer; a pause is counted from their end."""
    assert run(once, later).clock_reason == BUSY


@pytest.mark.long
def test_work_before_a_deadline_puts_off_nothing(run: Callable[..., AssessedTrace]) -> None:
    """A loop that sleeps until its next moment makes up for its work, on either clock."""
    until = LOOP.replace("def run():\n", "def run():\n    due = time.monotonic()\n")
    until = until.replace("time.sleep(0.05)", "due += 0.05\n        time.sleep(max(0.0, due - time.monotonic()))")
    assert "due - " in until
    assert run(until, COMPUTING).clock_reason == ""


POLLS = """
import threading
def run():
    due = time.perf_counter()
    while True:
        rclpy.ok()
        if time.perf_counter() >= due:
            due += 0.05
            self.tick()
self.destroy_timer(self.timer)
threading.Thread(target=run, daemon=True).start()
"""


@pytest.mark.breadth(0, 1)
@pytest.mark.long
@pytest.mark.parametrize(("later", "reason"), [("", ""), ("sum(range(12_000_000))", BUSY)], ids=["polls", "works"])
def test_polls_of_a_busy_loop_are_no_work_but_work_among_them_is(
    run: Callable[..., AssessedTrace], later: str, reason: str
) -> None:
    """On a real clock a busy loop polls as often as there is time for, and is late by what it computes only."""
    assert run(POLLS, later).clock_reason == reason


@pytest.mark.long
def test_a_loop_that_only_publishes_stays_in_virtual_time(run: Callable[..., AssessedTrace]) -> None:
    assert run(LOOP, "self.get_logger().info('x')").clock_reason == ""


@pytest.mark.parametrize(
    "later",
    but(
        ["time.sleep(0.03)"],
        [
            "",
            "time.sleep(0.03)",
            "sum(range(20_000))",
            "time.sleep(0.001)\nself.get_logger().info('x')",
            "open(__file__).read()",
        ],
    ),
)
def test_ordinary_nodes_stay_in_virtual_time(run: Callable[..., AssessedTrace], later: str) -> None:
    trace = run("", later)
    assert trace.clock_reason == ""
    assert len(trace.messages("/cmd_vel")) >= 59


@pytest.mark.nightly
def test_a_slow_start_delays_nothing(run: Callable[..., AssessedTrace]) -> None:
    """What a node does before it first waits is no lateness."""
    assert run("end = os.times().user + 1.5\nwhile os.times().user < end: pass", "").clock_reason == ""
