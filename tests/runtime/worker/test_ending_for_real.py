"""What nodes publish, answer and ask before they go is in the trace, however they go; on real DDS."""

import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tiers import NIGHTLY, but, each, more

from grader.runtime.model.trace import AssessedTrace, Endpoint
from grader.runtime.plan import Plan
from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from hostile import MS, planned, record
from side_by_side import rows_of

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.stimuli.calls import PlannedCalls
from grader.runtime.stimuli.goals import PlannedGoal
from grader.runtime.stimuli.messages import PlannedMessages
from grader.runtime.stimuli.server import PlannedServer

pytestmark = pytest.mark.ros

BEFORE = """
import gc, os, signal, sys, threading, time
import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile, DurabilityPolicy
from std_msgs.msg import String
from std_srvs.srv import Trigger

def burst(publisher, count, start=0):
    for number in range(start, start + count):
        publisher.publish(String(data=str(number)))
"""

TALKER = "rclpy.init()\nnode = Node('talker')\npublisher = node.create_publisher(String, '/words', 10)\n"
#: How a program goes that has just published ten messages in a row; `node` and `publisher` are its own.
ENDINGS = {
    "destroy_node": "node.destroy_node()\nrclpy.shutdown()",
    "destroy_publisher": "node.destroy_publisher(publisher)\ntime.sleep(0.2)\nos._exit(0)",
    "publisher_destroy": "publisher.destroy()\nos._exit(0)",
    "shutdown": "rclpy.shutdown()",
    "try_shutdown": "rclpy.try_shutdown()",
    "return": "",
    "sys_exit": "sys.exit(3)",
    "exception": "raise RuntimeError('over')",
    "hard_exit": "os._exit(0)",
    "killed": "os.kill(os.getpid(), signal.SIGKILL)",
    "terminated": "os.kill(os.getpid(), signal.SIGTERM)",
    "aborted": "os.abort()",
    "interrupted": "signal.raise_signal(signal.SIGINT)",
    "collected": "del publisher, node\ngc.collect()\ntime.sleep(1)",
    "exit_in_thread": "threading.Thread(target=lambda: os._exit(0)).start()\ntime.sleep(1)",
}

#: Longer than any of these programs runs on the wall clock: its recording ends with it, also on a busy machine.
ITS_END_NS = 60 * NS_PER_S


def numbers(trace: AssessedTrace, topic: str = "/words") -> list[int]:
    return [int(message.value["data"]) for message in trace.messages(topic)]


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., AssessedTrace]:
    tmp_path.chmod(0o755)

    def run_all(*programs: str, **fields: Any) -> AssessedTrace:
        whole = [BEFORE + textwrap.dedent(program) for program in programs]
        trace = record(session, tmp_path / "s", *whole, **{"duration_ns": 3 * NS_PER_S, **fields})
        assert trace.harness_problem == ""
        return trace

    return run_all


def burst_and_end(folder: Path, ending: str) -> Plan:
    main = TALKER + "burst(publisher, 10)\n" + ENDINGS[ending]
    program = "def main():\n" + textwrap.indent(main, "    ") + "\nmain()\n"
    return planned(folder, BEFORE + program, duration_ns=3 * NS_PER_S)


@pytest.mark.breadth(2, 4)
@pytest.mark.rule(16)
@rows_of(burst_and_end)
@pytest.mark.parametrize("ending", but(["destroy_node", "hard_exit", "killed", "exit_in_thread"], ENDINGS))
def test_what_was_published_before_the_end_is_in_the_trace(trace: AssessedTrace, ending: str) -> None:
    """Ten messages at one instant, and then the end, one way or another."""
    assert trace.harness_problem == ""
    assert numbers(trace) == list(range(10)), (trace.notes, trace.faults())


def silence_and_end(folder: Path, ending: str, *, thread: bool) -> Plan:
    wait = f"time.sleep(0.05)\ntime.sleep(0.05)\ntime.sleep(0.05)\n{ENDINGS[ending]}"
    if thread:
        wait = f"def wait():\n{textwrap.indent(wait, '    ')}\nthreading.Thread(target=wait).start()\n"
        wait += "rclpy.spin(node)" if ending in ("terminated", "interrupted") else "time.sleep(2)"
    return planned(folder, BEFORE + TALKER + wait, duration_ns=3 * NS_PER_S)


