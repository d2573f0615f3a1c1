"""What each rewriter makes of a program: another text, the same behaviour."""

from __future__ import annotations

import ast

import pytest

from grader.course.mutation.operators.program import ParsedProgram
from grader.course.mutation.operators.variants import VARIANTS, variants_of
from grader.course.mutation.results import one_line_change

NODE = """\
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32

PERIOD = 0.5
LIMIT = 25


class Fan(Node):
    def __init__(self):
        super().__init__("fan")
        self.speed = 0.0
        self.publisher = self.create_publisher(Float32, "/speed", 10)
        self.create_timer(PERIOD, self.tick)

    def tick(self):
        msg = Float32(data=self.speed)
        self.publisher.publish(msg)
        self.get_logger().info(f"{{at}} {msg.data:.1f} % of {LIMIT}")


def main(args=None):
    rclpy.init(args=args)
    node = Fan()
    rclpy.spin(node)


if __name__ == "__main__":
    main()
"""
#: Rewriter -> parts of what it writes.
WRITTEN = {
    "renamed_classes": ["class MyFan(Node)", "node = MyFan()"],
    "renamed_functions": ["def run_main(args=None)", "    run_main()"],
    "renamed_methods": ["def do_tick(self)", "self.do_tick)", "def __init__"],
    "renamed_attributes": ["self.the_speed = 0.0", "data=self.the_speed", "self.the_publisher.publish"],
    "renamed_variables": [
        "PERIOD_X = 0.5",
        "create_timer(PERIOD_X",
        "msg_x.data:.1f",
        "rclpy.spin(node_x)",
        "args=args",
    ],
    "renamed_nodes": ['__init__("fan_of_mine")'],
    "reordered_methods": ["class Fan(Node):\n\n    def tick(self)"],
    "reordered_constants": ["LIMIT = 25\n\nPERIOD = 0.5\n"],
    "single_quotes": ["'/speed'", "== '__main__'"],
    "windows_lines": ["PERIOD = 0.5\r\n"],
    "other_topic_form": ['"speed", 10'],
    "keyword_arguments": [
        'create_publisher(msg_type=Float32, topic="/speed", qos_profile=10)',
        "create_timer(timer_period_sec=PERIOD, callback=self.tick)",
    ],
    "percent_format": ['"{at} %.1f %% of %s" % (msg.data, LIMIT,)'],
    "format_method": ['"{{at}} {:.1f} % of {}".format(msg.data, LIMIT)'],
    "qos_object": ["from rclpy.qos import QoSProfile\n", '"/speed", QoSProfile(depth=10)'],
    "lambda_callbacks": ["create_timer(PERIOD, lambda: self.tick())"],
    "executor": ["import SingleThreadedExecutor", "executor.add_node(node)\n    executor.spin()"],
    "loop_in_thread": ["import threading", "while rclpy.ok():\n        node.tick()\n        time.sleep(PERIOD)"],
    "without_guard": ["    rclpy.spin(node)\n"],
}


def test_every_rewriter_has_a_case_and_says_how_it_differs() -> None:
    """A new one comes with a test here."""
    assert set(WRITTEN) == set(VARIANTS)
    assert all(rewriter.__doc__ for rewriter in VARIANTS.values())


@pytest.mark.parametrize("name", WRITTEN)
def test_a_rewriter_writes_the_same_thing_otherwise(name: str) -> None:
    """What it writes is Python, has the parts it should, and lost nothing but what it replaced."""
    text = VARIANTS[name](ParsedProgram(NODE))
    ast.parse(text)
    if name == "reordered_methods":
        assert text.index("def tick") < text.index("def __init__")
    else:
        assert [part for part in WRITTEN[name] if part not in text] == []
    assert text != NODE


def test_variants_are_named_by_file_and_rewriter() -> None:
    """Their order is that of the table."""
    assert [variant.id for variant in variants_of(NODE, "fan.py")] == [f"fan.py:{name}" for name in VARIANTS]


def test_a_program_that_gives_nothing_to_vary_has_no_variants() -> None:
    """Except for the ends of its lines."""
    assert [variant.operator for variant in variants_of("print(1)\n", "a.py")] == ["windows_lines"]


def test_fields_of_messages_and_imports_keep_their_names() -> None:
    """They are not the program's own."""
    source = "from a import b\n\n\ndef f(msg):\n    data = b(data=msg.data)\n    return data\n"
    text = VARIANTS["renamed_variables"](ParsedProgram(source))
    assert one_line_change(source, text) == (
        "data = b(data=msg.data) ¶ return data => data_x = b(data=msg.data) ¶ return data_x"
    )


def test_a_variable_and_a_method_of_one_name_are_two_things() -> None:
    """Each is renamed where it is meant, also through a variable that holds the object."""
    source = "class A:\n    def b(self):\n        b = self.b()\n        return b\n\n\nx = A()\nx.b(b=1)\ny.b()\n"
    assert VARIANTS["renamed_methods"](ParsedProgram(source)) == source.replace("def b", "def do_b").replace(
        "self.b", "self.do_b"
    ).replace("x.b", "x.do_b")
    assert "def b(self)" in VARIANTS["renamed_variables"](ParsedProgram(source))


def test_a_timer_that_the_program_keeps_is_no_loop() -> None:
    """Its name may be used elsewhere."""
    source = NODE.replace("        self.create_timer", "        self.timer = self.create_timer")
    assert VARIANTS["loop_in_thread"](ParsedProgram(source)) == source
