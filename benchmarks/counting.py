"""Counts the processor time and the instructions of a command and of all that it starts, with `perf stat`.

A process learns nothing of children that are killed with their process namespace, as workers are.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Counts:
    """Processor time in seconds, and instructions outside of the kernel; None if this machine cannot count them."""

    processor_s: float
    instructions: int | None


def counted(command: Sequence[str], into: Path) -> list[str]:
    """Return the command that runs another one and writes its counts into a file."""
    if shutil.which("perf") is None:
        raise SystemExit("expected the program perf, found none: install linux-perf (Debian) or linux-tools (Ubuntu)")
    events = ["--event", "task-clock", "--event", "instructions:u"]
    return ["perf", "stat", "--field-separator", ",", *events, "--output", str(into), "--", *command]


def counts(written: Path) -> Counts:
    """Read the counts that a command of `counted` has written."""
    rows = [line.split(",") for line in written.read_text(encoding="utf-8").splitlines() if "," in line]
    values = {row[2]: row[0] for row in rows}
    instructions = values.get("instructions:u", "")
    return Counts(float(values["task-clock"]) / 1e3, int(instructions) if instructions.isdecimal() else None)
