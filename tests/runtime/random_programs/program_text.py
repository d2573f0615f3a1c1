"""Writes a random program as the rclpy files that a student would hand in."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from program_description import (
    FIRST_NAP_MS,
    LAST_NAP_MS,
    MOST_IN_ACTION,
    OF_CANCELLING,
    OF_STATUS,
    ActionServer,
    Ask,
    Await,
    CallAndWait,
    Cancel,
    CancelGoal,
    End,
    Ending,
    Every,
    Feedback,
    Finish,
    Fixed,
    Heard,
    Keep,
    Loop,
    Nap,
    Node,
    Pace,
    Parameter,
    Process,
    Publish,
    Reset,
    Rest,
    Runs,
    Say,
    SendGoal,
    SetParameter,
    SleepRate,
    Spinning,
    Statement,
    Value,
    Write,
)

INDENT = "    "
WITH_VALUE = (Publish, Say, Write, Keep, Ask, Await, SendGoal, Feedback, SetParameter, CallAndWait)
HEAD = f"""import asyncio
import os
import sys
import threading
import time

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Int64
from test_msgs.action import Fibonacci
from test_msgs.srv import BasicTypes


def small(number):
    return max(-{MOST_IN_ACTION}, min(number, {MOST_IN_ACTION}))

"""
ENDINGS = {
    Ending.RAISE: 'raise RuntimeError("no more")',
    Ending.EXIT: "sys.exit(3)",
    Ending.EXIT_WELL: "sys.exit()",
    Ending.SHUTDOWN: "rclpy.shutdown(); return",
    Ending.LEAVE_AT_ONCE: "os._exit(4)",
}


def file_of(process: Process) -> str:
    """Return the text of the file of a process."""
    lines = [HEAD]
    for number, node in enumerate(process.nodes):
        lines += ["", *class_of(node, None if number else process.loop)]
    return "\n".join([*lines, "", *main_of(process), ""])


def sent_on(statements: Iterable[Statement]) -> Iterator[str]:
    """Yield the topics that statements publish on."""
    for one in statements:
        if isinstance(one, Publish):
            yield one.topic
        elif isinstance(one, (Every, Ask, CancelGoal)):
            yield from sent_on(one.then)
        elif isinstance(one, SendGoal):
            yield from sent_on((*(one.hears or ()), *one.answered, *one.finished))


def bodies(node: Node, loop: Loop | None = None) -> Iterator[tuple[Statement, ...]]:
    """Yield what each callback of a node does, and the loop of the main thread."""
    if loop is not None:
        yield loop.body
    yield from (timer.body for timer in node.timers)
    yield from (sub.body for sub in node.subscriptions)
    yield from (server.body for server in node.servers)
    yield from (server.body for server in node.action_servers)


def class_of(node: Node, loop: Loop | None) -> Iterator[str]:
    """Yield the lines of the class of a node."""
    yield f"class {node.name.capitalize()}(Node):"
    yield f"{INDENT}def __init__(self):"
    yield from (INDENT * 2 + line for line in made_by(node, loop))
    yield from method("parameter", "parameters", (), result=ON_PARAMETER)
    for timer in node.timers:
        yield from method(timer.name, "", timer.body)
    for sub in node.subscriptions:
        yield from method(sub.name, "message", sub.body, heard="message.data")
    for server in node.servers:
        answer = value_of(server.answer, server.name)
        result = (f"response.int64_value = {answer}", "return response")
        yield from method(server.name, "request, response", server.body, heard="request.int64_value", result=result)
    for end in node.action_servers:
        yield from of_action(end)


def of_action(server: ActionServer) -> Iterator[str]:
    """Yield the lines of the callbacks of an action's server."""
    answer = f"result = Fibonacci.Result(sequence=[small({value_of(server.answer, server.name)})])"
    result = (answer, *FINISHES[server.finish], "return result")
    yield from method(server.name, "goal", server.body, heard="goal.request.order", result=result)
    yield ""
    yield f"{INDENT}def accept_{server.name}(self, goal):"
    yield f"{INDENT * 2}return GoalResponse.ACCEPT if goal.order >= 0 else GoalResponse.REJECT"
    yield ""
    yield f"{INDENT}def cancel_{server.name}(self, goal):"
    yield f'{INDENT * 2}self.get_logger().info(f"{server.name}.cancel {{goal.request.order}}")'
    yield f"{INDENT * 2}return CancelResponse.{'ACCEPT' if server.cancels else 'REJECT'}"


