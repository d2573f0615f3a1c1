"""Attacks of real nodes on the grader's own processes: it survives them, and nothing they say becomes evidence."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hostile import HOST_LINE
from tiers import NIGHTLY, but, each, more

from grader.runtime.model.trace import AssessedTrace
from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from hostile import MS, hostile, record, staging

from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import FaultKind
from grader.runtime.session import open_session
from grader.runtime.stimuli.numbers import PlannedNumbers
from grader.runtime.usage import usage

pytestmark = pytest.mark.ros

#: What a program needs to speak RTPS in the name of any writer: a submessage to every reader on the machine, which
#: is DATA, or a GAP over so many sequence numbers.
FORGE = """
import struct
def forge(gid, number, payload, writer=None, flags=5):
    head = struct.pack("<HH4s4siI", 0, 16, bytes(4), writer or bytes(gid[12:16]), 0, number)
    send_forged(gid, 0x15, flags, head + payload)
def forge_gap(gid, number, length):
    numbers = struct.pack("<iIiII", *divmod(number, 1 << 32), *divmod(number + length, 1 << 32), 0)
    send_forged(gid, 0x08, 1, bytes(4) + bytes(gid[12:16]) + numbers)
def send_forged(gid, kind, flags, data):
    packet = b"RTPS\\x02\\x03\\x01\\x0f" + bytes(gid[:12]) + struct.pack("<BBH", kind, flags, len(data)) + data
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    base = 7400 + 250 * int(os.environ["ROS_DOMAIN_ID"])
    for port in range(base, base + 40):
        try:
            sender.sendto(packet, ("127.0.0.1", port))
        except OSError:
            pass
"""
SUBSCRIBER = """
import os, socket, time, rclpy
from rclpy.node import Node
from std_msgs.msg import Float32
class Listener(Node):
    def __init__(self):
        super().__init__("listener")
        self.create_subscription(Float32, "/temperature", self.hear, 10)
        self.create_timer(0.1, self.tick)
        self.heard = 0
    def hear(self, message):
        self.heard += 1
        print(round(message.data, 1), flush=True)
    def tick(self):
        pass
