"""Files that Python cannot compile, or that hold nothing, need no run; their trace is the one that a run records."""

from dataclasses import replace
from pathlib import Path

import pytest
from hostile import record

from grader.grading.submissions.sources import read_programs
from grader.runtime.model.trace import OutputLine, Trace
from grader.runtime.plan import Plan
from grader.runtime.session import RecordingSession
from grader.runtime.supervisor.unrunnable import trace_without_run

BROKEN = {
    "no_colon": "import rclpy\n\ndef main()\n    pass\n",
    "unfinished": "import rclpy\nrclpy.init(\n",
    "mixed_tabs": "if True:\n\tx = 1\n        y = 2\n",
    "indented": "import rclpy\n  rclpy.init()\n",
    "null_byte": "import rclpy\nx = '\0'\n",
    "unknown_encoding": "# -*- coding: klingon -*-\n",
    "markup": "```python\nimport rclpy\n```\n",
    "too_deep": f"x = {'(' * 5_000}{')' * 5_000}\n",
    "odd_escape": "x = '\\d'\ny = = 1\n",
}
#: What Python runs without doing anything.
INERT = {"empty": "", "comment": "# later\n", "text": '"""Publishes velocities."""\n\n\npass\n'}
#: What only the compiler or the program itself would find, after the file has been read.
ACCEPTED = {
    "return_outside": "import rclpy\nreturn 1\n",
    "odd_escape": "x = '\\d'\n",
    "text_of_parts": "f'{1 / 0}'\n",
    "raised": "raise SyntaxError('expected a colon')\n",
}


def _plan(folder: Path, *names: str) -> Plan:
    processes = tuple((name, name) for name in names)
    return Plan("alone", processes, str(folder), "ab" * 32, 10_000_000_000, "", 60_000_000_000, "virtual")


def _known(plan: Plan) -> Trace | None:
    """Return what is known of a run by what the contained process found in the files."""
    return trace_without_run(plan, read_programs(Path(plan.root))[0])


@pytest.mark.breadth(3, 12)
@pytest.mark.parametrize("name", BROKEN | INERT)
def test_the_trace_is_the_one_that_a_run_records(name: str, session: RecordingSession, tmp_path: Path) -> None:
    """All but the text that Python prints, which the report takes from the fault."""
    run = record(session, tmp_path / "in", (BROKEN | INERT)[name])
    known = _known(_plan(tmp_path / "in", "a.py"))
    assert known is not None
    assert known.observations == tuple(o for o in run.observations if not isinstance(o, OutputLine))
    assert known.observations
    assert (known.clock, known.stop_ns, known.starts, known.notes) == (run.clock, run.stop_ns, run.starts, run.notes)


@pytest.mark.parametrize("name", ACCEPTED)
def test_what_can_be_compiled_or_not_be_read_is_run(name: str, tmp_path: Path) -> None:
    """Only a process can tell what happens then."""
    (tmp_path / "a.py").write_text(ACCEPTED[name])
    assert _known(_plan(tmp_path, "a.py")) is None


@pytest.mark.parametrize("beside", ["__init__.py", "setup.py"])
def test_an_empty_file_of_a_package_is_run(beside: str, tmp_path: Path) -> None:
    """How it is started, and with what, only a process finds out."""
    for name in ("a.py", beside):
        (tmp_path / name).write_text("")
    assert _known(_plan(tmp_path, "a.py")) is None


def test_an_empty_file_that_starts_late_is_run(tmp_path: Path) -> None:
    """Its start is an event of the scenario."""
    (tmp_path / "a.py").write_text("")
    assert _known(replace(_plan(tmp_path, "a.py"), starts_ns=(("a.py", 5),))) is None


def test_a_scenario_is_run_if_any_of_its_files_can_be(tmp_path: Path) -> None:
    """The other node may earn points; two broken ones cannot."""
    for name, text in (("a.py", "("), ("b.py", ")"), ("c.py", "x = 1")):
        (tmp_path / name).write_text(text)
    both = _known(_plan(tmp_path, "a.py", "b.py"))
    assert both is not None
    assert [fault.process for fault in both.faults()] == ["a.py", "b.py"]
    assert _known(_plan(tmp_path, "a.py", "c.py")) is None
    assert _known(_plan(tmp_path, "a.py", "gone.py")) is None
