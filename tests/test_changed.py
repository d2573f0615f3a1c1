"""The tool that runs what a change can break: which tests it finds for which change."""

from __future__ import annotations

from pathlib import Path

import pytest
from changed import ROOT, breakable


def named(*paths: str) -> list[str]:
    return [str(path.relative_to(ROOT / "tests")) for path in breakable(paths)]


def test_a_module_breaks_what_imports_it() -> None:
    """Its own tests come first, others that reach it later, and what cannot reach it never."""
    found = named("grader/grading/judging/checks/rate.py")
    assert found.index("grading/judging/checks/test_rate.py") < found.index("cli/test_end_to_end.py")
    assert "runtime/worker/test_core.py" not in found
    assert "course/classroom/test_roster.py" not in found


@pytest.mark.breadth(0, 3)
@pytest.mark.parametrize(
    "module", ["grader/runtime/host/clock.py", "grader/runtime/worker/core.py", "grader/runtime/sandbox/probe.py"]
)
def test_what_runs_in_another_process_breaks_what_starts_it(module: str) -> None:
    """Nothing imports it there."""
    found = named(module)
    assert {"runtime/host/test_clock_for_real.py", "cli/test_end_to_end.py", "world/test_world.py"} <= set(found)


@pytest.mark.long
def test_a_module_breaks_what_reads_its_folder() -> None:
    """A test may import it by its place, and others look into all sources."""
    found = named("grader/runtime/host/inbox.py")
    assert {"runtime/host/test_inbox.py", "test_architecture.py"} <= set(found)


@pytest.mark.long
def test_a_module_breaks_the_tests_of_programs_that_name_it() -> None:
    """Such as pytest with the grader's plugin."""
    assert {"world/test_plugin.py", "world/test_races.py"} <= set(named("grader/pytest_plugin.py"))


@pytest.mark.long
def test_a_helper_breaks_the_tests_that_import_it() -> None:
    """However many helpers are between them."""
    found = named("tests/support/tracing.py")
    assert "grading/judging/checks/test_rate.py" in found
    assert "runtime/sandbox/test_isolation.py" not in found


@pytest.mark.long
def test_a_table_breaks_the_tests_of_its_folder() -> None:
    """A folder below `tests/` and the one in it."""
    found = named("tests/grading/judging/diagnosis/slips.yaml")
    assert "grading/judging/diagnosis/test_slips.py" in found
    assert {path.split("/")[0] for path in found} == {"grading"}


@pytest.mark.breadth(0, 5)
@pytest.mark.parametrize(
    ("path", "tests"),
    [
        ("docs/how-to/class.md", "test_documents.py"),
        ("README.md", "test_documents.py"),
        ("rubrics/exercise_1/rubric.yaml", "recorded/test_recorded.py"),
        (".github/workflows/tests.yml", "test_workplace.py"),
        ("examples/obstacle_stop/README.md", "test_examples.py"),
    ],
)
def test_another_file_breaks_the_tests_that_read_it(path: str, tests: str) -> None:
    """By the folder that it is in."""
    found = named(path)
    assert tests in found
    assert "runtime/worker/test_core.py" not in found


def test_a_file_that_everything_needs_breaks_everything() -> None:
    """What the tests are set up with."""
    everything = [path for path in Path(ROOT / "tests").rglob("test_*.py") if "workspace" not in path.parts]
    assert len(named("pyproject.toml")) == len(everything)
