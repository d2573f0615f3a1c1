"""What the documents name exists: links, paths of this repository, commands with their options, and messages.

What the site adds, it takes from the code.
"""

import ast
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import click
import generated
import pytest
from click.testing import CliRunner
from parsed_commands import parsed
from places import ROOT
from sample_folders import GOLDEN, collections
from source_trees import nodes_in

from grader.cli.main import app
from grader.grading.judging.checks import CHECKS
from grader.grading.model.rubric_files import rubric_file

DOCUMENTS = [
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "README.md",
    "ROADMAP.md",
    "SECURITY.md",
    *sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "docs").rglob("*.md")),
    *sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "rubrics").glob("*/README.md")),
]

_LINK = re.compile(r"\]\(([^)\s]+)\)")
_CODE = re.compile(r"`([^`\n]+)`")
_ONLY_SITE = re.compile(r"<!-- site: .*? -->", re.DOTALL)
#: The usage of a command, on the page that is made from the code.
_USAGE = re.compile(r"\[OPTIONS\]|\[SUBMISSION\]|\w+\.\.\.$")
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
    """Return what a document in a folder names and nobody finds; what only the site has, MkDocs checks."""
    text = _ONLY_SITE.sub("", text)
    made = [f"examples/{exercise}.html" for exercise in generated.EXAMPLES]
    dead = [target for target in links(text) if not (folder / target).exists() and target not in made]
    named = [str(rubric_file(Path(path))) for path in paths(text) if not _SCHEMA.search(path)]
    return dead + [path for path in named if not any(ROOT.glob(path.rstrip("/")))]


#: A script of this repository in a command, such as `.venv/bin/python docs/generated.py`.
_SCRIPT = re.compile(r"\bpython3? ((?:benchmarks|docs|tests)/[\w/]+\.py)")
#: Runs a script as far as its imports, which find what is in its folder.
_LOAD = "import os, runpy, sys; p = sys.argv[1]; sys.path[0] = os.path.dirname(p); runpy.run_path(p, run_name='loaded')"


@pytest.mark.long
@pytest.mark.slow
def test_scripts_in_documents_find_what_they_import(tmp_path: Path) -> None:
    """In a shell, which has no settings of pytest; each in a process of its own."""
    found = {path for name in DOCUMENTS for path in _SCRIPT.findall((ROOT / name).read_text(encoding="utf-8"))}
    assert "tests/recorded/record.py" in found
    lost = tmp_path / "lost.py"
    lost.write_text("import class_of_nowhere\n")
    told = {path: _loading(path) for path in (*sorted(found), str(lost))}
    assert "class_of_nowhere" in told.pop(str(lost))
    assert {path: said for path, said in told.items() if said} == {}


def _loading(path: str) -> str:
    """Return what a script says that cannot be loaded."""
    command = [sys.executable, "-c", _LOAD, path]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stderr if done.returncode else ""


@pytest.mark.parametrize("document", DOCUMENTS)
def test_what_a_document_names_exists(document: str) -> None:
    """Also after a file is moved."""
    path = ROOT / document
    assert missing(path.read_text(encoding="utf-8"), path.parent) == []


