"""Programs that plot or show images run in virtual time; their windows stay open until they close them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from places import REPORTED
from tiers import NIGHTLY, but, each, more

from grader.grading.app.observe import ObserveRequest, observe_programs
from grader.grading.model.report import Summary
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import ClockKind

pytestmark = pytest.mark.ros

HEAD = """
import threading
import time
import rclpy
from std_msgs.msg import Int32
"""
PLOT = """
import matplotlib
import matplotlib.pyplot as plt
from matplotlib.animation import FuncAnimation
rclpy.init()
node = rclpy.create_node('plots')
log = node.get_logger().info
"""
SPIN = "threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()\n"
#: The time at which a program logs, in seconds since its start.
TIME = re.compile(r"\d+\.\d$")
#: Program -> what it logs in two seconds.
PLOTTING = {
    "a window stays open": (
        PLOT + "plt.plot([1, 2])\nnode.create_timer(0.5, lambda: log('tick'))\n" + SPIN + "plt.show()\nlog('closed')",
        ["tick"] * 3,
    ),
    "without a figure there is no window": (PLOT + "plt.show()\nlog('on')\nrclpy.spin(node)", ["on"]),
    "an animation moves": (
        PLOT
        + "fig, ax = plt.subplots()\nline, = ax.plot([], [])\n"
        + "def update(frame):\n    log(f'{frame} {time.monotonic() - start:.1f}')\n    return line,\n"
        + "start = time.monotonic()\n"
        + "moves = FuncAnimation(fig, update, interval=500, frames=3, repeat=False, cache_frame_data=False)\n"
        + SPIN
        + "plt.show()",
        ["0 0.0", "0 0.5", "1 1.0", "2 1.5"],
    ),
    "a pause takes its time": (
        PLOT
        + "plt.ion()\nplt.figure()\nstart = time.monotonic()\n"
        + "for n in range(3):\n    plt.pause(0.5)\n    log(f'{time.monotonic() - start:.1f}')\nrclpy.spin(node)",
        ["0.5", "1.0", "1.5"],
    ),
    "a pause without a figure": (PLOT + "plt.pause(0.5)\nlog(f'{plt.get_fignums()}')\nrclpy.spin(node)", ["[]"]),
    "a timer closes the window": (
        PLOT
        + "fig = plt.figure()\ntimer = fig.canvas.new_timer(interval=700)\ntimer.add_callback(lambda: plt.close(fig))\n"
        + "timer.start()\nplt.show()\nlog('closed')\nrclpy.spin(node)",
        ["closed"],
    ),
    "a window that does not block": (
        PLOT + "plt.plot([1])\nplt.show(block=False)\nlog('on')\nrclpy.spin(node)",
        ["on"],
    ),
    "a toolkit that is not here": (
        "import matplotlib\nmatplotlib.use('Qt5Agg')\n"
        + PLOT
        + "fig, ax = plt.subplots()\nax.plot([1])\nfig.canvas.draw()\nfig.canvas.flush_events()\n"
        + "fig.canvas.start_event_loop(0.2)\nlog(matplotlib.get_backend().lower())\nrclpy.spin(node)",
        ["qt5agg", "qtagg"],
    ),
    "a figure is saved": (
        PLOT
        + "plt.plot([1, 2])\nplt.title('Speed')\nplt.savefig('speed.png')\n"
        + "log(str(open('speed.png', 'rb').read(4)))\nrclpy.spin(node)",
        ["b'\\x89PNG'"],
    ),
    "the fonts are those of matplotlib": (
        PLOT
        + "from matplotlib import font_manager\nown = matplotlib.get_data_path()\n"
        + "log(str({f.fname.startswith(own) for f in font_manager.fontManager.ttflist}))\nrclpy.spin(node)",
        ["{True}"],
    ),
}
LOOKING = {
    "a loop over images": (
        HEAD
        + "import cv2\nimport numpy as np\nrclpy.init()\nnode = rclpy.create_node('looks')\nstart = time.monotonic()\n"
        + "for n in range(3):\n    cv2.imshow('camera', np.zeros((4, 4, 3), np.uint8))\n"
        + "    assert cv2.waitKey(500) == -1\n"
        + "    node.get_logger().info(f'{time.monotonic() - start:.1f}')\n"
        + "cv2.destroyAllWindows()\nrclpy.spin(node)",
        ["0.5", "1.0", "1.5"],
    ),
    "a loop that counts ticks": (
        HEAD
        + "import cv2\nrclpy.init()\nnode = rclpy.create_node('looks')\ndue = start = cv2.getTickCount()\n"
        + "for n in range(3):\n    due += 0.5 * cv2.getTickFrequency()\n"
        + "    while cv2.getTickCount() < due:\n        time.sleep(0.01)\n"
        + "    node.get_logger().info(f'{(cv2.getTickCount() - start) / cv2.getTickFrequency():.1f}')\n"
        + "rclpy.spin(node)",
        ["0.5", "1.0", "1.5"],
    ),
    "a wait for a key": (
        HEAD
        + "import cv2\nrclpy.init()\nnode = rclpy.create_node('looks')\ncv2.namedWindow('camera')\n"
        + "node.create_timer(0.9, lambda: node.get_logger().info('tick'))\n"
        + SPIN
        + "cv2.waitKey(0)\nnode.get_logger().info('key')",
        ["tick", "tick"],
    ),
}


def watched(tmp_path: Path, text: str, clock: str, duration_s: int = 2) -> Summary:
    file = tmp_path / "program.py"
    file.write_text(text)
    return observe_programs(ObserveRequest((file,), duration_s * NS_PER_S, clock=clock), lambda _: None)


def says(texts: list[str], logged: list[str], clock: str) -> bool:
    """Return whether a program logged what it should; on the wall clock, a busy machine may make it late, never early.

    There it also runs for longer, and logs more.
    """
    if clock == "auto":
        return texts == logged
    pairs = [(TIME.search(text), TIME.search(wanted)) for text, wanted in zip(texts, logged, strict=False)]
    late_enough = all(float(found[0]) >= float(wanted[0]) for found, wanted in pairs if found and wanted)
    return late_enough and [TIME.sub("", t) for t in texts[: len(logged)]] == [TIME.sub("", t) for t in logged]


@pytest.mark.breadth(0, 1)
@pytest.mark.parametrize("clock", ["auto", *more(["wall"], NIGHTLY)])
@pytest.mark.parametrize(("text", "logged"), but([PLOTTING["a window stays open"]], PLOTTING.values()), ids=PLOTTING)
def test_a_program_that_plots(text: str, logged: list[str], clock: str, tmp_path: Path) -> None:
    """In virtual time nothing sends it to the wall clock, where importing alone may take more than its time."""
    pytest.importorskip("matplotlib")
    summary = watched(tmp_path, HEAD + text, clock, 2 if clock == "auto" else 12)
    if clock == "auto":
        assert (summary.clock, summary.clock_reason) == (ClockKind.VIRTUAL, "")
    texts = [record.text for record in summary.records]
    several = "toolkit" in text or logged == ["qt5agg", "qtagg"]
    if several:
        assert texts in ([one] for one in logged), summary.lines
    else:
        assert says(texts, logged, clock), (texts, summary.lines)
    assert [fault.text for fault in summary.faults] == []
    assert not any("font" in line.text.lower() for line in summary.lines), summary.lines


@pytest.mark.parametrize("clock", ["auto", *more(["wall"], NIGHTLY)])
@pytest.mark.parametrize(("text", "logged"), but([LOOKING["a loop over images"]], LOOKING.values()), ids=LOOKING)
def test_a_program_that_shows_images(text: str, logged: list[str], clock: str, tmp_path: Path) -> None:
    """The wheel of OpenCV for servers would raise in each of these functions."""
    pytest.importorskip("cv2")
    summary = watched(tmp_path, text, clock, 2 if clock == "auto" else 12)
    texts = [record.text for record in summary.records]
    assert says(texts, logged, clock), (texts, summary.faults)
    assert [fault.text for fault in summary.faults] == []


@pytest.mark.long
@pytest.mark.parametrize("clock", ["auto", *more(["wall"], NIGHTLY)])
def test_importing_a_library_that_plots_is_no_reason_for_the_wall_clock(clock: str) -> None:
    """Nor is it one to start a program that lists fonts."""
    pytest.importorskip("matplotlib")
    file = REPORTED / "matplotlib_import.py"
    summary = observe_programs(ObserveRequest((file,), 10 * NS_PER_S, clock=clock), lambda _: None)
    assert clock == "wall" or (summary.clock_reason, len(summary.records)) == ("", 9)
    assert {record.text for record in summary.records} == {"tick"}
    assert summary.faults == ()


@pytest.mark.breadth(1, 1)
@pytest.mark.parametrize(
    ("code", "said"),
    each(
        [
            ("subprocess.run(['true'])", "starts another process, which runs in real time"),
            ("signal.alarm(1)", "sets an alarm that rings in real time"),
            ("time.sleep(0.1); select.select([0], [], [], 0)", None),
        ],
        3,
    ),
)
def test_the_reason_for_the_wall_clock_names_the_line(code: str, said: str | None, tmp_path: Path) -> None:
    """And what the program does there."""
    text = HEAD + f"import select, signal, subprocess\nrclpy.init()\nnode = rclpy.create_node('n')\n\n{code}\n"
    summary = watched(tmp_path, text + "rclpy.spin_once(node, timeout_sec=1)", "auto", 1)
    line = text.count("\n", 0, text.index(code)) + 1
    assert summary.clock_reason.endswith("" if said is None else f"program.py:{line} {said}")
    assert (summary.clock_reason == "") is (said is None)
