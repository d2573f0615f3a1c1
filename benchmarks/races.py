"""Counts how many runs find each of ten planted races: with all faults on in each run, and with a drawn part of them.

    .venv/bin/python benchmarks/races.py [RACE...] [--series N] [--kill]

Each race is two or three small nodes. Each run has a seed of its own, which draws the order of what is ready at one
instant, and the faults: each program may be paused, and what it publishes may be late or lost. That is `plain`. With
`swarm`, as with the marker `ros(seeds=N)` of pytest, the seed also draws which of these faults are on; `by turns`, it
does in every other run. A series tries one seed after the other until a node notices that the race was lost. The table
has the median over the series, and the fewest and the most runs.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from grader.runtime.model.dataclass import dataclass
from grader.world.opening import Worlds, open_worlds
from grader.world.world import World

#: The most runs of a series.
MOST = 30
#: For each run of a series in turn, whether it draws which faults are on.
WAYS = {"plain": (False,), "swarm": (True,), "by turns": (False, True)}
#: For how many seconds the nodes of a race run, and what happens to each program and to each topic: the same for all.
SECONDS = 2.5
OF_PROGRAM = {"pause": (0.0, 0.5)}
#: With `--kill`, each program may also be killed, which hides every race that it would have lost later.
KILLED = {"kill": (0.0, SECONDS)}
OF_TOPIC = {"delay": (0.0, 0.3), "lose": 0.2}


@dataclass(frozen=True, slots=True)
class Planted:
    """A planted race.

    Attributes:
        topics: The topics on which its nodes hear each other.
        programs: Its programs by name, in the order in which they start; one that has lost the race calls `lost()`.
    """

    topics: tuple[str, ...]
    programs: Mapping[str, str]

    def faults(self, of_program: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
        """Return what may happen in a run, as the marker's `between`, with what may happen to each program."""
        return {f"{name}.py": of_program for name in self.programs} | dict.fromkeys(self.topics, OF_TOPIC)


HEAD = """
import time
import rclpy
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64, Int32, String
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node(__file__.rpartition("/")[2][:-3])
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def lost():
    node.get_logger().error("lost")


def once(seconds, function):
    def called():
        timer.cancel()
        function()

    timer = node.create_timer(seconds, called)


"""
RACES = {
    "a parameter is read before it is set": Planted(
        (),
        {
            "mover": """
node.declare_parameter("speed", 0.1)
once(0.7, lambda: node.get_parameter("speed").value == 0.5 or lost())
""",
            "configurator": """
client = node.create_client(SetParameters, "/mover/set_parameters")
speed = Parameter("speed", value=0.5).to_parameter_msg()
once(0.5, lambda: client.call_async(SetParameters.Request(parameters=[speed])))
""",
        },
    ),
    "the last of two publishers counts": Planted(
        ("/speed",),
        {
            "navigation": """
out = node.create_publisher(Float64, "/speed", 10)
node.create_timer(0.5, lambda: out.publish(Float64(data=0.5)))
""",
            "stopper": """
out = node.create_publisher(Float64, "/speed", 10)
node.create_timer(0.5, lambda: out.publish(Float64(data=0.0)))
""",
            "base": """
heard = []
node.create_subscription(Float64, "/speed", lambda message: heard.append(message.data), 10)


def look():
    if len(heard) >= 2 and heard[-1]:
        lost()
    heard.clear()


node.create_timer(0.9, look)
""",
        },
    ),
    "a service is asked before it is there": Planted(
        (),
        {
            "map_server": 'node.create_service(Trigger, "/map", lambda request, response: response)\n',
            "localizer": """
client = node.create_client(Trigger, "/map")
once(0.3, lambda: client.service_is_ready() or lost())
""",
        },
    ),
    "a latched message comes too late": Planted(
        ("/map",),
        {
            "mapper": """
out = node.create_publisher(String, "/map", latched)
once(0.2, lambda: out.publish(String(data="map")))
""",
            "planner": """
maps = []
node.create_subscription(String, "/map", maps.append, latched)
once(0.6, lambda: maps or lost())
""",
        },
    ),
    "a message is sent before somebody hears it": Planted(
        ("/close", "/state"),
        {
            "gripper": """
closed = []
node.create_subscription(String, "/close", closed.append, 10)
out = node.create_publisher(String, "/state", 10)
node.create_timer(0.1, lambda: out.publish(String(data="closed" if closed else "open")))
""",
            "arm": """
out = node.create_publisher(String, "/close", 10)
states = []
node.create_subscription(String, "/state", lambda message: states.append(message.data), 10)
once(0.25, lambda: out.publish(String()))
once(1.5, lambda: states[-1:] == ["open"] and lost())
""",
        },
    ),
    "a timer runs before a subscription": Planted(
        ("/goal",),
        {
            "pilot": """
out = node.create_publisher(Int32, "/goal", 10)
number = iter(range(1, 100))
node.create_timer(0.5, lambda: out.publish(Int32(data=next(number))))
""",
            "driver": """
goals = [0]
steps = iter(range(1, 100))
node.create_subscription(Int32, "/goal", lambda message: goals.append(message.data), 10)
node.create_timer(0.5, lambda: goals[-1] < next(steps) - 1 and lost())
""",
        },
    ),
    "two topics of one node arrive in another order": Planted(
        ("/mode", "/go"),
        {
            "base": """
modes = []
node.create_subscription(String, "/mode", lambda message: modes.append(message.data), 10)
node.create_subscription(String, "/go", lambda message: modes or lost(), 10)
""",
            "remote": """
mode, go = (node.create_publisher(String, name, 10) for name in ("/mode", "/go"))
once(1.0, lambda: (mode.publish(String(data="drive")), go.publish(String())))
""",
        },
    ),
    "a response comes after the client has asked again": Planted(
        (),
        {
            "camera": """
def answer(request, response):
    time.sleep(0.3)
    return response


node.create_service(Trigger, "/picture", answer)
""",
            "watcher": """
client = node.create_client(Trigger, "/picture")
asked = []


def ask():
    number = len(asked)
    asked.append(client.call_async(Trigger.Request()))
    asked[-1].add_done_callback(lambda future: number < len(asked) - 1 and lost())
    once(0.5, lambda: None if asked[number].done() else ask())


once(1.0, ask)
""",
        },
    ),
    "a transform is old when it is used": Planted(
        ("/pose", "/scan"),
        {
            "odometry": """
out = node.create_publisher(Float64, "/pose", 10)
node.create_timer(0.1, lambda: out.publish(Float64(data=node.get_clock().now().nanoseconds / 1e9)))
""",
            "laser": """
out = node.create_publisher(Float64, "/scan", 10)
once(1.05, lambda: out.publish(Float64(data=node.get_clock().now().nanoseconds / 1e9)))
""",
            "mapper": """
poses = []
node.create_subscription(Float64, "/pose", lambda message: poses.append(message.data), 10)
node.create_subscription(Float64, "/scan", lambda scan: poses and scan.data - poses[-1] > 0.25 and lost(), 10)
""",
        },
    ),
    "an order is repeated whose receipt is late": Planted(
        ("/order", "/receipt"),
        {
            "kitchen": """
receipt = node.create_publisher(Int32, "/receipt", 10)
done = []


def cook(order):
    if order.data in done:
        lost()
    done.append(order.data)
    receipt.publish(order)


node.create_subscription(Int32, "/order", cook, 10)
""",
            "waiter": """
out = node.create_publisher(Int32, "/order", 10)
receipts = []
node.create_subscription(Int32, "/receipt", lambda message: receipts.append(message.data), 10)
once(1.0, lambda: out.publish(Int32(data=7)))
once(1.45, lambda: receipts or out.publish(Int32(data=7)))
""",
        },
    ),
}


