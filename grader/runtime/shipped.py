"""Where the files are that ship with the grader: in a checkout beside the package, in a wheel inside of it."""

from __future__ import annotations

from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent


def shipped(name: str, package: Path = PACKAGE) -> Path:
    """Return a shipped folder: `rubrics`, `student_template` or `integrations`."""
    inside = package / "shipped" / name
    return inside if inside.is_dir() else package.parent / name
