"""What each operator makes of a small program: source in, source out."""

from __future__ import annotations

import ast
from collections.abc import Sequence

import pytest

from grader.course.mutation.operators import OPERATORS, mutants_of
from grader.course.mutation.operators.program import Candidate
from grader.course.mutation.results import one_line_change

#: A program with a publisher, a subscription and a timer.
NODE = '''\
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class Fan(Node):
    """A node."""

    def __init__(self):
        super().__init__("fan")
        self.publisher = self.create_publisher(Float32, "/speed", 10)
        self.create_subscription(Float32, "/heat", self.heard, 10)
        self.create_timer(0.5, self.tick)

    def heard(self, msg):
        self.get_logger().info(f"heat {msg.data:.2f} of {msg.limit}")

    def tick(self):
        self.publisher.publish(Float32(data=self.speed()))
'''

#: Operator -> a program, and the one-line changes that it makes of it, in order.
CASES = {
    "topic_typo": (NODE, ["/speed -> /spee", "/heat -> /hea"]),
    "topic_namespace": (NODE, ["/speed -> /turtle1/speed", "/heat -> /turtle1/heat"]),
    "topic_private": (NODE, ["/speed -> ~/speed", "/heat -> ~/heat"]),
    "topic_swapped": (NODE, ["/speed <-> /heat"]),
    "message_type": (NODE, ["Float32 -> std_msgs.msg.Float64"]),
    "stamped_type": ("from geometry_msgs.msg import Twist, Vector3\na = Twist()\n", ["Twist -> TwistStamped"]),
    "message_type_once": (NODE, ["create_publisher Float32 -> Float64", "create_subscription Float32 -> Float64"]),
    "best_effort": (NODE, ["publisher best effort", "subscription best effort"]),
    "transient_local": (NODE, ["publisher transient local", "subscription transient local"]),
    "period": (
        "self.create_timer(1 / RATE, self.tick)\nrate = node.create_rate(20)\ntime.sleep(PAUSE)\n",
        [
            f"{before} -> {inside} {factor}"
            for before, inside in (("1 / RATE", "(1 / RATE)"), ("20", "20"), ("PAUSE", "PAUSE"))
            for factor in ("* 10", "/ 10", "* 1000", "/ 2", "* 2", "* 1.25", "* 0.75")
        ],
    ),
    "rate_as_period": (
        "self.create_timer(1 / RATE, self.tick)\nself.create_timer(timer_period_sec=0.2, callback=self.tick)\n",
        ["1 / RATE -> RATE", "0.2 -> 1 / (0.2)"],
    ),
    "sleeping_callback": (NODE, ["heard sleeps 2 s", "tick sleeps 2 s"]),
    "busy_callback": (NODE, ["heard loops"]),
    "counter_step": ("self.count += 1\n", ["step 1 -> 2 * 1", "step 1 -> -1"]),
    "whole_number": ("a = 25.0\nb = 0.5\n", ["25.0 -> 25"]),
    "constant": (
        "a = 0.5\nb = 3\nself.create_publisher(T, 'x', 10)\nc = 0.0\n",
        ["3 -> 4", "0.5 -> 0.55", "0.0 -> 0.1"],
    ),
    "constant_less": ("a = 0.5\nb = QoSProfile(depth=5)\n", ["0.5 -> 0.45"]),
    "sign": ("a = 0.5\nb = -2\nc = 0\n", ["-2 -> 2", "0.5 -> -0.5"]),
    "arithmetic": ("a = b + c / d\ne = 'x' + f\n", ["b + c / d -> b - c / d", "c / d -> c * d"]),
    "missing_operand": ("a = b * 2\nc = '%d' % d\n", ["b * 2 -> b", "b * 2 -> 2"]),
    "missing_conversion": (
        "import math\na = math.degrees(b)\nc = int(d)\n",
        ["math.degrees(b) -> b", "int(d) -> d", "degrees -> radians"],
    ),
    "cut_to_whole": (
        "if msg.data > LIMIT:\n    out.data = speed\nif x is None:\n    publish(Float32(data=draw()))\n",
        ["msg.data -> int(msg.data)", "draw() -> float(int(draw()))", "speed -> float(int(speed))"],
    ),
    "wrong_field": (
        "self.x = msg.pose.position.x\n",
        ["msg.pose.position.x -> .y", "msg.pose.position -> .orientation"],
    ),
    "wrong_part": ("p = msg.pose.pose.position\n", ["msg.pose.pose.position -> msg.twist.twist.linear"]),
    "swapped_arguments": ("f(a, b, c=d)\n", ["a <-> b"]),
    "swapped_values": ("s = f'{a:.1f} and {b}'\n", ["a <-> b"]),
    "missing_keyword": ("f(a, b=c)\n", ["f(a, b=c) -> f(a)"]),
    "stale_field": ("msg.data = 3\nself.count = 0\n", ["msg.data -> data_value"]),
    "comparison": (
        "a = b > 25\nif __name__ == '__main__':\n    main()\n",
        ["b > 25 -> b >= 25", "b > 25 -> b < 25", "b > 25 -> b == 25"],
    ),
    "swapped_branches": (
        "a = 1 if b else 2\nif c:\n    d()\nelse:\n    e()\n",
        ["1 <-> 2", "if c: branches swapped"],
    ),
    "constant_condition": ("if a is None:\n    b()\n", ["a is None -> True", "a is None -> False"]),
    "boolean": (
        "a = True\nb = c and d\ne = not f\n",
        ["True -> False", "c and d -> c or d", "not f -> f"],
    ),
    "loop_once": ("while not ready():\n    wait()\nwhile a:\n    break\n", ["while -> if not ready()"]),
    "unhandled": ("try:\n    a()\nexcept ValueError:\n    pass\n", ["except ValueError: raise"]),
    "missing_call": ("a()\nb = c()\n'text'\n", ["no a()"]),
    "missing_assignment": ("a = 1\nb += 1\nc: int\nd: int = 2\n", ["no a = 1", "no b += 1", "no d: int = 2"]),
    "missing_import": ("import a\nfrom b import c\n", ["no import a", "no from b import c"]),
    "missing_return": ("def f():\n    return 1\ndef g():\n    return\n", ["no return 1"]),
    "missing_early_return": ("def g():\n    if a:\n        return\n    b()\n", ["no return"]),
    "missing_parameter": (NODE, ["heard without msg", "tick without self"]),
    "callback_called": (NODE, ["self.heard -> self.heard()", "self.tick -> self.tick()"]),
    "timer_once": (NODE, ["self.create_timer(0.5, self.tick) -> self.tick()"]),
    "spins_once": ("rclpy.spin(node)\n", ["spin -> spin_once"]),
    "repeated_call": (
        "self.p.publish(m)\nself.n()\nlog.info('a')\n",
        ["twice self.p.publish(m)", "twice log.info('a')"],
    ),
    "repeated_entity": (
        NODE,
        [
            'two of self.create_subscription(Float32, "/hea…',
            "two of self.create_timer(0.5, self.tick)",
        ],
    ),
    "wrong_order": (
        "def f():\n    msg = T()\n    msg.data = 1\n    p.publish(msg)\n    g()\n",
        ["msg = T() after msg.data = 1", "msg.data = 1 after p.publish(msg)"],
    ),
    "exits_later": (NODE, ["heard exits after 10 calls", "tick exits after 10 calls"]),
    "crashes_on_third": (NODE, ["heard raises after 2 calls", "tick raises after 2 calls"]),
    "stops_later": (NODE, ["heard does nothing after 10 calls", "tick does nothing after 10 calls"]),
    "frozen_value": (NODE, ["once Float32(data=self.speed())"]),
    "first_message_only": (NODE, ["heard keeps the first msg"]),
    "one_behind": (NODE, ["heard uses the msg before"]),
    "print_instead": (
        "self.get_logger().info('a', once=True)\n",
        ["self.get_logger().info('a', once=True) -> print('a')"],
    ),
    "log_level": ("log.info('a')\nmath.error('b')\n", ["info -> debug", "info -> error"]),
    "log_every_message": (NODE, ["heard calls tick"]),
    "text": (
        "'docs are left alone'\nlog.info('robot at %.2f')\nlog.info(f'speed {a} now')\nn = Node('name')\n",
        ["robot at %.2f -> robo at %.2f", "speed -> spee", "now -> no"],
    ),
    "rounding": ("a = f'{b:.3f} {c} {d:.0f}'\ne = '%.2f m' % f\n", ["{b:.3f} -> {b:.0f}", "%.2f m -> %.0f m"]),
    "missing_value": ("a = f'{b} {c:.1f}'\n", ["no {b}", "no {c:.1f}"]),
}


