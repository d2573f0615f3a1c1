"""The submissions and what they are worth belong together: every folder has its entry, every entry its folder."""

from __future__ import annotations


from pathlib import Path
from typing import Any

import pytest
from archive import expected

from grader.core.exercise import Outcome

HERE = Path(__file__).parent
GROUPS = ("correct", "threads", "wrong", "broken")
NOT_PYTHON = {
    "broken/syntax_error",
    "broken/mixed_tabs",
    "broken/python2_print",
    "broken/null_bytes",
    "broken/notebook_magic",
}
MISSPELT = {"broken/misspelt_file", "broken/controller_missing", "broken/notebook_file"}
#: Right programs that import a ROS package which the wheels lack.
LACKING = {"broken/ros_package_missing"}

FILES = {
    "velocity_publisher": {"velocity_publisher.py"},
    "odom_subscriber": {"odom_subscriber.py"},
    "two_node_communication": {"temperature_sensor.py", "fan_controller.py"},
    "joint_publisher": {"simple_publisher.py"},
    "joint_subscriber": {"simple_subscriber.py"},
    "battery_service": {"battery_service_server.py", "battery_service_client.py"},
}
CRITERIA = {
    "velocity_publisher": {"publishes_twist", "rate", "linear_velocity", "angular_velocity", "logging"},
    "odom_subscriber": {"subscribes_odom", "logs_position", "log_period", "waits_gracefully"},
    "two_node_communication": {
        "temperature_rate",
        "temperature_range",
        "logs_fan_speed",
        "fan_on_above_25",
        "fan_off_at_or_below_25",
        "runs_together",
        "bidirectional_graph",
    },
    "joint_publisher": {"publishes_float64", "rate", "angle", "log_every_10th"},
    "joint_subscriber": {"subscribes_joint_commands", "logs_radians", "logs_degrees", "waits_gracefully"},
    "battery_service": {
        "offers_service",
        "answers_many_clients",
        "response_text",
        "drains_half_percent",
        "starts_again_at_100",
        "waits_for_service",
        "asks_five_times",
        "goes_on_above_20",
        "aborts_at_or_below_20",
        "no_go_when_refused",
        "no_go_when_puzzled",
        "no_go_when_deserted",
        "runs_together",
    },
}

MANIFEST = expected()
ENTRIES = pytest.mark.parametrize(("folder", "entry"), MANIFEST.items(), ids=list(MANIFEST))


def test_every_folder_is_listed() -> None:
    """No submission is forgotten, and none is expected that is not there."""
    folders = {f"{group}/{path.name}" for group in GROUPS for path in (HERE / group).iterdir() if path.is_dir()}
    assert folders == set(MANIFEST)


@ENTRIES
def test_entry_is_well_formed(folder: str, entry: dict[str, Any]) -> None:
    """Ids and outcomes are those of the exercises; undecided is only what this installation lacks."""
    assert set(entry) == {"about", "graded", "expected"}
    assert set(entry["expected"]) <= set().union(*(CRITERIA[e] for e in entry["graded"]))
    allowed = {Outcome.UNDECIDED} if folder in LACKING else {Outcome.PARTLY, Outcome.NOT_MET, Outcome.BLOCKED}
    assert set(entry["expected"].values()) <= {o.value for o in allowed}
    if folder.startswith(("correct/", "threads/")):
        assert entry["expected"] == {}
    if folder.startswith("wrong/"):
        assert entry["expected"] != {}


@ENTRIES
def test_files_are_those_of_the_exercise(folder: str, entry: dict[str, Any]) -> None:
    """Each exercise's files are there under their names, and those of no other exercise."""
    names = {path.name for path in (HERE / folder).rglob("*.py")}
    wanted = set().union(*(FILES[e] for e in entry["graded"]))
    others = set().union(*FILES.values()) - wanted
    assert (wanted <= names) is (folder not in MISSPELT)
    assert not names & others


@ENTRIES
def test_files_compile(folder: str, entry: dict[str, Any]) -> None:
    """Every file is Python that compiles without a warning, except where that is its fault."""
    sources = [(path.read_bytes(), str(path)) for path in sorted((HERE / folder).rglob("*.py"))]
    if folder in NOT_PYTHON:
        with pytest.raises((SyntaxError, ValueError)):  # ValueError: how Python 3.11 and older say NUL bytes
            compile(*sources[0], "exec")
        return
    for source, name in sources:
        compile(source, name, "exec")
