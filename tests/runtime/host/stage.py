"""A process in which small programs run in virtual time without ROS, before a grader that only moves the clock.

Reads JSON lines, objects of `code` or `root` and `file`, `seed` and `repeats`; answers each with a JSON list of what
the repetitions said. Each is a fork of its own, with another interval at which Python switches between threads.
"""

import json
import os
import select
import signal
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

HOST = Path(__file__).resolve().parents[3] / "grader/runtime/host"
sys.path.insert(0, str(HOST))
import launcher  # type: ignore[import-not-found]  # noqa: E402
import time_machine  # noqa: E402, F401 - it takes long: once for all repetitions

sys.path.remove(str(HOST))
program = launcher.load_package()
entry, virtual, times, protocol = (
    sys.modules[f"_grader_host.{name}"] for name in ("entry", "virtual", "times", "protocol")
)
sys.modules["_grader_host.unseen"].IMPORTS.end()
EPOCH_NS = sys.modules["_grader_host.clock"].EPOCH_NS
UPTIME_NS = sys.modules["_grader_host.clock"].UPTIME_NS

#: Switching between threads now after a microsecond, now hardly ever: the order must not depend on it.
SWITCH_INTERVALS_S = (0.005, 1e-6, 1e-5, 1.0, 1e-4)
#: A program that asks for the time so often is not going to end.
QUESTIONS = 50_000
#: Real seconds without an end after which a program is taken to hang; far more than any takes on a busy machine.
PATIENCE_S = 60


class Stage:
    """Takes the grader's place: whoever asks is moved to the time it wants, and nothing else ever happens."""

    def __init__(self, pipe: int) -> None:
        self._pipe = pipe
        self._said: list[str] = []
        self._questions = 0
        self.time = virtual.VirtualTime(self)
        self.time.install(self.fault, self.say)

    def say(self, text: object) -> None:
        """Note something with the virtual milliseconds since the start; a pause may end some microseconds late."""
        at_ns = self.time.clock.now_ns - EPOCH_NS
        self._said.append(f"{at_ns / 1e6:.2f}".rstrip("0").rstrip(".") + f" {text}")

    def write(self, text: object) -> None:
        """Note something that the program has written to a standard stream."""
        self.say(text)
        self.time.scheduler.wrote()

    def work(self, ms: int) -> None:
        """Have the work before the program's next wait take so long, as if it had been measured."""
        clock, scheduler = self.time.clock, self.time.scheduler

        def charge() -> None:
            clock.charge = lambda: None
            end_ns = clock.now_ns + ms * 1_000_000
            while clock.now_ns < end_ns:
                scheduler.pause(end_ns)

        clock.charge = charge

    @staticmethod
    def fault(error: BaseException) -> Any:
        """Return what ended a thread."""
        return f"fault {type(error).__name__}: {error}"

    def ask(self, report: Any) -> Any:
        """Answer as the grader does."""
        self._questions += 1
        if report.wake_ns is None:
            self.end("idle for ever")
        if self._questions > QUESTIONS:
            self.end("asks without end")
        return protocol.Go(report.wake_ns, report.wake_ns)

    def send(self, report: Any) -> None:
        """Note what is reported."""
        self.say(report)

    def note(self, said: Any) -> None:
        """Note what the host has to mention, as `code: value, value`."""
        values = ", ".join(str(value) for value in said[1:] if value)
        self.say(f"{said.code}: {values}" if values else said.code)

    def end(self, why: str) -> None:
        """Hand over what was said, and end the process."""
        self.say(why)
        os.write(self._pipe, json.dumps(self._said).encode())
        os._exit(0)


def perform(request: dict[str, Any], pipe: int) -> None:
    """Run one repetition."""
    stage = Stage(pipe)
    times.install_wall_time(stage.time.clock)
    program.seed_randomness(request["seed"])
    sys.modules["_grader_host.replaced"].rename_functions()
    stage.time.start(EPOCH_NS, EPOCH_NS - UPTIME_NS)
    try:
        if "file" in request:
            stand_in_for_ros(stage.say)
            entry.run_file(request, stage.note, lambda: stage.say("ros"))
        else:
            names = {"__name__": "__main__", "say": stage.say, "write": stage.write, "work": stage.work}
            exec(compile(request["code"], "program", "exec"), names)
    except SystemExit as leaving:
        stage.say(f"exit {program.exit_code(leaving)}")
    except BaseException as error:  # the program under test may raise anything
        stage.say(f"raised {type(error).__name__}: {error}")
    program.finish_threads()
    stage.end("end")


def stand_in_for_ros(say: Callable[[object], None]) -> None:
    """Have files find an `rclpy` that only notes what is done with it, and the host a list of nodes."""
    made: list[object] = []

    class Node:
        __module__ = "rclpy.node"

        def __init__(self, name: str = "") -> None:
            made.append(self)

    rclpy: Any = types.ModuleType("rclpy")
    node: Any = types.ModuleType("rclpy.node")
    rclpy.node, node.Node = node, Node
    rclpy.ok = lambda: False
    rclpy.init = lambda: say("init")
    rclpy.spin = lambda spun: say(f"spin {type(spun).__name__}")
    host: Any = types.ModuleType("_grader_host.lifetimes")
    host.MADE_NODES = made
    sys.modules.update({"rclpy": rclpy, "rclpy.node": node, "_grader_host.lifetimes": host})
    package: Any = sys.modules["_grader_host"]
    package.lifetimes = host
    builtins: Any = sys.modules["builtins"]
    builtins.say = say


def main() -> None:
    """Serve requests until nobody asks any more."""
    for line in sys.stdin:
        request = json.loads(line)
        said = [in_a_fork(request, number) for number in range(request["repeats"])]
        sys.stdout.write(json.dumps(said) + "\n")
        sys.stdout.flush()


def in_a_fork(request: dict[str, Any], number: int) -> list[str] | None:
    """Run one repetition in a process of its own, and return what it said; None if it died or hung."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        program.die_with_parent()
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        sys.setswitchinterval(SWITCH_INTERVALS_S[number % len(SWITCH_INTERVALS_S)])
        perform(request, writing)
    os.close(writing)
    said = b""
    with os.fdopen(reading, "rb", buffering=0) as pipe:
        while select.select([pipe], [], [], PATIENCE_S)[0] and (found := pipe.read()):
            said += found
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return json.loads(said) if said else None


if __name__ == "__main__":
    main()