def made(name: str, source: str) -> tuple[Candidate, ...]:
    """Return what one operator makes of a program."""
    return mutants_of(source, "node.py", {name: OPERATORS[name]})


def test_every_operator_has_a_case_and_says_what_it_imitates() -> None:
    """A new operator comes with a test here, and with the mistake it stands for."""
    assert set(CASES) == set(OPERATORS)
    assert all(operator.__doc__ for operator in OPERATORS.values())


@pytest.mark.parametrize("name", CASES)
def test_an_operator_finds_its_places(name: str) -> None:
    """It finds all of them and no others, names each, and leaves Python behind that means something else."""
    source, details = CASES[name]
    mutants = made(name, source)
    assert [mutant.detail for mutant in mutants] == details
    for mutant in mutants:
        ast.parse(mutant.source)
        assert mutant.source != source


#: Operator, a program, and what becomes of its lines.
CHANGES = [
    ("topic_typo", 'TOPIC = "/heat"\nn.create_subscription(T, TOPIC, f, 10)\n', ['TOPIC = "/heat" => TOPIC = "/hea"']),
    ("topic_typo", "n.create_client(srv_name='add', srv_type=A)\n", ['=> n.create_client(srv_name="ad", srv_type=A)']),
    (
        "message_type",
        "from std_srvs.srv import Trigger\nself.create_service(Trigger, 'x', f)\nself.Trigger = 3\n",
        ["self.create_service(Trigger, 'x', f) => from std_srvs.srv import SetBool ¶", "(SetBool, 'x', f)"],
    ),
    (
        "stamped_type",
        "from geometry_msgs.msg import Twist\na = Twist()\na.linear.x = 1.0\n",
        ["=> from geometry_msgs.msg import TwistStamped ¶", "¶ a = TwistStamped() ¶ a.twist.linear.x = 1.0"],
    ),
    (
        "best_effort",
        "import rclpy\nn.create_publisher(T, 'x', 10)\n",
        ["=> from rclpy.qos import qos_profile_sensor_data ¶", "'x', qos_profile_sensor_data)"],
    ),
    ("missing_call", "def f():\n    spin(n)\n", ["spin(n) => pass"]),
    ("missing_return", "def f(a, b):\n    return b\n", ["return b => pass"]),
    ("loop_once", "while not a():\n    b()\n", ["while not a(): => if not a():"]),
    ("unhandled", "try:\n    a()\nexcept E as e:\n    b(e)\n", ["b(e) => raise"]),
    ("swapped_branches", "if a:\n    b()\nelse:\n    c()\n", ["moved: "]),
    ("print_instead", "self.get_logger().warning('a %s' % b, throttle_duration_sec=1)\n", ["=> print('a %s' % b)"]),
    (
        "exits_later",
        NODE,
        ["=> self.calls_so_far = getattr(self, 'calls_so_far', 0) + 1 ¶ if self.calls_so_far > 10: ¶"],
    ),
    (
        "crashes_on_third",
        "def f(msg):\n    a()\nn.create_subscription(T, 'x', f, 10)\n",
        ["f.calls_so_far > 2: ¶ raise"],
    ),
    ("frozen_value", NODE, ["publish(self.__dict__.setdefault('kept_19', Float32(data=self.speed())))"]),
    ("one_behind", NODE, ["self.heard, msg = msg, getattr(self, 'heard', msg)"]),
    ("log_every_message", NODE, ["(nothing) => self.tick()"]),
    ("missing_parameter", NODE, ["def heard(self, msg): => def heard(self):"]),
    ("missing_keyword", "rclpy.init(a, args=args)\n", ["=> rclpy.init(a)"]),
    ("wrong_field", "a = t.linear.z\n", ["=> a = t.linear.x"]),
    ("rounding", "a = f'{b:6.2f}'\n", ["=> a = f'{b:.0f}'"]),
]


