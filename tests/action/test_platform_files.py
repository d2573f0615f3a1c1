"""The files that platforms read: they follow the public schemas, and linters find nothing in them."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from ruamel.yaml import YAML
from stand_in_runner import ROOT

from grader.core.errors import GraderError
from grader.packaging import workflow

BIN = Path(sys.executable).parent
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


@pytest.mark.parametrize(("schema", "path"), [("github-actions", ACTION), ("github-workflows", TEMPLATE)])
def test_files_follow_the_public_schemas(schema: str, path: Path) -> None:
    """Those that editors use, as check-jsonschema carries them."""
    assert complaints("check-jsonschema", "--builtin-schema", f"vendor.{schema}", str(path)) == ""


def test_the_schema_can_fail(tmp_path: Path) -> None:
    """An action without steps is none."""
    path = tmp_path / "action.yml"
    path.write_text("name: a\ndescription: b\nruns:\n  using: composite\n")
    assert "action.yml" in complaints("check-jsonschema", "--builtin-schema", "vendor.github-actions", str(path))


def test_no_linter_complains(filled: Path) -> None:
    """The strictest persona of zizmor: versions pinned to commits, no permission too many, no input in a script."""
    assert complaints("zizmor", "--offline", "--no-config", "--persona", "pedantic", str(ACTION), str(filled)) == ""


def test_the_linter_can_complain(tmp_path: Path, filled: Path) -> None:
    """An action by its branch, and an input in the middle of a script."""
    loose = tmp_path / "action.yml"
    text = ACTION.read_text(encoding="utf-8").replace('cd "$RUNNER_TEMP"', "cd ${{ inputs.path }}")
    loose.write_text(text)
    assert "template-injection" in complaints("zizmor", "--offline", "--no-config", str(loose))
    filled.write_text(filled.read_text().replace(AT, "school/rclpy-grader@main"))
    assert "unpinned-uses" in complaints("zizmor", "--offline", "--no-config", str(filled))


@pytest.mark.parametrize("name", ["prepare", "gradescope/setup.sh"])
def test_scripts_pass_shellcheck(name: str) -> None:
    """Nothing unquoted, nothing that goes on after a failure."""
    assert complaints("shellcheck", str(ROOT / "integrations" / name)) == ""


def test_the_steps_of_the_action_pass_shellcheck(tmp_path: Path) -> None:
    """They are scripts too, which a runner starts with `-e`."""
    steps = YAML(typ="safe").load(ACTION.read_text(encoding="utf-8"))["runs"]["steps"]
    for number, step in enumerate(step for step in steps if "run" in step):
        (tmp_path / f"{number}.sh").write_text(f"set -e\n{step['run']}")
    assert complaints("shellcheck", "--shell=bash", *map(str, sorted(tmp_path.glob("*.sh")))) == ""


@pytest.mark.parametrize("part", ["inputs", "outputs"])
def test_the_documentation_names_every_input_and_output(part: str) -> None:
    """And none that the action has not."""
    text = (ROOT / "docs" / "how-to" / "github-actions.md").read_text(encoding="utf-8")
    table = text.partition(f"\n| {part[:-1]} |")[2].partition("\n\n")[0]
    told = [name for row in table.splitlines()[2:] for name in re.findall(r"`([a-z-]+)`", row.split("|")[1])]
    assert told == list(YAML(typ="safe").load(ACTION.read_text(encoding="utf-8"))[part])


def test_students_start_from_the_workflow_that_is_exported() -> None:
    """Two copies, one text."""
    assert TEMPLATE.read_bytes() == (ROOT / "integrations" / "github" / "workflow.yml").read_bytes()


def test_the_workflow_names_one_commit_and_nothing_to_fill_in(filled: Path) -> None:
    """A branch or a tag may point elsewhere tomorrow."""
    assert f"uses: {AT}\n" in filled.read_text(encoding="utf-8")
    assert "__" not in filled.read_text(encoding="utf-8")


@pytest.mark.parametrize("action", ["a/b", "a/b@main", "a@" + "0" * 40, "a/b/c@" + "0" * 40, "a/ b@" + "0" * 40, ""])
def test_another_form_of_action_is_refused(action: str) -> None:
    """With the one that is expected."""
    with pytest.raises(GraderError, match="expected OWNER/NAME@COMMIT"):
        workflow(action)
