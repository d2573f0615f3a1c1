"""Examines this machine for `grade doctor`."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from grader.grading.app.grade import Progress
from grader.grading.app.observe import ObserveRequest, observe_programs
from grader.grading.model import entry_points
from grader.grading.model.report import Summary
from grader.grading.reporting.formats import EVIDENCE, FORMATS, format_of
from grader.grading.submissions.foreign_archives import has_libarchive, libarchive_commands
from grader.runtime import machine
from grader.runtime.interface_packages import course_packages
from grader.runtime.model.checkup import NO_SANDBOX, Checkup, Exchange, Fact, TierReport
from grader.runtime.model.errors import EnvironmentFault, GraderError
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import NS_PER_S

#: Messages that the trial node sends, one every 0.1 s starting at 0.1 s, and how long it is observed.
TRIAL_MESSAGES = 10
#: Half a period more than the last message: the trial ends between two of them.
TRIAL_NS = NS_PER_S + NS_PER_S // 20
TRIAL_TOPIC = "/trial"
TRIAL_NODE = f"""\
import rclpy
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("trial")
publisher = node.create_publisher(String, "{TRIAL_TOPIC}", 10)
node.create_timer(0.1, lambda: publisher.publish(String(data="hello")))
rclpy.spin(node)
"""


#: Observes a node, as `observe` does.
Look = Callable[[ObserveRequest, Progress], Summary]


def examine(progress: Progress, find: Callable[[], machine.Found] = machine.ros_here) -> Checkup:
    """Find out what this machine can do; takes a few seconds."""
    progress("looking for ROS 2")
    ros, lack = find()
    known = machine.weaknesses(ros)
    own = () if ros is None else _interfaces(ros.distro)
    facts = (*machine.software(ros), *lack, *machine.system(), *known, _archives(), *own, *_added())
    if ros is None:
        return Checkup(facts, None, (), "", "", Limits())
    progress("looking at the byte code")
    facts += machine.prepared(ros)
    progress("trying every sandbox")
    return concluded(facts, machine.sandboxes(ros), progress)


def concluded(
    facts: tuple[Fact, ...], tiers: tuple[TierReport, ...], progress: Progress, look: Look = observe_programs
) -> Checkup:
    """Choose the tier that grading would use, and exchange messages in it.

    Args:
        facts: What is known of the machine.
        tiers: What trying every tier has shown, the strongest first.
        progress: Called at each step.
        look: Observes the trial node.
    """
    used = next((tier.name for tier in tiers if tier.usable), "")
    tier = used or NO_SANDBOX
    facts += (machine.node_start(tier, can_fork=machine.can_fork(tier)),)
    progress("exchanging messages")
    exchange = _exchange(tier, progress, look)
    return Checkup(facts, exchange, tiers, used, "" if used else machine.easiest_remedy(tiers), Limits())


def _archives() -> Fact:
    """Report which archives students may hand in."""
    if has_libarchive():
        return Fact("archives", "zip and tar, .rar and .7z by libarchive")
    return Fact("archives", "zip and tar; .rar and .7z need libarchive", remedy=libarchive_commands())


def _interfaces(distro: str) -> tuple[Fact, ...]:
    """Report whether interface packages can be built, and which ones are ready."""
    try:
        ready = [package.name for package in course_packages(()) if package.folder]
    except (GraderError, ImportError) as error:
        text = error.message if isinstance(error, GraderError) else str(error)
        hint = f"install the generators: pip install ros-{distro}-rosidl-generator-py ros-{distro}-rosidl-parser"
        return (Fact("interfaces", f"packages cannot be built here: {text}", fits=False, remedy=hint),)
    text = "built from their definitions, without a compiler"
    return (Fact("interfaces", f"{text}; ready: {', '.join(ready)}" if ready else text),)


def _added() -> tuple[Fact, ...]:
    """Report what other packages add to the grader, and why some of it cannot be used."""
    try:
        formats = [_added_format(*each) for each in entry_points.added(entry_points.FORMATS)]
        schedulers = [_added_scheduler(*each) for each in entry_points.added(entry_points.SCHEDULERS)]
    except EnvironmentFault as fault:
        return (Fact("other packages", fault.message, remedy=fault.hint),)
    return (*formats, *schedulers)


def _added_format(name: str, package: str) -> Fact:
    if name in (*FORMATS, EVIDENCE):
        text = f"{name} of {package} is not used: the grader has its own"
        return Fact("report format", text, remedy=f"give the format of {package.partition(' ')[0]} another name")
    try:
        format_of(name)
    except EnvironmentFault as fault:
        return Fact("report format", fault.message, remedy=fault.hint)
    return Fact("report format", f"{name} of {package}")


def _added_scheduler(name: str, package: str) -> Fact:
    if name in entry_points.own(entry_points.SCHEDULERS):
        text = f"{name} of {package} is not used: the grader has its own"
        return Fact("class scheduler", text, remedy=f"give the scheduler of {package.partition(' ')[0]} another name")
    try:
        entry_points.load_registered(entry_points.SCHEDULERS, name, object, "a scheduler")
    except EnvironmentFault as fault:
        return Fact("class scheduler", fault.message, remedy=fault.hint)
    return Fact("class scheduler", f"{name} of {package}")


def _exchange(tier: str, progress: Progress, look: Look) -> Exchange:
    """Observe the trial node the way a student's node is observed, and count its messages."""
    started = time.perf_counter()
    arrived, problem = 0, ""
    with tempfile.TemporaryDirectory(prefix="grade-doctor-") as folder:
        file = Path(folder) / "trial.py"
        file.write_text(TRIAL_NODE, encoding="utf-8")
        try:
            summary = look(ObserveRequest((file,), TRIAL_NS, isolation=tier), progress)
            arrived = sum(topic.messages for topic in summary.topics if topic.name == TRIAL_TOPIC)
            problem = "; ".join(fault.text for fault in summary.faults)
        except GraderError as error:
            problem = error.message
    return Exchange(tier, TRIAL_MESSAGES, arrived, time.perf_counter() - started, problem)
