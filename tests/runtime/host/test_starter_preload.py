"""What is imported for a student's file before time starts."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from stage import program


@pytest.fixture
def imported(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the names that were asked for, in order, while nothing is really imported."""
    names: list[str] = []
    monkeypatch.setattr(importlib, "import_module", names.append)
    return names


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("from std_msgs.msg import Float32", ["std_msgs.msg"]),
        ("import geometry_msgs.msg as g\nfrom std_srvs.srv import Trigger", ["geometry_msgs.msg", "std_srvs.srv"]),
        ("print('no node')", []),
    ],
)
def test_only_interfaces_that_a_file_names_are_imported(
    tmp_path: Path, text: str, names: Sequence[str], imported: Sequence[Any]
) -> None:
    """A fan controller does not wait for the numpy of other messages."""
    (tmp_path / "node.py").write_text(text, encoding="utf-8")
    program.preload(str(tmp_path / "node.py"))
    assert imported == names


def test_a_file_that_is_not_there_names_nothing(tmp_path: Path, imported: Sequence[Any]) -> None:
    """Running it says that it is missing, not the import before."""
    program.preload(str(tmp_path / "missing.py"))
    assert imported == []
