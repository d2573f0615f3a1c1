"""What the documents name exists: every link, and every path of this repository in code."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
DOCUMENTS = [
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "README.md",
    "ROADMAP.md",
    "SECURITY.md",
    *sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "docs").rglob("*.md")),
]

_LINK = re.compile(r"\]\(([^)\s]+)\)")
_CODE = re.compile(r"`([^`\n]+)`")
#: The end of the name of a format, which looks like a path.
_SCHEMA = re.compile(r"/v\d+$")
#: A folder at the top and what follows; a file at the top. `{a,b}` stands for several, `*` for any.
_PATH = re.compile(
    r"(?<![\w./-])(?:(?:grader|tests|docs|rubrics|integrations|benchmarks|reference_solutions|student_template|\.ci)/[\w./*{},-]*"
    r"|(?:ARCHITECTURE|CONTRIBUTING|README|CHANGELOG)\.md|pyproject\.toml|action\.yml|\.pre-commit-config\.yaml)"
)


def links(text: str) -> Iterator[str]:
    """Yield the targets of links to files, without the place in them."""
    for target in _LINK.findall(text):
        if "://" not in target and not target.startswith(("#", "mailto:")):
            yield target.partition("#")[0]


def paths(text: str) -> Iterator[str]:
    """Yield the paths in code that begin at the top of the repository."""
    for code in _CODE.findall(text):
        for path in _PATH.findall(code):
            before, brace, rest = path.partition("{")
            inside, _, after = rest.partition("}")
            yield from (f"{before}{one}{after}" for one in inside.split(",")) if brace else [path]


def missing(text: str, folder: Path) -> list[str]:
    """Return what a document in a folder names and nobody finds."""
    dead = [target for target in links(text) if not (folder / target).exists()]
    named = [path for path in paths(text) if not _SCHEMA.search(path)]
    return dead + [path for path in named if not any(ROOT.glob(path.rstrip("/")))]


@pytest.mark.parametrize("document", DOCUMENTS)
def test_what_a_document_names_exists(document: str) -> None:
    """Also after a file is moved."""
    path = ROOT / document
    assert missing(path.read_text(encoding="utf-8"), path.parent) == []


def test_what_does_not_exist_is_found() -> None:
    """A link, a path, a path inside a command, one of several, and a pattern that fits nothing."""
    text = (
        "[a](docs/none.md#part) [b](README.md) [c](https://a.b/c) `grader/none.py` `python tests/none.py --all`"
        " `grader/student_host/{clock,none}.py` `rubrics/*.none` `rubrics/*.yaml` `out/grader/x.py`"
    )
    wanted = ["docs/none.md", "grader/none.py", "tests/none.py", "grader/student_host/none.py", "rubrics/*.none"]
    assert missing(text, ROOT) == wanted