def is_lost(ros: World, race: Planted) -> bool:
    """Run the programs of a race, and return whether one of them has lost it."""
    programs = [ros.run(f"{name}.py") for name in race.programs]
    ros.advance(SECONDS)
    return any(log.text == "lost" for program in programs for log in program.logs)


def runs_until_lost(  # noqa: PLR0913 - what makes a series
    worlds: Worlds, folder: Path, race: Planted, series: int, faults: Mapping[str, Any], swarm: Sequence[bool]
) -> int:
    """Return after how many runs a series finds a race; one more than the most if it does not."""
    for number in range(MOST):
        drawn = swarm[number % len(swarm)]
        with worlds.open(folder, seed=1000 * series + number, between=faults, swarm=drawn) as ros:
            if is_lost(ros, race):
                return number + 1
    return MOST + 1


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("races", nargs="*", metavar="RACE", help="a part of the name of a race; all without one")
    parser.add_argument("--series", type=int, default=3, help="how many series of seeds")
    parser.add_argument("--kill", action="store_true", help="each program may also be killed")
    given = parser.parse_args()
    of_program = OF_PROGRAM | KILLED if given.kill else OF_PROGRAM
    chosen = {name: race for name, race in RACES.items() if not given.races or any(one in name for one in given.races)}
    print(f"| race | {' | '.join(WAYS)} | without faults |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as top, open_worlds(Path(top)) as worlds:
        for number, (name, race) in enumerate(chosen.items()):
            folder = Path(top) / str(number)
            folder.mkdir()
            for program, text in race.programs.items():
                (folder / f"{program}.py").write_text(f"{HEAD}{text}\nrclpy.spin(node)\n", encoding="utf-8")
            cells = []
            faults = race.faults(of_program)
            for swarm in WAYS.values():
                runs = [runs_until_lost(worlds, folder, race, one, faults, swarm) for one in range(given.series)]
                cells.append(f"{statistics.median(runs):g} ({min(runs)} to {max(runs)})")
            with worlds.open(folder) as ros:
                cells.append("lost" if is_lost(ros, race) else "not lost")
            print(f"| {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