#: A row of the table that says where a question is answered: the names that answer it, and the files that have them.
_ANSWERED = re.compile(r"^\| [^|]*\? [^|]*\| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)
_NAME = re.compile(r"[A-Za-z_][\w.]*")


def test_what_answers_a_question_is_in_the_files_beside_it() -> None:
    """In the table of ARCHITECTURE.md; a name that moves takes its row along."""
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    rows = _ANSWERED.findall(text)
    assert len(rows) > 10
    for answer, files in rows:
        found = [path for named in paths(files) for path in ROOT.glob(named.rstrip("/")) if path.is_file()]
        code = "\n".join(path.read_text(encoding="utf-8") for path in found)
        names = [name for name in _CODE.findall(answer) if _NAME.fullmatch(name)]
        assert [name for name in names if not re.search(rf"\b{re.escape(name)}\b", code)] == []


def test_what_does_not_exist_is_found() -> None:
    """A link, a path, a path inside a command, one of several, and a pattern that fits nothing."""
    text = (
        "[a](docs/none.md#part) [b](README.md) [c](https://a.b/c) `grader/none.py` `python tests/none.py --all`"
        " `grader/runtime/host/{clock,none}.py` `rubrics/*.none` `rubrics/*/*.yaml` `out/grader/x.py`"
    )
    wanted = ["docs/none.md", "grader/none.py", "tests/none.py", "grader/runtime/host/none.py", "rubrics/*.none"]
    assert missing(text, ROOT) == wanted


_GRADE = re.compile(r"^(?:\$ )?(?:\S+/bin/)?grade (.*)$")
#: What follows a command in its line: a remark, or a redirection.
_REST = re.compile(r"(?: {2,}| [>|#]>? ).*$")
#: A drawing, and what is quoted of other tools.
_NO_COMMAND = ("(reads", "<", "-ohtml", "--")


def grade_commands(text: str) -> Iterator[str]:
    """Yield what follows `grade` where a document shows it with arguments: in blocks, and in sentences."""
    lines = re.findall(r"^(?: {4,}|\$ )(.*)$", text, re.MULTILINE)
    for shown in (*lines, *_CODE.findall(text)):
        found = _GRADE.match(shown.strip())
        if found and not found[1].startswith(_NO_COMMAND) and not _USAGE.search(found[1]):
            yield _REST.sub("", found[1])


@pytest.mark.parametrize("document", DOCUMENTS)
def test_every_command_shown_can_be_parsed(document: str) -> None:
    """Its subcommand and its options exist and take what they are given; those of the tutorials are also run."""
    for command in grade_commands((ROOT / document).read_text(encoding="utf-8")):
        parsed(shlex.split(command))


@pytest.mark.parametrize("command", ["rejudge a --rubrik b", "nonsense --exercise", "a -o nothing=b", "batch a"])
def test_a_wrong_command_is_found(command: str) -> None:
    """An option that does not exist, one without its value, a value that is none, and a missing option."""
    with pytest.raises(click.ClickException):
        parsed(shlex.split(command))


@cache
def _said() -> list[str]:
    """Return the lines of all texts of the grader's code, values as `...`, and what students of the tests are told."""
    texts = []
    for path in sorted((ROOT / "grader").rglob("*.py")):
        for node in nodes_in(path):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                texts.append(node.value)
            elif isinstance(node, ast.JoinedStr):
                texts.append("".join(str(p.value) if isinstance(p, ast.Constant) else "..." for p in node.values))
    golden = [(collection / GOLDEN).read_text(encoding="utf-8") for collection in collections()]
    return "\n".join([*texts, *golden]).splitlines()


def _messages() -> list[str]:
    text = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
    return re.findall(r"^\| `([^`]+)` \|", text, re.MULTILINE)


def _exists(message: str) -> bool:
    return any(_follow(line, message.split("...")) for line in _said())


def _follow(line: str, parts: list[str]) -> bool:
    """Return whether a line has these parts in their order."""
    end = 0
    for part in parts:
        at = line.find(part, end)
        if at < 0:
            return False
        end = at + len(part)
    return True


@pytest.mark.xdist_group("source")
def test_every_message_explained_still_exists() -> None:
    """In the code, or in what students of the tests are told; `...` stands for anything."""
    assert len(_messages()) > 30
    assert [message for message in _messages() if not _exists(message)] == []


@pytest.mark.xdist_group("source")
def test_a_message_that_nothing_says_is_found() -> None:
    """The comparison can fail."""
    assert not _exists("the robot ... is sad")


def test_every_limit_has_its_reason() -> None:
    """In a comment above it, which the page about limits shows."""
    rows = [line for line in generated.limits().splitlines() if line.startswith("| `")]
    assert len(rows) > 200
    assert [row for row in rows if row.endswith("|  |")] == []


@pytest.mark.parametrize("document", [d for d in DOCUMENTS if "<!-- generated: " in (ROOT / d).read_text("utf-8")])
def test_what_is_generated_is_current(document: str) -> None:
    """`python docs/generated.py` renews it."""
    text = (ROOT / document).read_text(encoding="utf-8")
    assert generated.renewed(text) == text


def test_an_old_part_is_noticed() -> None:
    """And what stands around it is kept."""
    old = "# Commands\n\n<!-- generated: commands -->\nold\n<!-- end of generated: commands -->\n\nMore.\n"
    new = generated.renewed(old)
    assert "old\n" not in new
    assert new.startswith("# Commands\n\n<!-- generated: commands -->\n\n## `grade`\n")
    assert new.endswith("\n\n<!-- end of generated: commands -->\n\nMore.\n")


@pytest.mark.parametrize("words", [["-h"], ["batch", "-h"], ["rubric", "check", "-h"]])
def test_commands_that_were_described_and_parsed_are_as_before(words: list[str]) -> None:
    """In one process: a command of click keeps the help option of the first context that it is seen in."""
    generated.commands()
    parsed(shlex.split("batch --help"))
    assert CliRunner().invoke(app, words, prog_name="grade").exit_code == 0


@pytest.mark.long
def test_the_site_names_every_command_option_check_and_key() -> None:
    """The pages are made from the code; nothing of it is left out."""
    commands, checks, grammar, gallery, examples, *_ = (make() for make in generated.NAMES.values())
    for name in app.names:
        command = app.get_command(click.Context(app), name)
        assert command is not None, name
        described = [parameter for parameter in command.params if not getattr(parameter, "hidden", False)]
        options = [option for parameter in described for option in parameter.opts if option.startswith("--")]
        assert command.hidden or f"`grade {name}`" in commands
        assert [option for option in options if option not in commands] == []
    assert [name for name in CHECKS if f"\n## {name}\n" not in checks] == []
    assert [
        word for word in ("just_above", "stimuli", "cancel_after", "some_of", "copies") if f"`{word}`" not in grammar
    ] == []
    assert [name for name in generated.exercises() if f'<a id="{name}"></a>' not in gallery] == []
    assert [
        p.parent.name for p in ROOT.glob("examples/*/README.md") if f'<a id="{p.parent.name}"></a>' not in examples
    ] == []


def test_the_page_about_the_report_tells_the_chart_of_every_check() -> None:
    """Or why it has none."""
    page = (ROOT / "docs/reference/report.md").read_text(encoding="utf-8")
    assert [name for name in CHECKS if f"`{name}`" not in page] == []


def test_every_part_that_is_generated_stands_on_a_page() -> None:
    """Two comments in the Markdown say where."""
    text = "".join((ROOT / d).read_text(encoding="utf-8") for d in DOCUMENTS)
    ends = [(f"<!-- generated: {name} -->\n", f"\n<!-- end of generated: {name} -->\n") for name in generated.NAMES]
    assert [pair for pair in ends if [text.count(end) for end in pair] != [1, 1]] == []
