"""The files that platforms read, the project's own among them: they follow schemas, and linters find nothing."""

import importlib.util
import re
import subprocess
import sys
from importlib.machinery import SourceFileLoader
from pathlib import Path

import pytest
from places import ROOT
from tables import read_table

import grader
from grader.course.packaging import workflow
from grader.runtime.model.errors import GraderError

BIN = Path(sys.executable).parent
OWN = ROOT / ".github"
WORKFLOWS = sorted((OWN / "workflows").glob("*.yml"))
ACTION, TEMPLATE = ROOT / "action.yml", ROOT / "student_template" / ".github" / "workflows" / "grade.yml"
AT = "school/rclpy-grader@" + "0123456789" * 4


@pytest.fixture
def filled(tmp_path: Path) -> Path:
    """Return the workflow as a course has it."""
    path = tmp_path / ".github" / "workflows" / "grade.yml"
    path.parent.mkdir(parents=True)
    path.write_text(workflow(AT), encoding="utf-8")
    return path


def complaints(program: str, *words: str) -> str:
    """Return what a linter says about files, empty if it finds nothing."""
    done = subprocess.run([BIN / program, *words], capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else f"{program} ended with {done.returncode}:\n{done.stdout}{done.stderr}"


@pytest.mark.breadth(2, 7)
@pytest.mark.parametrize(
    ("schema", "paths"),
    [
        ("github-actions", [ACTION]),
        ("github-workflows", [TEMPLATE, *WORKFLOWS]),
        ("dependabot", [OWN / "dependabot.yml"]),
        ("github-issue-forms", sorted(set(OWN.glob("ISSUE_TEMPLATE/*.yml")) - {OWN / "ISSUE_TEMPLATE" / "config.yml"})),
        ("github-issue-config", [OWN / "ISSUE_TEMPLATE" / "config.yml"]),
        ("gitlab-ci", [ROOT / "integrations" / "gitlab" / "grade.yml"]),
        ("citation-file-format", [ROOT / "CITATION.cff"]),
    ],
)
def test_files_follow_the_public_schemas(schema: str, paths: list[Path]) -> None:
    """Those that editors use, as check-jsonschema carries them."""
    assert paths
    read_as = ["--data-transform", "gitlab-ci"] if schema == "gitlab-ci" else ["--default-filetype", "yaml"]
    assert complaints("check-jsonschema", *read_as, "--builtin-schema", f"vendor.{schema}", *map(str, paths)) == ""


def test_the_schema_can_fail(tmp_path: Path) -> None:
    """An action without steps is none."""
    path = tmp_path / "action.yml"
    path.write_text("name: a\ndescription: b\nruns:\n  using: composite\n")
    assert "action.yml" in complaints("check-jsonschema", "--builtin-schema", "vendor.github-actions", str(path))


def test_no_linter_complains(filled: Path) -> None:
    """The strictest persona of zizmor: versions pinned to commits, no permission too many, no input in a script."""
    options = ["--offline", "--no-config", "--persona", "pedantic"]
    assert complaints("zizmor", *options, str(ACTION), str(filled), str(OWN)) == ""
    shellcheck = ["-shellcheck", str(BIN / "shellcheck")]
    assert complaints("actionlint", *shellcheck, str(filled), *map(str, WORKFLOWS)) == ""


def test_the_linter_can_complain(tmp_path: Path, filled: Path) -> None:
    """An action by its branch, and an input in the middle of a script."""
    loose = tmp_path / "action.yml"
    text = ACTION.read_text(encoding="utf-8").replace('cd "$RUNNER_TEMP"', "cd ${{ inputs.path }}")
    loose.write_text(text)
    assert "template-injection" in complaints("zizmor", "--offline", "--no-config", str(loose))
    filled.write_text(filled.read_text().replace(AT, "school/rclpy-grader@main"))
    assert "unpinned-uses" in complaints("zizmor", "--offline", "--no-config", str(filled))
    filled.write_text(filled.read_text().replace("github.ref", "github.reff"))
    assert '"reff" is not defined' in complaints("actionlint", str(filled))


@pytest.mark.parametrize("name", ["prepare", "gradescope/setup.sh"])
def test_scripts_pass_shellcheck(name: str) -> None:
    """Nothing unquoted, nothing that goes on after a failure."""
    assert complaints("shellcheck", str(ROOT / "integrations" / name)) == ""


def test_the_steps_of_the_action_pass_shellcheck(tmp_path: Path) -> None:
    """They are scripts too, which a runner starts with `-e`."""
    steps = read_table(ACTION)["runs"]["steps"]
    for number, step in enumerate(step for step in steps if "run" in step):
        (tmp_path / f"{number}.sh").write_text(f"set -e\n{step['run']}")
    assert complaints("shellcheck", "--shell=bash", *map(str, sorted(tmp_path.glob("*.sh")))) == ""


@pytest.mark.parametrize("part", ["inputs", "outputs"])
def test_the_documentation_names_every_input_and_output(part: str) -> None:
    """And none that the action has not."""
    text = (ROOT / "docs" / "how-to" / "github-actions.md").read_text(encoding="utf-8")
    table = text.partition(f"\n| {part[:-1]} |")[2].partition("\n\n")[0]
    told = [name for row in table.splitlines()[2:] for name in re.findall(r"`([a-z-]+)`", row.split("|")[1])]
    assert told == list(read_table(ACTION)[part])


def test_students_start_from_the_workflow_that_is_exported() -> None:
    """Two copies, one text."""
    assert TEMPLATE.read_bytes() == (ROOT / "integrations" / "github" / "workflow.yml").read_bytes()


def test_the_workflow_names_one_commit_and_nothing_to_fill_in(filled: Path) -> None:
    """A branch or a tag may point elsewhere tomorrow."""
    assert f"uses: {AT}\n" in filled.read_text(encoding="utf-8")
    assert "__" not in filled.read_text(encoding="utf-8")
    assert "fills this in" not in filled.read_text(encoding="utf-8")
    assert f"# Made by: grade export workflow {AT}\n" in filled.read_text(encoding="utf-8")


@pytest.mark.parametrize("action", ["a/b", "a/b@main", "a@" + "0" * 40, "a/b/c@" + "0" * 40, "a/ b@" + "0" * 40, ""])
def test_another_form_of_action_is_refused(action: str) -> None:
    """With the one that is expected."""
    with pytest.raises(GraderError, match="expected OWNER/NAME@COMMIT"):
        workflow(action)


@pytest.fixture
def release(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a repository that can be released as 1.2.0; it is the current folder."""
    (tmp_path / "grader").mkdir()
    (tmp_path / "grader" / "__init__.py").write_text('"""Doc."""\n\n__version__ = "1.2.0"\n')
    (tmp_path / "pyproject.toml").write_text('repository = "https://github.com/school/rclpy-grader"\n')
    (tmp_path / "CITATION.cff").write_text("title: T\nversion: 1.2.0\n")
    (tmp_path / "CHANGELOG.md").write_text(
        "# Changelog\n\n## [Unreleased]\n\n## [1.2.0] - 2026-12-01\n\n### Added\n\n- A.\n\n"
        "## [1.1.0] - 2026-01-01\n\n- B.\n"
    )
    monkeypatch.chdir(tmp_path)
    subprocess.run(["git", "init", "-q", "."], check=True)
    return tmp_path


def released(tag: str) -> tuple[str, str]:
    """Return what `.ci/release` prints for a tag, and the error."""
    command = [sys.executable, str(ROOT / ".ci" / "release"), tag]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == bool(done.stderr)
    return done.stdout, done.stderr


def test_release_notes_are_the_section_of_the_version(release: Path) -> None:
    """Not those of other versions."""
    assert released("v1.2.0") == ("### Added\n\n- A.\n", "")


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("grader/__init__.py", "1.2.0", "1.3.0", "expected the tag v1.3.0"),
        ("CITATION.cff", "1.2.0", "1.1.0", "CITATION.cff: expected version: 1.2.0"),
        ("pyproject.toml", "school", "__OWNER__", "found the placeholder"),
        ("CHANGELOG.md", "[1.2.0] - 2026-12-01", "[1.2.0]", "expected entries below"),
        ("CHANGELOG.md", "### Added\n\n- A.\n", "", "expected entries below"),
    ],
)
def test_what_is_not_ready_is_not_released(release: Path, name: str, old: str, new: str, said: str) -> None:
    """With the file and what it lacks."""
    (release / name).write_text((release / name).read_text().replace(old, new))
    assert said in released("v1.2.0")[1]


def test_entries_that_are_not_in_the_changelog_are_not_forgotten(release: Path) -> None:
    """A release names the first of them, and the command that moves them."""
    (release / "changes").mkdir()
    (release / "changes" / "README.md").write_text("One file for each change.\n")
    (release / "changes" / "other.fixed.md").write_text("Other.\n")
    assert "found other.fixed.md: run towncrier build --version 1.2.0" in released("v1.2.0")[1]


def test_each_entry_stands_in_the_next_release() -> None:
    """Once, below the heading of its kind; what is named otherwise would be missing."""
    entries = [
        path for path in sorted((ROOT / "changes").iterdir()) if path.name not in ("README.md", "template.md.jinja")
    ]
    command = [sys.executable, "-m", "towncrier", "build", "--draft", "--version", "9.9.9", "--date", "2026-12-01"]
    draft = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout
    kinds = {part.partition("\n")[0].lower(): part.splitlines() for part in draft.split("\n### ")[1:]}
    for path in entries:
        text = path.read_text(encoding="utf-8")
        kind = path.name.split(".")[1]
        assert text.endswith("\n"), path.name
        assert text.count("\n") == 1, f"{path.name}: expected one line"
        assert kinds[kind].count(f"- {text.strip()}") == 1, path.name


UNRELEASED_PAGE = """<!-- until the first release -->
There is no release yet.

<!-- end of it -->
    pip install './rclpy-grader[all]'
    pip install 'rclpy-grader[tests] @ git+https://github.com/OWNER/rclpy-grader' && pipx install ./rclpy-grader
    <!-- until the first release -->OWNER is you. <!-- end of it -->pipx install git+https://github.com/OWNER/rclpy-grader
    cd ./rclpy-grader/tests
"""
RELEASED_PAGE = """    pip install 'rclpy-grader[all]'
    pip install 'rclpy-grader[tests]' && pipx install rclpy-grader
    pipx install rclpy-grader
    cd ./rclpy-grader/tests
"""


def test_what_pages_say_before_the_first_release_is_switched_in_one_step(release: Path) -> None:
    """And nothing is released before that."""
    (release / "page.md").write_text(UNRELEASED_PAGE)
    (release / "picture.png").write_bytes(b"\xff\xd8")
    assert "found page.md from before the first release: run python3 .ci/release --switch" in released("v1.2.0")[1]
    assert released("--switch") == ("page.md\n", "")
    assert (release / "page.md").read_text() == RELEASED_PAGE
    assert released("--switch") == ("", "")
    assert released("v1.2.0") == ("### Added\n\n- A.\n", "")


def test_no_page_tells_to_install_what_is_not_released() -> None:
    """Either all commands are those of before the first release, or all are those of after it."""
    spec = importlib.util.spec_from_loader("release", SourceFileLoader("release", str(ROOT / ".ci" / "release")))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    before, after = set(), set()
    command = re.compile(r"(?:pip|pipx|uv(?: tool| pip)?) install (?:--\S+ )*['\"]?rclpy-grader\b(?![\w\[\],-]* @)\S*")
    kinds = (".md", ".py", ".ipynb", ".json", ".yml", ".yaml", ".toml", ".sh")
    for name in filter(None, listed.split("\0")):
        path = ROOT / name
        if path.suffix not in kinds or name.startswith("tests/"):
            continue
        text = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
        if module.switched(text) != text:
            before.add(name)
        after |= {(name, found) for found in command.findall(text)}
    assert not before or not after, (before, after)
    assert before or after


def test_the_citation_names_this_version() -> None:
    """It is cited between releases, too."""
    assert read_table(ROOT / "CITATION.cff")["version"] == grader.__version__
