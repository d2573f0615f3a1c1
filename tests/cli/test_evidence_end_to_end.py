"""Real runs kept as evidence: judged again they give the very same reports, and other tools read what was recorded."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from places import ROOT
from rosbags.highlevel import AnyReader
from sample_folders import folder_of
from tiers import more

from grader.cli import main

CRASHES = folder_of("broken/raises_in_callback")
FORMATS = {"json": "r.json", "text": "r.txt", "html": "r.html", "markdown": "r.md", "junit": "r.xml"}


def outputs(folder: Path) -> list[str]:
    folder.mkdir()
    return [word for name, file in FORMATS.items() for word in ("-o", f"{name}={folder / file}")]


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def run(*words: str) -> int:
    return CliRunner().invoke(main.app, list(words), catch_exceptions=False).exit_code


@pytest.mark.ros
@pytest.mark.parametrize("path", [*more([ROOT / "reference_solutions"]), CRASHES], ids=["right", "crashes"])
def test_every_format_is_the_same_byte_for_byte(tmp_path: Path, path: Any) -> None:
    """Grading keeps evidence; judging it again writes the same files with the same exit code."""
    graded, again, evidence = tmp_path / "graded", tmp_path / "again", tmp_path / "evidence"
    code = run(str(path), "-o", f"evidence={evidence}", "--exercise", "odom_subscriber", *outputs(graded))
    assert run("rejudge", str(evidence), "--verify", *outputs(again)) == code
    assert contents(graded) == contents(again)
    machine = [str(tmp_path), "/grade-"]
    recordings = [p for p in evidence.rglob("*") if p.suffix in (".mcap", ".yaml")]
    assert recordings
    assert not [p for p in recordings for text in machine if text.encode() in p.read_bytes()]


@pytest.mark.long
@pytest.mark.ros
def test_output_names_no_place_of_the_machine(tmp_path: Path) -> None:
    """A traceback that a program prints or logs is the same wherever it ran, also without a sandbox."""
    program = (ROOT / "reference_solutions/velocity_publisher.py").read_text(encoding="utf-8")
    assert "publish(" in program
    (tmp_path / "in").mkdir()
    head = "import sys, traceback\ntry:\n    1 / 0\nexcept ZeroDivisionError:\n    traceback.print_exc()\n"
    (tmp_path / "in/velocity_publisher.py").write_text(head + "print(__file__)\n" + program, encoding="utf-8")
    words = ["--exercise", "velocity_publisher", "--isolation", "none", "-o", f"evidence={tmp_path / 'e'}"]
    assert run(str(tmp_path / "in"), *words) in (0, 1)
    with AnyReader([tmp_path / "e/velocity_publisher.alone"]) as reader:
        chosen = [c for c in reader.connections if c.topic == "/grader/output"]
        lines = [json.loads(reader.deserialize(raw, c.msgtype).data)["text"] for c, _, raw in reader.messages(chosen)]
    assert "velocity_publisher.py" in lines
    assert '  File "velocity_publisher.py", line 3, in <module>' in lines


@pytest.mark.long
@pytest.mark.ros
def test_other_tools_read_what_both_nodes_said(tmp_path: Path) -> None:
    """Numbers in both directions with their virtual times, log records, output and the graph, all decodable."""
    done = run(
        str(ROOT / "reference_solutions"), "--exercise", "two_node_communication", "-o", f"evidence={tmp_path / 'e'}"
    )
    assert done == 0
    scenarios = sorted(p for p in (tmp_path / "e").iterdir() if p.is_dir())
    assert [p.name.partition(".")[2] for p in scenarios] == ["controller_alone", "sensor_alone", "together"]
    for scenario in scenarios:
        with AnyReader([scenario]) as reader:
            seen = [(c.topic, t, reader.deserialize(raw, c.msgtype)) for c, t, raw in reader.messages()]
        topics = {topic for topic, _, _ in seen}
        logs = set() if "controller" in scenario.name else {"/rosout"}
        assert {"/temperature", "/fan_speed", "/grader/run", "/grader/graph"} | logs <= topics
        assert "/grader/undecoded" not in topics
        assert [t for _, t, _ in seen] == sorted(t for _, t, _ in seen)