FINISHES = {
    Finish.SUCCEED: ("goal.succeed()",),
    Finish.ABORT: ("goal.abort()",),
    Finish.CANCEL: ("if goal.is_cancel_requested:", f"{INDENT}goal.canceled()", "else:", f"{INDENT}goal.succeed()"),
    Finish.FORGET: (),
}

ON_PARAMETER = (
    "fine = parameters[0].value >= 0",
    "if fine:",
    f'{INDENT}self.get_logger().info(f"parameter {{parameters[0].value}}")',
    "return SetParametersResult(successful=fine)",
)


def made_by(node: Node, loop: Loop | None) -> Iterator[str]:
    """Yield the lines that make a node's entities."""
    yield f'super().__init__("{node.name}")'
    yield f"self.kept = [0] * {max(1, node.slots)}"
    yield 'self.declare_parameter("number", 0)'
    yield "self.add_on_set_parameters_callback(self.on_parameter)"
    for number, group in enumerate(node.groups, 1):
        yield f"self.group{number} = {group.value}()"
    yield "self.runs = {}"
    yield "self.goals = {}"
    topics = sorted({topic for body in bodies(node, loop) for topic in sent_on(body)})
    for topic in topics:
        yield f'self.to_{topic} = self.create_publisher(Int64, "/{topic}", 50)'
    for timer in node.timers:
        given = in_group(timer.group) + ("" if timer.starts else ", autostart=False")
        yield f"self.{timer.name} = self.create_timer({timer.period_ms / 1000}, self.on_{timer.name}{given})"
    for sub in node.subscriptions:
        given = in_group(sub.group)
        yield f'self.create_subscription(Int64, "/{sub.topic}", self.on_{sub.name}, {sub.depth}{given})'
    for server in node.servers:
        given = in_group(server.group)
        yield f'self.create_service(BasicTypes, "/{server.service}", self.on_{server.name}{given})'
    for client in node.clients:
        given = in_group(client.group)
        yield f'self.{client.name} = self.create_client(BasicTypes, "/{client.service}"{given})'
    yield from acting(node)


def acting(node: Node) -> Iterator[str]:
    """Yield the lines that make a node's servers and clients of actions."""
    for server in node.action_servers:
        callbacks = f"goal_callback=self.accept_{server.name}, cancel_callback=self.cancel_{server.name}"
        given = f"self.on_{server.name}, {callbacks}{in_group(server.group)}"
        yield f'self.{server.name} = ActionServer(self, Fibonacci, "/{server.action}", {given})'
    for client in node.action_clients:
        given = in_group(client.group)
        yield f'self.{client.name} = ActionClient(self, Fibonacci, "/{client.action}"{given})'


def in_group(group: int) -> str:
    """Return the argument for a callback group, with the comma before it."""
    return f", callback_group=self.group{group}" if group else ""


def method(
    name: str, arguments: str, body: tuple[Statement, ...], heard: str = "0", result: tuple[str, ...] = ()
) -> Iterator[str]:
    """Yield the lines of a callback."""
    yield ""
    kind = "async def" if awaits(body) else "def"
    yield f"{INDENT}{kind} on_{name}(self{', ' if arguments else ''}{arguments}):"
    first = (f'self.runs["{name}"] = self.runs.get("{name}", 0) + 1', f"heard = {heard}")
    yield from (INDENT * 2 + line for line in (*first, *lines_of(body, name), *result))


def awaits(body: Iterable[Statement]) -> bool:
    """Return whether statements wait for a response as a coroutine does."""
    return any(isinstance(one, Await) or (isinstance(one, Every) and awaits(one.then)) for one in body)