"""


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., AssessedTrace]:
    """Record programs together; whatever they do, the grader does not fail."""
    tmp_path.chmod(0o755)

    def run_all(*programs: str, **fields: Any) -> AssessedTrace:
        trace = record(session, tmp_path / "s", *programs, **fields)
        assert trace.harness_problem == ""
        return trace

    return run_all


FLOODS = [
    "while True: send(b'{}\\n' * 10000)",
    "while True: send(b'x' * 100000)",
    'while True: send(b\'{"kind": "note", "text": "hello"}\\n\' * 1000)',
]
JUNK = ["send(b'x' * 100 + b'\\n')", "send(b'[' * 100000 + b'\\n')", "send(b'\\xff\\xfe\\n')"]


@pytest.mark.breadth(1, 2)
@pytest.mark.parametrize(
    ("said", "clock"),
    [
        *but([(JUNK[1], "virtual")], [(said, "virtual") for said in (*FLOODS, *JUNK)]),
        *more([(FLOODS[0], "wall")]),
        *more([(said, "wall") for said in FLOODS[1:]], NIGHTLY),
    ],
)
def test_junk_on_the_line_ends_the_process_that_sent_it(
    run: Callable[..., AssessedTrace], said: str, clock: str
) -> None:
    """Not JSON, too deep, too much: its process is ended, and everybody else goes on."""
    later = f"if self.count == 40:\n    send = line().sendall\n    {said}"
    trace = run(hostile(before=HOST_LINE, later=later), clock=clock, duration_ns=4 * NS_PER_S)
    (fault,) = trace.faults()
    assert (fault.kind, fault.text) == (FaultKind.KILLED, "stopped: it no longer answered the grader")
    assert len(trace.messages("/cmd_vel")) >= 39


@pytest.mark.parametrize(
    "report",
    each(
        [
            '{"kind": "note", "text": "x", "now_ns": 1e400, "cpu_ns": NaN}',
            '{"kind": "note", "text": "x", "now_ns": -99999999999999999999999999}',
            '{"kind": "note", "text": {"a": []}, "sent": {"topic /cmd_vel": 1e308}}',
            '{"kind": "fault", "text": [1], "file": {}, "line": 1e300, "frames": [[]], "t_ns": 99}',
            '{"kind": "fault", "text": "' + "x" * 100_000 + '", "line": 999999999999999999999}',
        ],
        5,
    ),
)
def test_absurd_reports_change_nothing_that_counts(run: Callable[..., AssessedTrace], report: str) -> None:
    """Times, counts and places of a report are bounded before they are used; messages are those that came."""
    trace = run(hostile(before=HOST_LINE, later=f"if self.count == 40: line().sendall({report.encode()!r} + b'\\n')"))
    assert len(trace.messages("/cmd_vel")) == 199
    assert all(len(o.text) <= 500 and 0 <= o.t_ns <= 10 * NS_PER_S for o in trace.faults())


@pytest.mark.nightly
def test_a_report_of_the_far_future_only_ends_the_senders_own_time(run: Callable[..., AssessedTrace]) -> None:
    """Its process sleeps for ever, as it asked; the other one is stepped as before."""
    report = (
        '{"kind": "idle", "wake_ns": 99999999999999999999999999, "sent": {"topic /cmd_vel": 3, "topic /y": -5}, '
        '"endpoints": [1, null, {"kind": "publisher"}, []]}'
    )
    bad = hostile(before=HOST_LINE, later=f"if self.count == 40: line().sendall({report.encode()!r} + b'\\n')")
    good = hostile().replace("/cmd_vel", "/other")
    trace = run(bad, good)
    assert len(trace.messages("/other")) == 199
    assert len(trace.messages("/cmd_vel")) <= 199


@pytest.mark.long
def test_hidden_work_is_charged(run: Callable[..., AssessedTrace]) -> None:
    """A program that has its host say that it computes nothing is for the wall clock all the same."""
    lie = "import _grader_host.virtual as virtual\nvirtual.VirtualTime._charge = lambda self: None"
    work = (
        "import resource\nend = resource.getrusage(0).ru_utime + 0.3\nwhile resource.getrusage(0).ru_utime < end: pass"
    )
    trace = run(hostile(harm=lie, later=work), duration_ns=2 * NS_PER_S, stop_when_unfit=True)
    assert "processor time" in trace.clock_reason


def test_bytes_that_are_no_message_have_no_content(run: Callable[..., AssessedTrace]) -> None:
    """They came, and that is all: no check finds a right value in them."""
    trace = run(hostile(later="self.publisher.publish(b'\\x00\\x01\\x00\\x00\\xff')"))
    values = [m.value for m in trace.messages("/cmd_vel")]
    assert values.count({}) == 199
    assert trace.notes == (
        "/cmd_vel: the content of messages that are not what their type says was ignored (199 in all)",
    )


@pytest.mark.long
def test_garbage_on_the_ports_disturbs_nobody(run: Callable[..., AssessedTrace]) -> None:
    """Random bytes, some with the beginning of RTPS, as fast as a process can send them."""
    harm = """
        import ctypes
        code = '''
import os, socket
sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
base = 7400 + 250 * int(os.environ["ROS_DOMAIN_ID"])
while True:
    for port in range(base, base + 24):
        for head in (b"", b"RTPS\\\\x02\\\\x03\\\\x01\\\\x0f"):
            try: sender.sendto(head + os.urandom(60), ("127.0.0.1", port))
            except OSError: pass
'''
        words = [sys.executable, "-I", "-S", "-c", code]
        arguments = (ctypes.c_char_p * 6)(*[word.encode() for word in words], None)
        variables = [f"{name}={value}".encode() for name, value in os.environ.items()]
        environment = (ctypes.c_char_p * (len(variables) + 1))(*variables, None)
        pid = ctypes.c_int()
        ctypes.CDLL(None).posix_spawn(ctypes.byref(pid), words[0].encode(), None, None, arguments, environment)
        assert pid.value
    """
    assert len(run(hostile(harm=harm)).messages("/cmd_vel")) == 199


@pytest.mark.long
def test_a_clock_and_events_of_somebody_else_change_nothing(run: Callable[..., AssessedTrace]) -> None:
    """The grader's node follows no /clock, and believes no parameter event."""
    harm = """
        from rosgraph_msgs.msg import Clock
        from rcl_interfaces.msg import ParameterEvent
        self.clock_, self.events = self.create_publisher(Clock, "/clock", 10), None
        self.events = self.create_publisher(ParameterEvent, "/parameter_events", 10)
        self.Clock, self.Event = Clock, ParameterEvent
    """
    later = """
        message = self.Clock()
        message.clock.sec = 10**9
        self.clock_.publish(message)
        self.events.publish(self.Event(node="/x"))
    """
    trace = run(hostile(harm=harm, later=later))
    times = [m.t_ns for m in trace.messages("/cmd_vel")]
    assert len(times) == 199
    assert {b - a for a, b in pairwise(times)} == {50 * MS}


