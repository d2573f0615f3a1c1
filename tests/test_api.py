"""The public interface: its names and signatures are pinned, and nothing else of the package is used from outside."""

from __future__ import annotations

import ast
import inspect
import os
import re
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from types import ModuleType
from typing import Any

import generated
import pytest
from places import ROOT, TESTS

import grader
from grader import api
from grader.api import unstable
from grader.grading.model import exercise
from grader.runtime.model import errors

PINNED = TESTS / "api.txt"
#: What may change is pinned, too: that it does is meant, then.
UNSTABLE = TESTS / "api_unstable.txt"
DOORS = {api: PINNED, unstable: UNSTABLE}
#: Python that authors write, or copy from a page.
PAGES = sorted([*(ROOT / "docs").rglob("*.md"), *(ROOT / "examples").rglob("*.md"), ROOT / "README.md"])
SCRIPTS = sorted([*(ROOT / "examples").rglob("*.py")])


def signature(value: Any) -> str:
    if inspect.isclass(value) and issubclass(value, BaseException):
        return f"({value.__bases__[0].__name__})"
    if inspect.isclass(value) and issubclass(value, Enum):
        return f": {' '.join(value.__members__)}"
    if inspect.isclass(value) and getattr(value, "_is_protocol", False):
        return f": {' '.join(sorted(name for name in vars(value) if not name.startswith('_')))}"
    return re.sub(r"<[^<>]* at 0x[0-9a-f]+>", "...", str(inspect.signature(value)))


def described(door: ModuleType, name: str) -> str:
    value = inspect.unwrap(getattr(door, name))  # one that remembers results is a function too
    plain = inspect.isfunction(value) or (inspect.isclass(value) and not hasattr(value, "__args__"))
    return f"{name}{signature(value)}" if plain else f"{name}: {value!r}"


@pytest.mark.parametrize("door", DOORS, ids=lambda door: door.__name__)
def test_names_and_signatures_are_pinned(door: ModuleType) -> None:
    """A change of the file is a change for everybody who wrote a check; `UPDATE_GOLDEN=1` writes it."""
    text = "".join(f"{described(door, name)}\n" for name in door.__all__)
    if os.environ.get("UPDATE_GOLDEN"):
        DOORS[door].write_text(text, encoding="utf-8")
    assert DOORS[door].read_text(encoding="utf-8") == text


@pytest.mark.parametrize("door", DOORS, ids=lambda door: door.__name__)
def test_every_name_is_described_and_on_its_page(door: ModuleType) -> None:
    """By its docstring, or by the comment above a constant."""
    page = (ROOT / "docs/reference" / ("api.md" if door is api else "api-unstable.md")).read_text(encoding="utf-8")
    assert [name for name in door.__all__ if f"\n### `{name}`\n" not in page] == []
    assert [name for name in door.__all__ if not generated.about(door, name).strip()] == []


def test_no_name_is_in_both() -> None:
    """What is promised cannot change."""
    assert set(api.__all__) & set(unstable.__all__) == set()


@pytest.mark.parametrize("door", DOORS, ids=lambda door: door.__name__)
def test_every_name_is_there_once_and_type_checkers_know_it(door: ModuleType) -> None:
    """The table, by which names are imported, and the imports for type checkers are the same."""
    tree = ast.parse(Path(str(door.__file__)).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    typed = {
        str(alias.asname): (str(node.module), alias.name)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    functions = {"grade", "observe", "rejudge"} if door is api else set()
    assert len(door.__all__) == len(set(door.__all__))
    assert set(door.__all__) == {*typed} | functions
    assert set(dir(door)) == set(door.__all__)
    for name, (home, own) in typed.items():
        assert getattr(door, name) is getattr(sys.modules[home], own)
    with pytest.raises(AttributeError, match="has no attribute nothing"):
        door.nothing  # noqa: B018


def test_every_error_is_public_and_in_the_tree_of_the_docstring() -> None:
    """Who must act is said there for each."""
    known = {name for name, kind in vars(errors).items() if isinstance(kind, type) and issubclass(kind, Exception)}
    assert known == set(api.CONTENTS["Errors"]["grader.runtime.model.errors"].split())
    assert all(re.search(rf"\b{name}\b", errors.__doc__ or "") for name in known)


def grader_imports(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] == "grader")
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "grader":
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def private(source: str) -> list[str]:
    """Return what a program imports of the package and may not."""
    public = {f"{door.__name__}.{name}" for door in DOORS for name in door.__all__}
    return [name for name in grader_imports(ast.parse(source)) if name not in public]


def test_examples_and_pages_use_only_public_names() -> None:
    """So does what is copied from them."""
    texts = {str(path): path.read_text(encoding="utf-8") for path in SCRIPTS}
    for page in PAGES:
        blocks = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
        texts |= {f"{page}, block {n}": textwrap.dedent(block) for n, block in enumerate(blocks, 1)}
    assert {where: private(text) for where, text in texts.items() if private(text)} == {}
    assert sum(bool(list(grader_imports(ast.parse(text)))) for text in texts.values()) > 3


@pytest.mark.parametrize(
    "line",
    [
        "import grader.runtime.model.trace",
        "from grader.runtime.model.trace import Trace",
        "from grader.api import secret",
    ],
)
def test_a_planted_import_is_found(line: str) -> None:
    """The rule can fail."""
    assert private(line)


def modules_of(code: str) -> set[str]:
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys\nprint(*sys.modules)"], capture_output=True, text=True, check=True
    )
    return set(done.stdout.split())


def test_a_simulation_imports_neither_judging_nor_its_libraries() -> None:
    """It runs beside the nodes, where they are not there."""
    names = " ".join(api.CONTENTS["Simulations"].values()).replace(" ", ", ")
    loaded = modules_of(f"from grader.api import DurationNs, Topic, seconds, {names}")
    assert "grader.runtime.simulation.robots" in loaded
    assert not {name for name in loaded if re.match(r"grader\.(judging|reporting|app)|msgspec|pydantic", name)}


def test_commands_do_not_import_the_public_interface() -> None:
    """It is for others."""
    assert "grader.api" not in modules_of("import grader.cli.main")


def test_the_members_of_a_check_are_declared_in_one_place() -> None:
    """What the grader asks of a check is a member of the protocol; nothing else is looked up by a literal name."""
    members = {name for name in vars(exercise.Check) if not name.startswith("_")}
    assert members == {"judge", "roles", "measures", "expected", "drawing", "judge_sources", "of_beginning"}
    asked: set[str] = set()
    for path in (Path(grader.__file__).parent / "grading" / "judging").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            named = node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""
            if named in ("getattr", "has_member") and isinstance(node, ast.Call):
                about = ast.unparse(node.args[0])
                if re.fullmatch(r"(\w+\.)?check|kind", about) and isinstance(node.args[1], ast.Constant):
                    asked.add(str(node.args[1].value))
    assert {"drawing", "expected"} <= asked <= members
