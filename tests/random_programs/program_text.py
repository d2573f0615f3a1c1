"""Writes a random program as the rclpy files that a student would hand in."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from program_description import (
    Ask,
    Cancel,
    End,
    Ending,
    Every,
    Fixed,
    Heard,
    Keep,
    Nap,
    Node,
    Pace,
    Process,
    Publish,
    Reset,
    Runs,
    Say,
    Spinning,
    Statement,
    Value,
    Write,
)

INDENT = "    "
HEAD = """import os
import sys
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int64
from test_msgs.srv import BasicTypes
"""
ENDINGS = {
    Ending.RAISE: 'raise RuntimeError("no more")',
    Ending.EXIT: "sys.exit(3)",
    Ending.EXIT_WELL: "sys.exit()",
    Ending.SHUTDOWN: "rclpy.shutdown()",
    Ending.LEAVE_AT_ONCE: "os._exit(4)",
}


def file_of(process: Process) -> str:
    """Return the text of the file of a process."""
    lines = [HEAD]
    for node in process.nodes:
        lines += ["", *class_of(node)]
    return "\n".join([*lines, "", *main_of(process), ""])


def sent_on(statements: Iterable[Statement]) -> Iterator[str]:
    """Yield the topics that statements publish on."""
    for one in statements:
        if isinstance(one, Publish):
            yield one.topic
        elif isinstance(one, (Every, Ask)):
            yield from sent_on(one.then)


def bodies(node: Node) -> Iterator[tuple[Statement, ...]]:
    """Yield what each callback of a node does."""
    yield from (timer.body for timer in node.timers)
    yield from (sub.body for sub in node.subscriptions)
    yield from (server.body for server in node.servers)


def class_of(node: Node) -> Iterator[str]:
    """Yield the lines of the class of a node."""
    yield f"class {node.name.capitalize()}(Node):"
    yield f"{INDENT}def __init__(self):"
    made = [f'super().__init__("{node.name}")', f"self.kept = [0] * {max(1, node.slots)}"]
    topics = sorted({topic for body in bodies(node) for topic in sent_on(body)})
    made += [f'self.to_{topic} = self.create_publisher(Int64, "/{topic}", 50)' for topic in topics]
    for timer in node.timers:
        given = "" if timer.starts else ", autostart=False"
        made += [f"self.{timer.name}_runs = 0"]
        made += [f"self.{timer.name} = self.create_timer({timer.period_ms / 1000}, self.on_{timer.name}{given})"]
    for sub in node.subscriptions:
        made += [f"self.{sub.name}_runs = 0"]
        made += [f'self.create_subscription(Int64, "/{sub.topic}", self.on_{sub.name}, {sub.depth})']
    for server in node.servers:
        made += [f"self.{server.name}_runs = 0"]
        made += [f'self.create_service(BasicTypes, "/{server.service}", self.on_{server.name})']
    made += [f'self.{client.name} = self.create_client(BasicTypes, "/{client.service}")' for client in node.clients]
    yield from (INDENT * 2 + line for line in made)
    for timer in node.timers:
        yield from method(timer.name, "", timer.body)
    for sub in node.subscriptions:
        yield from method(sub.name, "message", sub.body, heard="message.data")
    for server in node.servers:
        yield from method(server.name, "request, response", server.body, heard="request.int64_value")
        answer = value_of(server.answer, server.name, "request.int64_value")
        yield f"{INDENT * 2}response.int64_value = {answer}"
        yield f"{INDENT * 2}return response"


def method(name: str, arguments: str, body: tuple[Statement, ...], heard: str = "0") -> Iterator[str]:
    """Yield the lines of a callback."""
    yield ""
    yield f"{INDENT}def on_{name}(self{', ' if arguments else ''}{arguments}):"
    yield f"{INDENT * 2}self.{name}_runs += 1"
    yield from (INDENT * 2 + line for line in lines_of(body, name, heard))


def value_of(value: Value, name: str, heard: str) -> str:
    """Return an expression for a value in a callback."""
    if isinstance(value, Fixed):
        return str(value.number)
    if isinstance(value, Runs):
        return f"self.{name}_runs"
    return heard if isinstance(value, Heard) else f"self.kept[{value.slot}]"


def lines_of(body: Iterable[Statement], name: str, heard: str) -> Iterator[str]:
    """Yield the lines of statements in a callback."""
    for one in body:
        yield from statement(one, name, heard)


def statement(one: Statement, name: str, heard: str) -> Iterator[str]:
    """Yield the lines of one statement."""
    if isinstance(one, (Every, Ask)):
        yield from nested(one, name, heard)
        return
    texts = {
        Publish: lambda s: f"self.to_{s.topic}.publish(Int64(data={value_of(s.value, name, heard)}))",
        Say: lambda s: f'self.get_logger().info(f"{name} {{{value_of(s.value, name, heard)}}}")',
        Write: lambda s: f'print("{name}", {value_of(s.value, name, heard)}, flush=True)',
        Nap: lambda s: f"time.sleep({s.ms / 1000})",
        Keep: lambda s: f"self.kept[{s.slot}] {'+=' if s.adds else '='} {value_of(s.value, name, heard)}",
        Cancel: lambda s: f"self.{s.timer}.cancel()",
        Reset: lambda s: f"self.{s.timer}.reset()",
        Pace: lambda s: f"self.{s.timer}.timer_period_ns = {s.period_ms * 1_000_000}",
        End: lambda s: ENDINGS[s.how],
    }
    yield texts[type(one)](one)


def nested(one: Every | Ask, name: str, heard: str) -> Iterator[str]:
    """Yield the lines of a statement that holds others."""
    if isinstance(one, Every):
        yield f"if self.{name}_runs % {one.runs} == 0:"
        yield from (INDENT + line for line in (*lines_of(one.then, name, heard), "pass"))
        return
    yield f"request = BasicTypes.Request(int64_value={value_of(one.value, name, heard)})"
    inner = tuple(lines_of(one.then, name, "future.result().int64_value"))
    yield "def answered(future):"
    yield from (INDENT + line for line in (*inner, "pass"))
    yield f"self.{one.client}.call_async(request).add_done_callback(answered)"


def main_of(process: Process) -> Iterator[str]:
    """Yield the lines that run the nodes."""
    yield ""
    yield "def main():"
    yield from (INDENT + line for line in steps_of(process))
    yield ""
    yield ""
    yield 'if __name__ == "__main__":'
    yield f"{INDENT}main()"


def steps_of(process: Process) -> Iterator[str]:
    """Yield the lines of `main`."""
    yield "rclpy.init()"
    yield f"nodes = [{', '.join(f'{node.name.capitalize()}()' for node in process.nodes)}]"
    if process.spinning is Spinning.SPIN:
        yield "rclpy.spin(nodes[0])"
    elif process.spinning is Spinning.EXECUTOR:
        yield "executor = SingleThreadedExecutor()"
        yield "for node in nodes:"
        yield f"{INDENT}executor.add_node(node)"
        yield "executor.spin()"
    else:
        yield f"turns = {process.turns}"
        yield "while rclpy.ok():"
        yield f"{INDENT}rclpy.spin_once(nodes[0], timeout_sec={process.timeout_ms / 1000})"
        yield f"{INDENT}turns -= 1"
        yield f"{INDENT}if turns == 0:"
        yield f"{INDENT * 2}break"
    yield 'print("main", 0, flush=True)'