@pytest.mark.long
def test_the_graders_node_offers_nothing_to_call(run: Callable[..., AssessedTrace]) -> None:
    """No parameters, no log levels, no descriptions of types: what is not there cannot be called."""
    later = """
        if self.count == 40:
            for name, space in self.get_node_names_and_namespaces():
                if name != "velocity_publisher":
                    print(name[:9], self.get_service_names_and_types_by_node(name, space), flush=True)
    """
    assert [line.text for line in run(hostile(later=later)).lines()] == ["_ros2cli_ []"]


@pytest.mark.long
def test_the_graders_name_gives_no_power(run: Callable[..., AssessedTrace]) -> None:
    """A node of the same name hides from the graph, which helps nobody; its messages count as everybody's."""
    later = """
        if self.count == 20:
            (name,) = [n for n in self.get_node_names() if n.startswith("_ros2cli")]
            self.twin = Node(name)
            self.second = self.twin.create_publisher(Twist, "/cmd_vel", 10)
        if self.count > 20:
            self.second.publish(Twist())
    """
    trace = run(hostile(later=later), duration_ns=3 * NS_PER_S)
    values = [m.value["linear"]["x"] for m in trace.messages("/cmd_vel")]
    assert values.count(0.5) == 59
    assert values.count(0.0) > 0


def listener(tick: str) -> str:
    """Return a program that hears temperatures and does something ten times a second."""
    body = "\n".join(f"        {line}" for line in tick.strip().splitlines())
    program = SUBSCRIBER.replace("    def tick(self):\n        pass\n", f"    def tick(self):\n{body}\n")
    return FORGE + program + "rclpy.init()\nrclpy.spin(Listener())\n"


STREAM = PlannedNumbers("/temperature", "std_msgs/msg/Float32", 500 * MS, 200 * MS, 1, ((21.0, 0), (26.0, 0)) * 5)


def test_forged_stimuli_are_no_evidence(run: Callable[..., AssessedTrace]) -> None:
    """What the trace calls delivered is what the grader published, not what came in its writer's name."""
    forged = listener("""
for info in self.get_publishers_info_by_topic("/temperature"):
    forge(info.endpoint_gid, self.heard + 1, bytes([0, 1, 0, 0]) + struct.pack("<f", 99.0))
""")
    trace = run(forged, stimuli=(STREAM,), duration_ns=3 * NS_PER_S, clock="wall")
    assert "99.0" in {line.text for line in trace.lines()}, "the forgery itself has to succeed"
    assert [d.value["data"] for d in trace.deliveries("/temperature")] == [21.0, 26.0] * 5


@pytest.mark.nightly
def test_a_forged_farewell_of_the_grader_ends_no_grading(run: Callable[..., AssessedTrace]) -> None:
    """A student who has other nodes believe that the grader left loses what they would have been heard to say."""
    farewell = listener("""
for info in self.get_publishers_info_by_topic("/temperature"):
    guid = bytes(info.endpoint_gid[:12]) + bytes([0, 0, 1, 0xc1])
    qos = struct.pack("<HH", 0x70, 16) + guid + struct.pack("<HHI", 0x71, 4, 0x03000000) + struct.pack("<HH", 1, 0)
    key = bytes([0, 3, 0, 0]) + struct.pack("<HH", 0x50, 16) + guid + struct.pack("<HH", 1, 0)
    forge(info.endpoint_gid, time.monotonic_ns() >> 20, qos + key, bytes([0, 1, 0, 0xc2]), flags=11)
print(len(self.get_node_names()), flush=True)
""")
    good = hostile()
    trace = run(farewell, good, stimuli=(STREAM,), duration_ns=3 * NS_PER_S)
    assert "2" in {line.text for line in trace.lines()}, "the farewell itself has to be believed"
    assert [d.value["data"] for d in trace.deliveries("/temperature")] == [21.0, 26.0] * 5
    assert len(trace.messages("/cmd_vel")) <= 59


@pytest.mark.nightly
def test_a_flood_on_the_wall_clock_is_a_limit_and_no_failure_of_the_machine(run: Callable[..., AssessedTrace]) -> None:
    """The reference beside the nodes is not held up by what they send."""
    flood = hostile(
        harm="""
        def flood():
            while True: self.publisher.publish(Twist())
        threading.Thread(target=flood, daemon=True).start()
    """
    )
    trace = run(flood, clock="wall", limits=Limits(messages=2000))
    assert [mark.detail for mark in trace.marks("limit")] == [
        "more than 2,000 messages on /cmd_vel: the rest was ignored"
    ]


