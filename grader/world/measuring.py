"""Finds out whether coverage.py measures this process, so that it measures the programs that a test starts as well."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

#: What coverage.py may be told about what it measures; a version that does not know one has no such option.
OPTIONS = (
    *("branch", "concurrency", "core", "cover_pylib", "dynamic_context", "include", "omit", "patch", "plugins"),
    *("relative_files", "sigterm", "source", "source_dirs", "source_pkgs", "timid"),
)
#: Those of them that hold paths, relative to where the measurement began; in the first, some are names of packages.
FOLDERS, PATTERNS = ("source", "source_dirs"), ("include", "omit")
#: What it says about a process that happens not to run a file that is measured.
NEEDLESS_WARNINGS = ("module-not-imported", "module-not-measured", "module-not-python", "no-data-collected")


def measured_lines(folder: Path, *, combines: bool = False) -> str:
    """Return how to measure the lines of programs, as `Plan.measured`; empty if this process is not measured.

    Nobody would read what the programs write where coverage.py writes one file for this process alone.

    Args:
        folder: The working directory in which the measurement began.
        combines: Whether several files are put together in any case, as pytest-cov does.
    """
    coverage: Any = sys.modules.get("coverage")
    current: Any = None if coverage is None else coverage.Coverage.current()
    if current is None or not (combines or current.get_option("run:parallel")):
        return ""
    options: dict[str, Any] = {}
    for name in OPTIONS:
        try:
            value = current.get_option(f"run:{name}")
        except coverage.CoverageException:
            continue
        if name in FOLDERS and value:
            value = [str(folder / one) if (folder / one).is_dir() else one for one in value]
        elif name in PATTERNS and value:
            value = [one if one.startswith(("*", "?")) else str(folder / one) for one in value]
        elif name == "patch" and value:
            value = [one for one in value if one != "subprocess"]  # it is what this module does
        if value:
            options[f"run:{name}"] = value
    options["run:disable_warnings"] = [*current.get_option("run:disable_warnings"), *NEEDLESS_WARNINGS]
    told = {
        "folder": str(Path(coverage.__file__).parents[1]),
        "data_file": str(folder / current.get_option("run:data_file")),
        "options": options,
    }
    return json.dumps(told)
