"""Packages that add something to the grader, taken from the page that shows them or written for a test."""

import importlib
import os
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest
from places import ROOT

_FILE = re.compile(r"^`([\w./-]+)`:\n\n```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def files_of(page: str) -> dict[str, str]:
    """Return the files that a page shows whole, by their names."""
    return dict(_FILE.findall((ROOT / page).read_text(encoding="utf-8")))


def installed(files: Mapping[str, str], folder: Path) -> Path:
    """Build a package with pip, without a network, install it into a new folder, and return this."""
    for name, text in files.items():
        place = folder / "source" / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, encoding="utf-8")
    target = folder / "installed"
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    offline = ["--no-index", "--no-deps", "--no-build-isolation", "--target", str(target)]
    subprocess.run([*pip, *offline, str(folder / "source")], check=True, capture_output=True, timeout=300)
    return target


def grade(
    *arguments: str, packages: Path, cwd: Path, environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run `grade` where the packages in a folder are installed as well."""
    command = [sys.executable, "-c", "from grader.cli.main import main; main()", *arguments]
    paths = os.pathsep.join(filter(None, [str(packages), str(ROOT), os.environ.get("PYTHONPATH", "")]))
    around = {**os.environ, "PYTHONPATH": paths, "COLUMNS": "120", **(environment or {})}
    return subprocess.run(command, cwd=cwd, env=around, capture_output=True, text=True, check=False, timeout=300)


def register(
    folder: Path, group: str, entries: Mapping[str, str], module: str, *, name: str = "mine", version: str = "1.0"
) -> None:
    """Write what pip leaves of a package with one module `NAME_module`: the module and its metadata."""
    information = folder / f"{name}-{version}.dist-info"
    information.mkdir(parents=True)
    (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    lines = "".join(f"{entry} = {value}\n" for entry, value in entries.items())
    (information / "entry_points.txt").write_text(f"[{group}]\n{lines}")
    (folder / f"{name}_module.py").write_text(module, encoding="utf-8")


def made_importable(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Add the packages in a folder to this process."""
    monkeypatch.syspath_prepend(folder)
    importlib.invalidate_caches()