@pytest.mark.long
def test_a_flood_of_giants_leaves_the_grader_standing(run: Callable[..., AssessedTrace]) -> None:
    """Six megabytes at a time; each is counted, none is kept."""
    harm = (
        "from std_msgs.msg import String\nself.big = self.create_publisher(String, '/big', 100); self.String = String"
    )
    trace = run(
        hostile(harm=harm, later="if self.count < 10: self.big.publish(self.String(data='x' * (6 << 20)))"),
        duration_ns=2 * NS_PER_S,
    )
    assert {m.cdr for m in trace.messages("/big")} == {b""}
    assert len(trace.messages("/cmd_vel")) == 39


@pytest.mark.long
@pytest.mark.parametrize("clock", [*more(["wall"], NIGHTLY), "virtual"])
def test_nobody_is_waited_for_in_another_domain(session: RecordingSession, tmp_path: Path, clock: str) -> None:
    """A message waits for its subscription to be matched; where the grader is not, there will be none."""
    tmp_path.chmod(0o755)
    elsewhere = """
        self.others = []
        for domain in (1, 2, 3):
            context = rclpy.Context()
            rclpy.init(context=context, domain_id=domain)
            node = rclpy.create_node(f"elsewhere_{domain}", context=context)
            self.others.append((node, node.create_publisher(Twist, "/cmd_vel", 10)))
    """
    later = "if self.count == 3:\n    for _, publisher in self.others: publisher.publish(Twist())"
    program = hostile(harm=elsewhere, later=later)
    trace = record(session, tmp_path / "s", program, clock=clock, duration_ns=5 * NS_PER_S, first_message_on="/cmd_vel")
    assert len(trace.messages("/cmd_vel")) > 10, "three waits take longer than the recording"
    assert [note.partition(" is in the ROS domain ")[2][:1] for note in trace.notes] == ["1", "2", "3"]
    assert not trace.incomplete


#: One packet of 52 bytes, after a while, in the name of the program's own publisher.
GAP = """
if self.count == 20:
    (info,) = self.get_publishers_info_by_topic("/cmd_vel")
    forge_gap(info.endpoint_gid, 22, 30_000_000)
"""


@pytest.mark.long
def test_a_gap_over_millions_of_messages_does_not_fill_the_grader(run: Callable[..., AssessedTrace]) -> None:
    """The middleware would note each of them: the worker is ended, and what brings two of them there is the node."""
    most_bytes = 0
    done = threading.Event()

    def look() -> None:
        nonlocal most_bytes
        while not done.wait(0.02):
            most_bytes = max(
                most_bytes, *(usage([pid]).memory_bytes for pid in (os.getpid(), *workers_of(os.getpid())))
            )

    watcher = threading.Thread(target=look)
    watcher.start()
    try:
        trace = run(hostile(before=FORGE, later=GAP), hostile().replace("/cmd_vel", "/other"))
    finally:
        done.set()
        watcher.join()
    assert {(fault.process, fault.kind, fault.text) for fault in trace.faults()} == {
        (
            name,
            FaultKind.KILLED,
            "stopped: receiving what the nodes sent took the grader's process to 300 MiB of memory",
        )
        for name in ("a.py", "b.py")
    }
    # It is ended at 300 MiB, at the next look, which comes after 50 ms; a busy machine may be late with it.
    assert most_bytes < 1200 << 20, "30 million sequence numbers take 2.4 GiB"
    assert len(run(hostile()).messages("/cmd_vel")) == 199, "the next scenario has a fresh worker"


#: Has its host claim an endpoint more at every tick, which does not exist.
GHOSTS = """
import inspect
from _grader_host.endpoints import Claim, Endpoints
destroy = inspect.getclosurevars(Node.destroy_node).nonlocals["method"]
self.endpoints = inspect.getclosurevars(destroy).nonlocals["before"][0].__self__._ros.endpoints
claims = Endpoints.claims
Endpoints.claims = lambda it, domain: [
    *claims(it, domain),
    *(Claim("KIND", f"/ghost{n}", "std_msgs/msg/String") for n in range(self.count)),
    *[Claim("publisher", "/cmd_vel", "geometry_msgs/msg/Twist")] * self.count,
]
"""


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["publisher", pytest.param("client", marks=pytest.mark.nightly)])
def test_endpoints_that_do_not_exist_are_soon_waited_for_only_briefly(
    run: Callable[..., AssessedTrace], kind: str
) -> None:
    """One more at each tick: in full patience the nodes' real time would be over before the scenario is."""
    ghosts = hostile(harm=GHOSTS.replace("KIND", kind), later="self.endpoints.changed = True")
    trace = run(ghosts, duration_ns=4 * NS_PER_S, limits=Limits(wall_ns=60 * NS_PER_S))
    assert trace.faults() == ()
    assert len(trace.messages("/cmd_vel")) == 79