@pytest.mark.rule(16)
@rows_of(silence_and_end)
@pytest.mark.parametrize("ending", but(["terminated"], ["hard_exit", "killed", "terminated", "aborted", "interrupted"]))
@pytest.mark.parametrize("thread", [*more([False]), True], ids=["", "in_a_thread"])
def test_who_ends_at_once_ends_at_its_time(trace: AssessedTrace, ending: str, *, thread: bool) -> None:
    """Also where it has said nothing for a while, so that it has let time pass on its own."""
    assert trace.harness_problem == ""
    (fault,) = trace.faults()
    # three pauses, each 1 us late, and the first after the looks of the node at the clock
    assert 150 * MS <= fault.t_ns < 150 * MS + 10_000, fault


@pytest.mark.parametrize("at_the_end", each(["", "raise ValueError('over')", "atexit.register(node.burst)"], 3))
def test_what_is_published_while_the_interpreter_ends_is_in_the_trace(
    run: Callable[..., AssessedTrace], at_the_end: str
) -> None:
    """A node that a module still holds is freed at the very end, when nothing can be imported any more."""
    trace = run(f"""
        import atexit
        class Talker(Node):
            def __init__(self):
                super().__init__('talker')
                self.publisher = self.create_publisher(String, '/words', 10)
            def burst(self):
                burst(self.publisher, 3)
            def __del__(self):
                self.burst()
                import json
        rclpy.init()
        node = Talker()
        {at_the_end}
        """)
    assert numbers(trace) == [0, 1, 2] * (2 if "atexit" in at_the_end else 1)
    assert any(line.text.startswith("ImportError: sys.meta_path is None") for line in trace.lines())


@pytest.mark.long
def test_a_context_manager_takes_nothing_with_it(run: Callable[..., AssessedTrace]) -> None:
    trace = run("""
        from rclpy.context import Context
        with Context() as context:
            node = Node('talker', context=context)
            burst(node.create_publisher(String, '/words', 10), 10)
        """)
    assert numbers(trace) == list(range(10))


@pytest.mark.rule(17)
def test_a_publisher_made_anew_for_every_message_loses_none(run: Callable[..., AssessedTrace]) -> None:
    trace = run("""
        rclpy.init()
        node = Node('talker')
        for number in range(20):
            publisher = node.create_publisher(String, '/words', 10)
            burst(publisher, 3, 3 * number)
            node.destroy_publisher(publisher)
            time.sleep(0.05)
        """)
    assert numbers(trace) == list(range(60))


@pytest.mark.long
def test_a_node_made_anew_after_each_shutdown_loses_nothing(run: Callable[..., AssessedTrace]) -> None:
    trace = run("""
        for number in range(6):
            rclpy.init()
            node = Node('talker')
            burst(node.create_publisher(String, '/words', 10), 3, 3 * number)
            node.destroy_node()
            rclpy.shutdown()
            time.sleep(0.1)
        """)
    assert numbers(trace) == list(range(18))


@pytest.mark.parametrize("pause", ["", *more(["time.sleep(0.1)"])])
def test_what_is_still_held_after_a_shutdown_harms_no_second_start(
    run: Callable[..., AssessedTrace], pause: str
) -> None:
    """Without destroy_node(), publisher and client stay in the graph until they are freed."""
    trace = run(f"""
        held = []
        for number in range(3):
            rclpy.init()
            node = Node('talker')
            publisher = node.create_publisher(String, '/words', 10)
            held.append((node, publisher, node.create_client(Trigger, '/status')))
            burst(publisher, 3, 3 * number)
            print(node.count_publishers('/words'), flush=True)
            {pause}
            rclpy.shutdown()
        """)
    assert numbers(trace) == list(range(9))
    assert [line.text for line in trace.lines()] == ["1", "2", "3"]


@pytest.mark.parametrize(
    "signal", each(["os.kill(os.getpid(), signal.SIGTERM)", "signal.raise_signal(signal.SIGTERM)"], 2)
)
def test_a_signal_that_a_program_sends_itself_has_shut_rclpy_down(
    run: Callable[..., AssessedTrace], signal: str
) -> None:
    """A thread of rclpy's does that, which is no faster in virtual time."""
    trace = run(TALKER + f"burst(publisher, 3)\n{signal}\nprint(rclpy.ok(), flush=True)\n")
    assert numbers(trace) == [0, 1, 2]
    assert [line.text for line in trace.lines()] == ["False"]


LISTENER = """
rclpy.init()
class Listener(Node):
    def __init__(self):
        super().__init__('listener')
        self.create_subscription(String, '/words', lambda m: print(m.data, flush=True), 10)
rclpy.spin(Listener())
"""


