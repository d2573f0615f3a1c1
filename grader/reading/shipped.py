"""Where the files lie that come with the grader: beside the package in a checkout, inside it in a wheel."""

from __future__ import annotations

from pathlib import Path


def shipped(name: str) -> Path:
    """Return a folder that comes with the grader: `rubrics`, `student_template` or `integrations`."""
    package = Path(__file__).resolve().parent.parent
    inside = package / "shipped" / name
    return inside if inside.is_dir() else package.parent / name


def shipped_folder() -> Path:
    """Return the folder of the built-in rubrics and of the recording."""
    return shipped("rubrics")


def shipped_templates() -> Path:
    """Return the folder of the templates that students begin with."""
    return shipped("student_template")


def builtin_odometry() -> Path:
    """Return the project's own /odom recording."""
    return shipped_folder() / "odometry"
