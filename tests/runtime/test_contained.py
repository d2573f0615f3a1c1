"""A process that reads what students made finds the grader, whether it is installed or not."""

import os
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import grader
from grader.runtime.contained import run_contained


def test_it_imports_the_grader_that_started_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """First in its path is the folder that holds the package, and not the package: its modules are no others' names."""
    seen: dict[str, Any] = {}

    def run(command: list[str], **options: Any) -> SimpleNamespace:
        seen.update(options)
        return SimpleNamespace(returncode=7)

    monkeypatch.setattr(subprocess, "run", run)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["relative", str(tmp_path)]))
    (tmp_path / "in").touch()
    with (tmp_path / "in").open("rb") as given, (tmp_path / "out").open("wb") as out:
        assert run_contained("grader.some", {}, given, out) == 7
    assert seen["env"]["PYTHONPATH"].split(os.pathsep) == [str(Path(grader.__path__[0]).parent), str(tmp_path)]