@pytest.mark.rule(19)
@pytest.mark.parametrize(
    "ending",
    but(
        ["os._exit(0)"],
        ["node.destroy_node()", "rclpy.shutdown()", "os._exit(0)", "del node, publisher\ngc.collect()"],
    ),
)
def test_another_node_hears_the_last_words(run: Callable[..., AssessedTrace], ending: str) -> None:
    """A node of another process gets what was published just before its sender went."""
    talker = (
        "rclpy.init()\nnode = Node('talker')\npublisher = node.create_publisher(String, '/words', 10)\ntime.sleep(1)\n"
    )
    trace = run(LISTENER, talker + "burst(publisher, 10)\n" + ending)
    assert [line.text for line in trace.lines()] == [str(n) for n in range(10)]


@pytest.mark.long
def test_nodes_of_one_process_hear_each_others_last_words(run: Callable[..., AssessedTrace]) -> None:
    trace = run("""
        rclpy.init()
        talker, listener = Node('talker'), Node('listener')
        listener.create_subscription(String, '/words', lambda m: print(m.data, flush=True), 10)
        publisher = talker.create_publisher(String, '/words', 10)
        burst(publisher, 10)
        talker.destroy_node()
        rclpy.spin(listener)
        """)
    assert [line.text for line in trace.lines()] == [str(n) for n in range(10)]


@pytest.mark.long
def test_a_latched_message_outlives_the_moment_it_was_sent(run: Callable[..., AssessedTrace]) -> None:
    """A subscription that comes while its publisher is there gets it; one that comes after it has gone does not."""
    late = LISTENER.replace(", 10)\n", ", QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))\n")
    talker = """
        rclpy.init()
        node = Node('talker')
        qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        node.create_publisher(String, '/words', qos).publish(String(data='7'))
        time.sleep({})
        node.destroy_node()
        """
    assert [line.text for line in run("time.sleep(1)\n" + late, talker.format(2)).lines()] == ["7"]
    assert [line.text for line in run("time.sleep(2)\n" + late, talker.format(1)).lines()] == []


ASKING = """
class Asker:
    def ask(self, client):
        future = client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(self.node, future, timeout_sec=5.0)
        print(future.result().message if future.done() else 'no answer', flush=True)
asker = Asker()
"""
ANEW = {
    "client": """
        rclpy.init()
        asker.node = Node('asker')
        for number in range(3):
            client = asker.node.create_client(Trigger, '/status')
            while not client.wait_for_service(timeout_sec=1.0):
                print('waiting', flush=True)
            asker.ask(client)
            asker.node.destroy_client(client)
            time.sleep(1)
        """,
    "node": """
        rclpy.init()
        for number in range(3):
            asker.node = Node('asker')
            client = asker.node.create_client(Trigger, '/status')
            while not client.wait_for_service(timeout_sec=1.0):
                print('waiting', flush=True)
            asker.ask(client)
            asker.node.destroy_node()
            time.sleep(1)
        """,
    "context": """
        for number in range(3):
            rclpy.init()
            asker.node = Node('asker')
            client = asker.node.create_client(Trigger, '/status')
            while not client.wait_for_service(timeout_sec=1.0):
                print('waiting', flush=True)
            asker.ask(client)
            asker.node.destroy_node()
            rclpy.shutdown()
            time.sleep(1)
        """,
    "collected": """
        rclpy.init()
        def once():
            asker.node = Node('asker')
            client = asker.node.create_client(Trigger, '/status')
            while not client.wait_for_service(timeout_sec=1.0):
                print('waiting', flush=True)
            asker.ask(client)
        for number in range(3):
            once()
            time.sleep(1)
        """,
}
ANSWERS = tuple({"success": True, "message": f"n{number}"} for number in range(8))
SERVER = """
rclpy.init()
class Server(Node):
    def __init__(self):
        super().__init__('server')
        self.count = 0
        self.create_service(Trigger, '/status', self.answer)
    def answer(self, request, response):
        response.success, response.message = True, f'n{self.count}'
        self.count += 1
        return response
rclpy.spin(Server())
"""


