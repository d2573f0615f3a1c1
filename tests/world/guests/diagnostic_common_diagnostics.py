"""A node that reports the load of the processors."""

from pathlib import Path

import pytest

HERE = "../diagnostic_common_diagnostics/cpu_monitor.py"
ENV = {"PYTHONPATH": str(Path(__file__).resolve().parents[2] / "diagnostic_updater")}


def test_rate(ros):
    ros.run(HERE, env=ENV)
    ros.advance(5.0)
    assert ros.rate("/diagnostics") == pytest.approx(1.0)


def test_ok(ros):
    ros.run(HERE, env=ENV, parameters={"warning_percentage": 1000})
    ros.advance(3.0)
    status = ros.messages("/diagnostics")[-1].status[0]
    assert status.name.endswith("CPU Information")
    assert status.level == b"\0"


def test_threshold(ros):
    ros.run(HERE, env=ENV, parameters={"warning_percentage": -1})
    ros.advance(3.0)
    assert ros.messages("/diagnostics")[-1].status[0].level == b"\1"