#: What names a worker in its command, and further on in the commands that start it, such as `prlimit` and `bwrap`.
WORKER = b"-m", b"grader.runtime.worker.worker_main"


def workers_of(pid: int, *, starting: bool = True) -> list[int]:
    """Return the worker processes below a process, innermost last, with those that start them or without.

    Who kills workers kills those without: a `bwrap` that ends while it starts a worker leaves it without a parent, and
    then nobody finds it here.
    """
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            words = (path / "cmdline").read_bytes().split(b"\0")
        except OSError:  # it has ended, before or after its file was opened
            continue
        at = words.index(WORKER[1]) if WORKER[1] in words else 0
        if at and (starting or (b"python" in words[0] and words.index(WORKER[0]) == at - 1)):
            found.append(int(path.name))
    return [p for p in found if pid in ancestors(p)]


def workers_beside(others: set[int], *, starting: bool = True) -> list[int]:
    """Return the workers below this process that are none of the others, which other sessions have, nor below one."""
    return [p for p in workers_of(os.getpid(), starting=starting) if others.isdisjoint((p, *ancestors(p)))]


def ancestors(pid: int) -> list[int]:
    """Return the processes above a process."""
    above = []
    while pid > 1:
        try:
            pid = int(Path(f"/proc/{pid}/stat").read_text(errors="replace").rpartition(")")[2].split()[1])
        except (OSError, IndexError):
            break
        above.append(pid)
    return above


def test_a_worker_that_is_killed_costs_nobody_a_point(tmp_path: Path) -> None:
    """Its scenario is recorded again by another worker; what a killed one had is gone with it."""
    tmp_path.chmod(0o755)
    others = {*workers_of(os.getpid())}
    with open_session("auto") as opened:
        session = staging(opened)
        killed = threading.Event()

        def kill() -> None:
            while not killed.wait(0.05):
                if (tmp_path / "s" / "a.py").exists() and (workers := workers_beside(others, starting=False)):
                    killed.set()
                    os.killpg(os.getpgid(workers[0]), signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        trace = record(session, tmp_path / "s", hostile())
        killer.join()
    assert killed.is_set()
    assert trace.harness_problem == ""
    assert len(trace.messages("/cmd_vel")) == 199


@pytest.mark.long
def test_a_worker_that_is_always_killed_decides_nothing(tmp_path: Path) -> None:
    """No trace, no marks: a problem of ours."""
    tmp_path.chmod(0o755)
    others = {*workers_of(os.getpid())}
    with open_session("auto") as opened:
        session = staging(opened)
        done = threading.Event()

        def kill() -> None:
            while not done.wait(0.02):
                for worker in workers_beside(others, starting=False):
                    with contextlib.suppress(ProcessLookupError):  # the group: no child that was just made outlives it
                        os.killpg(os.getpgid(worker), signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        # However seldom a busy machine lets the killer run, this program does not end before.
        trace = record(session, tmp_path / "s", hostile(harm="while True: pass"))
        done.set()
        killer.join()
    assert trace.harness_problem.startswith("worker: expected a trace of alone, found none")
    assert trace.observations == ()


@pytest.mark.nightly
def test_scenarios_leave_no_descriptor_and_no_process(tmp_path: Path) -> None:
    """After ten more, this process and its worker hold what they held before."""
    tmp_path.chmod(0o755)
    hogs = [hostile(), hostile(later="if self.count == 9: os.kill(os.getpid(), 9)")]

    others = {*workers_of(os.getpid())}

    def held() -> tuple[int, ...]:
        pids = (os.getpid(), *sorted(workers_beside(others)))
        return tuple(len(list(Path(f"/proc/{pid}/fd").iterdir())) for pid in pids)

    with open_session("auto", 1) as opened:  # of several workers, those that are worn are replaced later
        own = staging(opened)
        counts = []
        for _ in range(6):
            for program in hogs:
                assert record(own, tmp_path / "s", program, duration_ns=NS_PER_S).harness_problem == ""
            counts.append(held())
    assert counts[-1] == counts[0]
