"""A package whose tests use `ros`, run as `colcon test` runs them, with message packages that nobody has built."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from junitparser import JUnitXml
from places import ROOT

pytestmark = [pytest.mark.ros, pytest.mark.slow]

WORKSPACE = Path(__file__).with_name("workspace")


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """Return a copy of the workspace."""
    ignored = shutil.ignore_patterns("__pycache__", ".pytest_cache")
    return Path(shutil.copytree(WORKSPACE, tmp_path / "workspace", ignore=ignored))


def run_as_colcon(package: Path, environment: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    """Run the tests of a package with the command of colcon's task for Python packages."""
    command = [sys.executable, "-m", "pytest", "--tb=short", "--junit-xml=pytest.xml", "-o", "cache_dir=cache"]
    return subprocess.run(command, cwd=package, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.long
def test_the_tests_of_a_package_pass_without_a_build(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages that are only sources are imported by tests and nodes; so is tf2_ros, which no wheel holds."""
    prefix = workspace / "install" / "robot"
    (prefix / "share/ament_index/resource_index/packages").mkdir(parents=True)
    (prefix / "share/ament_index/resource_index/packages/robot").touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(prefix))  # as after `source install/setup.bash`
    done = run_as_colcon(workspace / "src/robot")
    assert done.returncode == 0, done.stdout + done.stderr
    suite = next(iter(JUnitXml.fromfile(str(workspace / "src/robot/pytest.xml"))))
    assert (suite.tests, suite.failures, suite.errors) == (3, 0, 0)


@pytest.mark.nightly
def test_tests_may_lie_at_the_top_of_a_workspace(workspace: Path) -> None:
    """A folder that is in no package sees the packages below it."""
    shutil.move(workspace / "src/robot/test/test_battery.py", workspace / "test_battery.py")
    done = run_as_colcon(workspace)
    assert " 3 passed" in done.stdout, done.stdout + done.stderr


@pytest.mark.long
def test_a_mistake_in_a_definition_is_told_with_its_place(workspace: Path) -> None:
    """The import fails with file and line of the message that cannot be built."""
    (workspace / "src/robot_interfaces/msg/Battery.msg").write_text("float32 share\nflaot32 volts\n")
    done = run_as_colcon(workspace / "src/robot")
    said = (
        "ImportError: robot_interfaces: robot_interfaces/msg/Battery.msg, line 2: 'flaot32' is not a type; did you mean"
    )
    assert said in done.stdout, done.stdout


PAGE = ROOT / "docs/how-to/package-ci.md"
_RUN = re.compile(r"^ +run: (.+)$", re.MULTILINE)


@pytest.mark.nightly
def test_the_workflow_of_the_page_tests_a_package(workspace: Path) -> None:
    """Its commands pass for a right package; for a wrong one they leave the files that the page names."""
    workflow = re.findall(r"^```yaml\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL)[0]
    package = workspace / "src/robot"
    (package / ".github/workflows").mkdir(parents=True)
    (package / ".github/workflows/test.yml").write_text(workflow)
    for tool in (("actionlint", "-shellcheck="), ("zizmor", "--offline", "--no-config", "--persona=auditor")):
        command = [str(Path(sys.executable).with_name(tool[0])), *tool[1:], ".github/workflows/test.yml"]
        looked = subprocess.run(command, cwd=package, capture_output=True, text=True, check=False)
        assert looked.returncode == 0, looked.stdout + looked.stderr
    install, test = _RUN.findall(workflow)
    assert re.search(
        r"pip install 'rclpy-grader\[tests\]( @ \S+)?'$", install
    )  # which the environment of these tests has
    (package / ".venv").symlink_to(Path(sys.prefix))
    (package / "test/test_wrong.py").write_text(
        "def test_wrong(ros):\n    ros.run('robot/battery')\n    assert ros.now\n"
    )
    done = subprocess.run(test, shell=True, cwd=package, capture_output=True, text=True, check=False)
    assert " 1 failed, 3 passed" in done.stdout, done.stdout + done.stderr
    kept = sorted(path.name for path in (package / "runs").rglob("*") if path.is_file())
    assert kept == ["failure.json", "recording.mcap", "run.html"]
    assert "recording.mcap" in (package / "junit.xml").read_text()
