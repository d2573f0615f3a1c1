"""Every parser of the grader is listed with where it runs and what limits it; a new one is not forgotten."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from parsers import PACKAGE, all_parsers, parsers_of
from places import ROOT

pytestmark = pytest.mark.xdist_group("source")

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
        ("from grader.runtime.programs.inert import read_inert\nread_inert(x)\n", {"Python"}),
        ("import codecs\ncodecs.decode(x, y)\n", {"text in any encoding"}),
    ],
)
def test_a_parser_is_found_by_its_import_or_call(tmp_path: Path, code: str, kinds: set[str]) -> None:
    """Whatever it is called in the module."""
    path = tmp_path / "module.py"
    path.write_text(code)
    assert parsers_of(path) == kinds


#: The modules of the contained process that read a submission, which no other process imports.
CONTAINED = (
    *("submission_reader", "program_reader", "project_reader", "setup_files", "cmake_files", "manifests"),
    *("reaching", "revealing"),
)


def test_nothing_in_the_grader_reads_a_submission_outside_of_the_contained_process() -> None:
    """Only that process knows TOML, INI files, setup.py, CMakeLists.txt, and what programs reach for."""
    found = all_parsers()
    assert {module for module, kinds in found.items() if "INI or templates" in kinds} == {
        "grader/grading/submissions/project_reader.py",
        "grader/grading/submissions/setup_files.py",
    }
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        known = rf"^\s*(from|import) .*\b({'|'.join(CONTAINED)})\b"
        assert path.stem in CONTAINED or not re.search(known, text, re.MULTILINE), path


def test_mutation_meets_no_program_of_a_student() -> None:
    """It parses the reference solution that an author's rubric names, for `grade selftest` alone."""
    package = PACKAGE / "course" / "mutation"
    importing = re.compile(r"^\s*(from|import) .*\bcourse(\.| import )mutation\b", re.MULTILINE)
    users = {path for path in PACKAGE.rglob("*.py") if importing.search(path.read_text(encoding="utf-8"))}
    outside = {path.relative_to(PACKAGE).as_posix() for path in users if not path.is_relative_to(package)}
    assert outside == {"cli/selftest.py"}


def test_no_trusted_process_parses_the_programs_of_students() -> None:
    """Neither to run them, nor to explain them. Who writes a row that is not listed here has to say why."""
    page = PAGE.read_text(encoding="utf-8")
    trusted = page[page.index("## In the worker") : page.index("## Nothing of a student")]
    parse = {
        module
        for module, kinds, _ in _ROW.findall(trusted)
        if {"Python", "text in any encoding"} & set(kinds.split(", "))
    }
    assert parse == {
        "grader/course/similarity/library.py",  # splits texts into tokens
        "grader/grading/submissions/source_encodings.py",  # looks for the declaration of an encoding
    }