@pytest.mark.breadth(1, 1)
@pytest.mark.long
@pytest.mark.parametrize("program", but([ANEW["collected"]], ANEW.values()), ids=ANEW)
def test_a_client_made_anew_for_each_question_finds_the_graders_server(
    run: Callable[..., AssessedTrace], program: str
) -> None:
    server = PlannedServer("/status", "std_srvs/srv/Trigger", 0, 0, 0, cycle=False, answers=0, responses=ANSWERS)
    trace = run(ASKING + textwrap.dedent(program), stimuli=(server,), duration_ns=8 * NS_PER_S)
    assert [line.text for line in trace.lines()] == ["n0", "n1", "n2"]
    assert [request.t_ns // NS_PER_S for request in trace.requests("/status", "student")] == [0, 1, 2]


@pytest.mark.breadth(1, 1)
@pytest.mark.rule(18)
@pytest.mark.parametrize("program", but([ANEW["context"]], ANEW.values()), ids=ANEW)
def test_a_client_made_anew_for_each_question_finds_another_students_server(
    run: Callable[..., AssessedTrace], program: str
) -> None:
    trace = run(SERVER, ASKING + textwrap.dedent(program), duration_ns=8 * NS_PER_S)
    assert [line.text for line in trace.lines()] == ["n0", "n1", "n2"]
    assert trace.lines()[-1].t_ns // NS_PER_S == 2


LEAVES = {
    "destroy_service": "node.destroy_service(service)",
    "destroy_node": "node.destroy_node()",
    "shutdown": "rclpy.shutdown()",
    "exit": "os._exit(0)",
}


@pytest.mark.parametrize("clock", ["virtual", *more(["wall"], NIGHTLY)])
@pytest.mark.parametrize("ending", but([LEAVES["exit"]], LEAVES.values()), ids=LEAVES)
def test_a_server_that_answers_and_leaves_has_answered(
    run: Callable[..., AssessedTrace], ending: str, clock: str
) -> None:
    """Its response reaches the grader, and another student's client."""
    program = f"""
rclpy.init()
node = Node('server')
answered = []
def answer(request, response):
    response.success, response.message = True, 'n0'
    answered.append(1)
    return response
service = node.create_service(Trigger, '/status', answer)
while not answered:
    rclpy.spin_once(node)
{ending}
time.sleep(1)
"""
    calls = PlannedCalls("/status", "std_srvs/srv/Trigger", 500 * MS, NS_PER_S, 1, ({},))
    ends: Any = {"clock": clock, "duration_ns": ITS_END_NS}
    assert len(run(program, stimuli=(calls,), **ends).responses("/status", "student")) == 1
    client = "rclpy.init()\nasker.node = Node('asker')\nclient = asker.node.create_client(Trigger, '/status')\n"
    client += "client.wait_for_service()\nasker.ask(client)\n"
    assert [line.text for line in run(program, ASKING + client, **ends).lines()] == ["n0"]


@pytest.mark.parametrize("clock", ["virtual", *more(["wall"], NIGHTLY)])
@pytest.mark.parametrize("ending", but(["os._exit(0)"], ["node.destroy_node()", "client.destroy()", "os._exit(0)"]))
def test_a_client_that_asks_and_leaves_has_asked(run: Callable[..., AssessedTrace], ending: str, clock: str) -> None:
    server = PlannedServer("/status", "std_srvs/srv/Trigger", 0, 0, 0, cycle=False, answers=0, responses=ANSWERS)
    program = f"""
        rclpy.init()
        node = Node('asker')
        client = node.create_client(Trigger, '/status')
        client.wait_for_service()
        client.call_async(Trigger.Request())
        {ending}
        """
    trace = run(program, stimuli=(server,), clock=clock, duration_ns=ITS_END_NS)
    assert len(trace.requests("/status", "student")) == 1


@pytest.mark.long
def test_the_wall_clock_loses_nothing_either(run: Callable[..., AssessedTrace]) -> None:
    """What reliable publishers have sent arrives before they go."""
    for ending in ("node.destroy_node()\nrclpy.shutdown()", "", "os._exit(0)"):
        trace = run(TALKER + "burst(publisher, 10)\n" + ending, clock="wall", duration_ns=ITS_END_NS)
        assert numbers(trace) == list(range(10))


@pytest.mark.long
def test_a_spot_check_hears_what_a_short_lived_node_says(run: Callable[..., AssessedTrace]) -> None:
    """The subscription is there before the publisher, which is gone before a look at the graph would have shown it.

    The program waits until it sees the subscription, and only then creates its publisher.
    """
    publisher = Endpoint("publisher", "/words", "std_msgs/msg/String", "/talker", 0, "reliable", "volatile")
    program = """
        rclpy.init()
        node = Node('talker')
        for _ in range(500):
            if node.count_subscribers('/words'):
                break
            time.sleep(0.05)
        else:
            raise RuntimeError('nobody subscribes')
        publisher = node.create_publisher(String, '/words', 10)
        while not publisher.get_subscription_count():
            time.sleep(0.001)
        burst(publisher, 10)
        publisher.wait_for_all_acked()
        raise RuntimeError('over')
        """
    trace = run(program, clock="wall", bare=True, publishers=(publisher,), duration_ns=ITS_END_NS)
    assert numbers(trace) == list(range(10))
    assert [fault.text for fault in trace.faults()] == ["RuntimeError: over"]


@pytest.mark.long
def test_a_bare_process_sees_the_same_machine_and_no_way_to_the_grader(run: Callable[..., AssessedTrace]) -> None:
    """What replaces the answers about the machine leaves the same traces on both clocks."""
    program = """
        import sitecustomize
        print(os.cpu_count(), sorted(vars(sitecustomize)), sys.path, os.environ.get('PYTHONPATH'))
        rclpy.init()
        node = Node('n')
        """
    plans: list[dict[str, Any]] = [{}, {"clock": "wall", "bare": True, "duration_ns": ITS_END_NS}]
    virtual, bare = (run(program, **plan).lines()[0].text for plan in plans)
    assert virtual == bare
    assert "grader_host" not in bare


@pytest.mark.parametrize("plan", [{}, *more([{"clock": "wall"}]), {"clock": "wall", "bare": True}], ids=str)
def test_every_process_of_a_student_discovers_others_quickly(run: Callable[..., AssessedTrace], plan: Any) -> None:
    """Without the profile, one that starts after another one often hears nothing of it for three seconds."""
    trace = run(
        """
        name = next(name for name in os.environ if name.endswith("_DEFAULT_PROFILES_FILE"))
        with open(os.environ[name]) as profile:
            print("initialAnnouncements" in profile.read())
        rclpy.init()
        rclpy.create_node("n")
        """,
        **plan,
        duration_ns=ITS_END_NS,
    )
    assert trace.lines()[0].text == "True"


@pytest.mark.parametrize("options", ["", *more(["signal_handler_options=rclpy.signals.SignalHandlerOptions.NO"])])
def test_what_is_published_at_ctrl_c_counts(run: Callable[..., AssessedTrace], options: str) -> None:
    """A stop in a `finally` is sent where the context is still there; rclpy's own handler has shut it down by then."""
    trace = run(
        f"""
        import rclpy.signals
        rclpy.init({options})
        node = Node('talker')
        publisher = node.create_publisher(String, '/words', 10)
        node.create_timer(1.0, lambda: publisher.publish(String(data='1')))
        try:
            rclpy.spin(node)
        except KeyboardInterrupt:
            pass
        finally:
            if rclpy.ok():
                publisher.publish(String(data='0'))
            node.destroy_node()
            rclpy.try_shutdown()
        """,
        shutdown_ns=2 * NS_PER_S,
    )
    assert numbers(trace) == ([1, 1, 0] if options else [1, 1])
    assert trace.faults() == ()


ACTION = """
from rclpy.action import ActionServer
from test_msgs.action import Fibonacci
rclpy.init()
node = Node('server')
done = []
def execute(goal):
    for number in range(3):
        feedback = Fibonacci.Feedback()
        feedback.sequence = [number]
        goal.publish_feedback(feedback)
    goal.succeed()
    done.append(1)
    return Fibonacci.Result(sequence=[0, 1, 1])
server = ActionServer(node, Fibonacci, '/count', execute)
while not done:
    rclpy.spin_once(node)
for _ in range(5):
    rclpy.spin_once(node, timeout_sec=0.1)
"""


@pytest.mark.parametrize("ending", but([""], ["server.destroy()", "node.destroy_node()", ""]))
def test_an_action_server_that_leaves_has_told_everything(run: Callable[..., AssessedTrace], ending: str) -> None:
    """Feedback and the result reach the grader's client."""
    pytest.importorskip("test_msgs")
    goal = PlannedGoal("/count", "test_msgs/action/Fibonacci", NS_PER_S, 0, {"order": 3}, (7,) * 16)
    trace = run(ACTION + ending, stimuli=(goal,))
    assert len(trace.messages("/count/_action/feedback")) == 3
    assert len(trace.responses("/count/_action/get_result", "student")) == 1


FREED = """
from rclpy.action import ActionClient, ActionServer
from test_msgs.action import Fibonacci
rclpy.init()
def both():
    node = Node('both')
    server = ActionServer(node, Fibonacci, '/count', lambda goal: Fibonacci.Result())
    client = ActionClient(node, Fibonacci, '/count')
    client.wait_for_server()
    for _ in range(3):
        client.send_goal_async(Fibonacci.Goal())
both()
gc.collect()
"""


@pytest.mark.long
@pytest.mark.parametrize(
    ("ending", "code"),
    [
        ("", 0),
        ("sys.exit(3)", 3),
        ("os._exit(4)", 4),
        ("time.sleep(1)\nother = Node('other')\nsys.exit(other.count_publishers('/count/_action/status'))", 0),
    ],
)
@pytest.mark.parametrize("clock", ["virtual", *more(["wall"], NIGHTLY)])
def test_an_action_that_is_freed_while_goals_wait_for_it_is_gone(
    run: Callable[..., AssessedTrace], clock: str, ending: str, code: int
) -> None:
    """As without the grader: nobody destroys the server and its client, but Python frees them with their node."""
    pytest.importorskip("test_msgs")
    trace = run(FREED + ending, clock=clock)
    assert [fault.text for fault in trace.faults()] == [f"exited with code {code}"]


def test_a_subscription_made_late_misses_nothing_that_comes_after_it(run: Callable[..., AssessedTrace]) -> None:
    """In a callback, at any moment: its publisher knows it before time goes on."""
    numbers = PlannedMessages(
        "/words", "std_msgs/msg/String", 0, 0, 100 * MS, 1, False, False, tuple({"data": f"{n}"} for n in range(30))
    )
    trace = run(
        """
        rclpy.init()
        node = Node('listener')
        made = []
        def renew():
            if made:
                node.destroy_subscription(made.pop())
            made.append(node.create_subscription(String, '/words', lambda m: print(m.data, flush=True), 10))
        node.create_timer(0.251, renew)
        rclpy.spin(node)
        """,
        stimuli=(numbers,),
    )
    assert [line.text for line in trace.lines()] == [str(n) for n in range(3, 30)]


@pytest.mark.long
def test_a_look_at_the_graph_sees_what_is_there(run: Callable[..., AssessedTrace]) -> None:
    """At the first look, but an endpoint has no counterparts yet when it is created; looking in a loop takes time."""
    trace = run(
        """
        rclpy.init()
        node = Node('other')
        node.create_subscription(String, '/words', print, 10)
        service = node.create_service(Trigger, '/status', print)
        time.sleep(1)
        node.destroy_service(service)
        rclpy.spin(node)
        """,
        """
        rclpy.init()
        node = Node('looker')
        publisher = node.create_publisher(String, '/words', 10)
        print(publisher.get_subscription_count(), node.count_subscribers('/words'))
        time.sleep(0.001)
        print(publisher.get_subscription_count())
        print('other' in node.get_node_names(), '/status' in dict(node.get_service_names_and_types()), flush=True)
        while node.count_services('/status'):
            pass
        print('gone', flush=True)
        """,
    )
    told = [(line.text, line.t_ns // MS) for line in trace.lines()]
    assert told == [("0 2", 0), ("2", 1), ("True True", 1), ("gone", 1000)]


@pytest.mark.parametrize("clock", ["virtual", *more(["wall"], NIGHTLY)])
def test_a_node_without_a_farewell_leaves_when_its_lease_ends(run: Callable[..., AssessedTrace], clock: str) -> None:
    """Not before, so that a node that starts meanwhile and one that was there see different graphs, as in reality."""
    ending = TALKER + "publisher.publish(String())\ntime.sleep(1.5)\nos._exit(1)"
    watching = """
        rclpy.init()
        node = Node('watcher')
        seen = []
        for _ in range(27):
            now = node.count_publishers('/words'), node.get_node_names().count('talker')
            if seen[-1:] != [now]:
                seen.append(now)
                print(*now, flush=True)
            time.sleep(1)
        """
    programs = (watching, ending, watching.replace("'watcher'", "'late'"))
    trace = run(*programs, clock=clock, duration_ns=28 * NS_PER_S, starts_ns=(("c.py", 3 * NS_PER_S),))
    said = [(line.process, line.text, line.t_ns / NS_PER_S) for line in trace.lines()]
    assert [text for process, text, _ in said if process == "a.py"][-2:] == ["1 1", "0 0"]
    assert [text for process, text, _ in said if process == "c.py"] == ["0 0"]
    # on the other clock, Fast DDS counts from the last announcement, some tenths of a second ago
    if clock == "virtual":
        assert [round(t) for process, text, t in said if (process, text) == ("a.py", "0 0")][-1] == 22
