"""Kinds of stimuli: one module and one row each, and nothing else names them."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import grader
from grader.runtime.stimuli import KINDS, PLANNED

PACKAGE = Path(grader.__file__).resolve().parent
#: Modules that are about a single kind: recordings that are read from bags, simulations that run, and other keys of a
#: rubric that are short for a kind.
ABOUT = {
    "RecordedStream": {
        "grading/app/bags.py",
        "grading/app/observe.py",
        "course/authoring/checking.py",
        "grading/evidence/manifest.py",
        "grading/model/exercise.py",
        "runtime/plan.py",
    },
    "ActionServer": {"course/authoring/checking.py"},
    "ServiceCalls": {"grading/rubrics/drawing.py", "grading/rubrics/model.py"},
    "Simulated": {
        "grading/app/interfaces.py",
        "course/authoring/checking.py",
        "course/authoring/starting.py",
        "grading/rubrics/check_parameters.py",
        "grading/rubrics/model.py",
        "grading/rubrics/simulations.py",
    },
}

#: A kind that nobody has thought of: several messages at one instant.
BURST = '''
"""Several messages at one instant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from typing import Annotated, ClassVar

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import Kind, MessageType, Topic
from grader.runtime.model.scenario import Content, Event, FieldsItem, Planned, Stimulus, Time
from grader.runtime.stimuli.drawing import Draws, Fields, drawn_fields, drawn_time, in_drawn_order, planned_as
from grader.runtime.stimuli.messages import Advertise, PlannedMessages, PublishFields


@dataclass(frozen=True, slots=True)
class PlannedBurst(Planned):
    """Messages of one instant."""

    holds: ClassVar[tuple[Content, ...]] = (Content("values", "msg"),)

    topic: str
    type: str
    start_ns: int
    values: tuple[Fields, ...]

    @property
    def place(self) -> str:
        return f"burst on {self.topic}"

    def events(self) -> Iterator[Event]:
        stream = PlannedMessages(self.topic, self.type, 0, 0, 1, 1, False, False, self.values)
        yield Advertise(0, self.topic, stream)
        for value in self.values:
            yield PublishFields(self.start_ns, self.topic, stream, value)


@dataclass(frozen=True, slots=True)
class Burst(Stimulus):
    """A stimulus: several messages at one instant."""

    key: ClassVar[str] = "a_burst"
    becomes = PlannedBurst

    topic: Topic
    type: MessageType
    values: Annotated[tuple[FieldsItem, ...], Kind("messages")] = field(hash=False)
    start_ns: Time = 0

    def planned(self, draws: Draws) -> PlannedBurst:
        start_ns = drawn_time(self.start_ns, draws.own)
        values = tuple(drawn_fields(value, draws.own) for value in in_drawn_order(self.values, draws.own))
        return planned_as(PlannedBurst, self, start_ns=start_ns, values=values)

    def phrase(self) -> str:
        return f"the grader publishes {len(self.values)} messages at once on {self.topic}"
'''
RUBRIC = """
schema: grader/rubric/v1
exercise: {id: bursts, number: "1", title: Bursts}
files: [listener.py]
scenarios:
  - id: alone
    processes: [listener.py]
    observe: {duration: 2 s}
    stimuli:
      - a_burst: {topic: /heat, type: std_msgs/msg/Float32, start: 1 s, values: [{data: 20}, {data: 31.5}, {data: 47}]}
criteria:
  - id: hears
    title: Logs each of them
    points: 1
    scenario: alone
    check:
      logs_received: {topic: /heat, process: listener.py}
"""
LISTENER = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32

rclpy.init()
node = Node("listener")
node.create_subscription(Float32, "/heat", lambda heat: node.get_logger().info(f"{heat.data:.2f}"), 10)
rclpy.spin(node)
"""


def test_no_kind_is_named_outside_its_folder() -> None:
    """But by modules that are about this kind alone: what treats all of them alike asks the kind."""
    kinds = {kind.__name__ for kind in KINDS}
    named: dict[str, set[str]] = {}
    for path in PACKAGE.rglob("*.py"):
        place = path.relative_to(PACKAGE).as_posix()
        if place.startswith("runtime/stimuli/"):
            continue
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if any(kind in text for kind in kinds) else ():
            if isinstance(node, ast.Name) and node.id in kinds:
                named.setdefault(node.id, set()).add(place)
    assert named == ABOUT


def test_each_kind_is_sent_to_workers_under_a_name_of_its_own() -> None:
    """Two planned classes of one name would be mistaken for each other."""
    assert len(PLANNED) == len({kind.key for kind in KINDS}) == len(KINDS)


def test_no_kind_is_derived_from_another() -> None:
    """Whoever asks for the one would find the other as well."""
    assert [(a, b) for a in KINDS for b in KINDS if a is not b and issubclass(a, b)] == []


@pytest.mark.nightly
@pytest.mark.ros
def test_a_kind_is_one_module_and_its_row(tmp_path: Path) -> None:
    """In a copy of the package: read from a rubric, drawn, sent to a worker, checked, played, judged and explained."""
    copy = tmp_path / "copy" / "grader"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(PACKAGE.parent / "rubrics", tmp_path / "copy" / "rubrics")
    (copy / "runtime" / "stimuli" / "burst.py").write_text(BURST.lstrip(), encoding="utf-8")
    table = copy / "runtime" / "stimuli" / "__init__.py"
    text = table.read_text(encoding="utf-8")
    text = text.replace(
        "from grader.runtime.stimuli.calls",
        "from grader.runtime.stimuli.burst import Burst\nfrom grader.runtime.stimuli.calls",
    )
    before, _, after = text.partition("\n)\n")  # the end of `KINDS`
    table.write_text(f"{before}\n    Burst,\n)\n{after}", encoding="utf-8")
    (tmp_path / "rubric.yaml").write_text(RUBRIC, encoding="utf-8")
    (tmp_path / "listener.py").write_text(LISTENER, encoding="utf-8")

    def grade(*words: str) -> str:
        command = [sys.executable, "-c", "from grader.cli.main import main; main()", *words]
        place = {"PYTHONPATH": str(tmp_path / "copy"), "XDG_CACHE_HOME": str(tmp_path / "cache")}
        done = subprocess.run(
            command, env={**os.environ, **place}, cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    assert "1 of 1" in grade("listener.py", "--rubric", "rubric.yaml", "--isolation", "none")
    said = grade("explain", "hears", "--rubric", "rubric.yaml")
    assert "the grader publishes 3 messages at once on /heat" in " ".join(said.split())
