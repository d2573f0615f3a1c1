"""Every parser of the grader is listed with where it runs and what limits it; a new one is not forgotten."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from parsers import PACKAGE, all_parsers, parsers_of
from places import ROOT

PAGE = ROOT / "docs" / "reference" / "parsers.md"
_ROW = re.compile(r"^\| `(grader/[^`]+)` \| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)


def listed() -> dict[str, set[str]]:
    """Return what the page says that each module parses."""
    rows = _ROW.findall(PAGE.read_text(encoding="utf-8"))
    assert len({module for module, _, _ in rows}) == len(rows), "a module is listed twice"
    assert all(limit.strip() for _, _, limit in rows)
    return {module: set(kinds.strip().split(", ")) for module, kinds, _ in rows}


def test_the_page_lists_every_parser() -> None:
    """A module that parses something else than before needs a new look at its limits, then a new row."""
    assert listed() == all_parsers()


@pytest.mark.parametrize(
    ("code", "kinds"),
    [
        ("import json\njson.loads(x)\n", {"JSON"}),
        ("from json import load as read\nread(x)\n", {"JSON"}),
        ("import json\njson.dumps(x)\n", set()),
        ("import importlib\nimportlib.import_module('tomllib')\n", {"TOML"}),
        ("def f():\n    import xml.etree.ElementTree as ET\n", {"XML"}),
        ("import yaml as y\n", {"YAML"}),
        ("import ast as tree\ntree.parse(x)\n", {"Python"}),
        ("import ast\nast.walk(x)\n", set()),
        ("eval(x)\n", {"Python that runs"}),
        ("def eval(x): ...\nthing.eval(x)\n", set()),
        ("from zipfile import ZipFile\n", {"archives"}),
        ("import tarfile\n", {"archives"}),
        ("import pickle\n", {"pickle"}),
        ("from rclpy.serialization import deserialize_message\n", {"CDR or MCAP"}),
        ("import struct\nstruct.pack('I', 1)\n", set()),
        ("import struct\nstruct.unpack('I', x)\n", {"binary"}),
        ("import re\nre.fullmatch(x, y)\n", {"regular expressions"}),
        ("import re\nre.escape(x)\n", set()),
    ],
)
def test_a_parser_is_found_by_its_import_or_call(tmp_path: Path, code: str, kinds: set[str]) -> None:
    """Whatever it is called in the module."""
    path = tmp_path / "module.py"
    path.write_text(code)
    assert parsers_of(path) == kinds


def test_nothing_in_the_grader_reads_project_files_outside_of_the_contained_process() -> None:
    """Only that process knows TOML, INI files, and how to evaluate setup.py and CMakeLists.txt; nobody imports it."""
    found = all_parsers()
    assert {module for module, kinds in found.items() if "INI or templates" in kinds} == {
        "grader/grading/submissions/project_reader.py",
        "grader/grading/submissions/setup_files.py",
    }
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        own = path.name in ("project_reader.py", "setup_files.py", "cmake_files.py")
        known = r"^\s*(from|import) .*\b(project_reader|setup_files|cmake_files)\b"
        assert own or not re.search(known, text, re.MULTILINE), path