def value_of(value: Value, name: str) -> str:
    """Return an expression for a value in a callback."""
    if isinstance(value, Fixed):
        return str(value.number)
    if isinstance(value, Runs):
        return f"self.runs['{name}']"
    if isinstance(value, Parameter):
        return "self.get_parameter('number').value"
    return "heard" if isinstance(value, Heard) else f"self.kept[{value.slot}]"


def lines_of(body: Iterable[Statement], name: str, label: str = "") -> Iterator[str]:
    """Yield the lines of statements in a callback, which logs under its name or a label of its own."""
    for one in body:
        yield from statement(one, name, label or name)


def statement(one: Statement, name: str, label: str) -> Iterator[str]:
    """Yield the lines of one statement."""
    if isinstance(one, Every):
        yield f"if self.runs['{name}'] % {one.runs} == 0:"
        yield from (INDENT + line for line in (*lines_of(one.then, name, label), "pass"))
        return
    value = value_of(one.value, name) if isinstance(one, WITH_VALUE) else ""
    request = f"BasicTypes.Request(int64_value={value})"
    if isinstance(one, Ask):
        inner = lines_of(one.then, name, f"{name}.{one.client}")
        yield "def answered(future):"
        yield from (INDENT + line for line in ("heard = future.result().int64_value", *inner))
        yield f"self.{one.client}.call_async({request}).add_done_callback(answered)"
        return
    if isinstance(one, (SendGoal, CancelGoal)):
        yield from goal_statement(one, name, f"small({value})")
        return
    texts: dict[type, Callable[[Any], str]] = {
        Publish: lambda s: f"self.to_{s.topic}.publish(Int64(data={value}))",
        Say: lambda s: f'self.get_logger().info(f"{label} {{{value}}}")',
        Write: lambda s: f'print("{label}", {value}, flush=True)',
        Nap: lambda s: f"time.sleep({s.ms / 1000})",
        Keep: lambda s: f"self.kept[{s.slot}] {'+=' if s.adds else '='} {value}",
        Cancel: lambda s: f"self.{s.timer}.cancel()",
        Reset: lambda s: f"self.{s.timer}.reset()",
        Pace: lambda s: f"self.{s.timer}.timer_period_ns = {s.period_ms * 1_000_000}",
        Await: lambda s: f"heard = (await self.{s.client}.call_async({request})).int64_value",
        Feedback: lambda s: f"goal.publish_feedback(Fibonacci.Feedback(sequence=[small({value})]))",
        CallAndWait: lambda s: f"heard = self.{s.client}.call({request}).int64_value",
        SetParameter: lambda s: f'self.set_parameters([Parameter("number", value={value})])',
        SleepRate: lambda s: "self.rate.sleep()",
        Rest: lambda s: f"await asyncio.sleep({s.ms / 1000})",
        End: lambda s: ENDINGS[s.how],
    }
    yield texts[type(one)](one)


def goal_statement(one: SendGoal | CancelGoal, name: str, order: str) -> Iterator[str]:
    """Yield the lines of a statement that sends or cancels a goal."""
    label = f"{name}.{one.client}"

    def function(of: str, argument: str, heard: str, then: tuple[Statement, ...]) -> Iterator[str]:
        yield f"def {of}({argument}):"
        yield from (INDENT + line for line in (heard, *lines_of(then, name, f"{label}.{of}")))

    if isinstance(one, CancelGoal):
        yield f'if "{one.client}" in self.goals:'
        told = f"heard = {OF_CANCELLING} * len(future.result().goals_canceling) + future.result().return_code"
        yield from (INDENT + line for line in function("cancelled", "future", told, one.then))
        yield f'{INDENT}self.goals["{one.client}"].cancel_goal_async().add_done_callback(cancelled)'
        return
    given = ""
    if one.hears is not None:
        yield from function("hears", "message", "heard = sum(message.feedback.sequence)", one.hears)
        given = ", feedback_callback=hears"
    yield from function("answered", "future", "heard = int(future.result().accepted)", one.answered)
    yield f"{INDENT}if heard:"
    yield f'{INDENT * 2}self.goals["{one.client}"] = future.result()'
    told = f"heard = {OF_STATUS} * future.result().status + sum(future.result().result.sequence)"
    yield from (INDENT * 2 + line for line in function("finished", "future", told, one.finished))
    yield f"{INDENT * 2}future.result().get_result_async().add_done_callback(finished)"
    goal = f"Fibonacci.Goal(order={order})"
    yield f"self.{one.client}.send_goal_async({goal}{given}).add_done_callback(answered)"


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
    yield from RUNNING[process.spinning](process)
    yield 'print("main", 0, flush=True)'


