"""The rubric by which attacking nodes are graded: exercise 1 in a short window, for many nodes at once."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

WINDOW = "2 s"
#: Small, so that those who try to reach them are stopped soon.
LIMITS = {"memory": "400 MiB", "processor_time": "20 s", "real_time": "30 s", "output": "1 MiB", "messages": 5000}


def publisher_rubric(names: Sequence[str]) -> str:
    """Return a rubric that asks the same of each file: the topic, the rate, the speed and a log record."""
    scenarios = [{"id": name, "processes": [f"{name}.py"], "observe": _window("/cmd_vel")} for name in names]
    return _rubric(names, scenarios, [criterion for name in names for criterion in _publisher(name)])


def controller_rubric(name: str) -> str:
    """Return a rubric that asks a fan controller to answer drawn temperatures."""
    drawn = [{"between": [20.5, 24]}, {"between": [27, 30]}, {"between": [20.5, 24]}, {"between": [27, 30]}]
    numbers = {"topic": "/temperature", "type": "std_msgs/msg/Float32", "values": drawn, "period": "200 ms"}
    stimulus = {"numbers": {**numbers, "hold": "600 ms", "start": "200 ms"}}
    scenario = {"id": name, "processes": [f"{name}.py"], "observe": {"duration": "3 s"}, "stimuli": [stimulus]}
    answers = {"input": "/temperature", "output": "/fan_speed", "threshold": 25, "above": 100, "otherwise": 0}
    criteria = [
        _criterion(name, "on", {"threshold_response": {**answers, "side": "above"}}),
        _criterion(name, "off", {"threshold_response": {**answers, "side": "at_or_below"}}),
        _criterion(name, "log", {"uses_logger": {"process": f"{name}.py"}}),
    ]
    return _rubric([name], [scenario], criteria)


def _window(topic: str) -> dict[str, str]:
    return {"duration": WINDOW, "after_first_message_on": topic, "wait_at_most": "20 s"}


def _publisher(name: str) -> list[dict[str, Any]]:
    rate = {"topic": "/cmd_vel", "rate": "20 Hz", "tolerance": "1 Hz", "window": WINDOW}
    return [
        _criterion(name, "topic", {"publishes": {"topic": "/cmd_vel", "type": "geometry_msgs/msg/Twist"}}),
        _criterion(name, "rate", {"topic_rate": rate}),
        _criterion(name, "speed", {"field_values": {"topic": "/cmd_vel", "values": {"linear.x": 0.5}}}),
        _criterion(name, "log", {"uses_logger": {"process": f"{name}.py"}}),
    ]


def _criterion(name: str, what: str, check: dict[str, Any]) -> dict[str, Any]:
    return {"id": f"{name}__{what}", "title": f"{name}: {what}", "points": 1, "scenario": name, "check": check}


def _rubric(names: Sequence[str], scenarios: list[dict[str, Any]], criteria: list[dict[str, Any]]) -> str:
    return json.dumps(
        {
            "schema": "grader/rubric/v1",
            "exercise": {"id": "attacks", "number": "1", "title": "Attacks", "required": True},
            "files": [f"{name}.py" for name in names],
            "limits": LIMITS,
            "scenarios": scenarios,
            "criteria": criteria,
        },
        indent=1,
    )