@pytest.mark.parametrize(("name", "source", "parts"), CHANGES)
def test_the_first_mutant_of_an_operator_reads_like_the_mistake(name: str, source: str, parts: Sequence[str]) -> None:
    """What is written in the end is what a student would have written."""
    change = one_line_change(source, made(name, source)[0].source)
    assert [part for part in parts if part not in change] == [], change


def test_a_mutant_that_means_the_same_is_left_out() -> None:
    """Two operators that come to the same program make one mutant, of the first; layout and comments do not count."""
    source = "a = 2  # two\nb = a / 2\n"
    by_both = mutants_of(source, "a.py", {name: OPERATORS[name] for name in ("constant", "counter_step", "constant")})
    assert len(by_both) == len({ast.dump(ast.parse(mutant.source)) for mutant in by_both}) == 2
    swapped = mutants_of("f(a, a)\n", "a.py", {"swapped_arguments": OPERATORS["swapped_arguments"]})
    assert swapped == ()


def test_ids_name_file_line_operator_and_detail_and_are_never_the_same() -> None:
    """Two equal changes of one line are counted."""
    ids = [mutant.id for mutant in made("constant", "a = 1\nb = [2, 2]\n")]
    assert ids == ["node.py:1:constant:1 -> 2", "node.py:2:constant:2 -> 3", "node.py:2:constant:2 -> 3 #2"]


def test_what_is_no_python_any_more_is_no_mutant() -> None:
    """`return` at the top of a file cannot be compiled."""
    source = "def f():\n    global x\n    x = 1\n    global y\n"
    for mutant in mutants_of(source, "a.py"):
        compile(mutant.source, "a.py", "exec")


def test_a_long_detail_stays_one_short_line() -> None:
    """Ids are read by people."""
    (mutant,) = made("missing_call", "call(\n    'a long text that goes on and on',\n    'and on and on and on')\n")
    assert "\n" not in mutant.id
    assert len(mutant.id) < 120