def with_executor(process: Process, executor: str = "SingleThreadedExecutor()") -> Iterator[str]:
    """Yield the lines that spin all nodes in an executor."""
    yield f"executor = {executor}"
    yield "for node in nodes:"
    yield f"{INDENT}executor.add_node(node)"
    yield "executor.spin()"


def in_turns(process: Process) -> Iterator[str]:
    """Yield the lines that call spin_once."""
    yield f"turns = {process.turns}"
    yield "while rclpy.ok():"
    yield f"{INDENT}rclpy.spin_once(nodes[0], timeout_sec={process.timeout_ms / 1000})"
    yield f"{INDENT}turns -= 1"
    yield f"{INDENT}if turns == 0:"
    yield f"{INDENT * 2}break"


def until_answered(process: Process) -> Iterator[str]:
    """Yield the lines that call a service several times, and spin until each response is there."""
    client = process.nodes[0].clients[0].name
    yield f"time.sleep({FIRST_NAP_MS / 1000})"
    yield f"for turn in range({process.turns}):"
    yield f"{INDENT}future = nodes[0].{client}.call_async(BasicTypes.Request(int64_value=turn))"
    yield f"{INDENT}rclpy.spin_until_future_complete(nodes[0], future)"
    yield f'{INDENT}print("until", future.result().int64_value, flush=True)'


def beside_a_thread(process: Process) -> Iterator[str]:
    """Yield the lines of a loop in the main thread, beside a thread that spins."""
    loop = process.loop
    assert loop is not None
    yield "self = nodes[0]"
    if loop.rate_ms:
        yield f"self.rate = self.create_rate({1000 / loop.rate_ms})"
    yield from list(with_executor(process))[:-1]
    yield "threading.Thread(target=executor.spin, daemon=True).start()"
    yield "heard = 0"
    yield f"time.sleep({FIRST_NAP_MS / 1000})"
    yield f"for turn in range({loop.turns}):"
    yield f'{INDENT}self.runs["{loop.name}"] = turn + 1'
    yield from (INDENT + line for line in lines_of(loop.body, loop.name))
    yield f"time.sleep({LAST_NAP_MS / 1000})"


def in_coroutines(process: Process) -> Iterator[str]:
    """Yield the lines of two coroutines, one of which spins."""
    loop = process.loop
    assert loop is not None
    yield "self = nodes[0]"
    yield "heard = 0"
    yield ""
    yield "async def spin():"
    yield f"{INDENT}while rclpy.ok():"
    yield f"{INDENT * 2}rclpy.spin_once(self, timeout_sec=0)"
    yield f"{INDENT * 2}await asyncio.sleep({process.timeout_ms / 1000})"
    yield ""
    yield "async def work():"
    yield f"{INDENT}await asyncio.sleep({FIRST_NAP_MS / 1000})"
    yield f"{INDENT}for turn in range({loop.turns}):"
    yield f'{INDENT * 2}self.runs["{loop.name}"] = turn + 1'
    yield from (INDENT * 2 + line for line in lines_of(loop.body, loop.name))
    yield ""
    yield "async def both():"
    yield f"{INDENT}await asyncio.gather(spin(), work())"
    yield ""
    yield "asyncio.run(both())"


RUNNING: dict[Spinning, Callable[[Process], Iterator[str]]] = {
    Spinning.SPIN: lambda process: iter(("rclpy.spin(nodes[0])",)),
    Spinning.EXECUTOR: with_executor,
    Spinning.ONCE: in_turns,
    Spinning.UNTIL: until_answered,
    Spinning.THREAD: beside_a_thread,
    Spinning.ASYNCIO: in_coroutines,
    Spinning.MULTI: lambda process: with_executor(process, f"MultiThreadedExecutor({process.threads})"),
}
