"""What packages share is where their nodes look it up: as setup.py installs it, and nothing else."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from decided import grade_until_decided
from places import TESTS
from ruamel.yaml import YAML
from tiers import more

from grader.grading.app.request import GradeRequest
from grader.grading.submissions.projects import read_projects
from grader.runtime.programs.shares import install_shares
from grader.runtime.ros_installation import RosInstallation

HERE = TESTS / "packages"
WORKSPACE = HERE / "workspace"
SETUP = "from glob import glob\nimport os\nfrom setuptools import setup\nsetup(name='own', data_files={})\n"


def installed(root: Path, ros: RosInstallation, prefix: Path) -> list[str]:
    """Return the files below the prefix, without the index."""
    prefix.mkdir()
    paths, notes = install_shares(root, read_projects(root)[0], prefix, ros)
    assert notes == ()
    assert paths[:1] in ((), (str(prefix),))
    return sorted(
        str(path.relative_to(prefix / "share"))
        for path in prefix.rglob("*")
        if path.is_file() and "ament_index" not in path.parts
    )


def test_the_data_files_of_setup_py_are_installed(tmp_path: Path, ros: RosInstallation) -> None:
    """With patterns and joined paths, as `ros2 pkg create` and the tutorials write them."""
    expected = [
        "robot/config/talker.yaml",
        "robot/launch/listener.launch.py",
        "robot/launch/robot.launch.py",
        "robot/package.xml",
    ]
    assert installed(WORKSPACE, ros, tmp_path / "prefix") == expected
    assert (tmp_path / "prefix/share/ament_index/resource_index/packages/robot").is_file()


@pytest.mark.parametrize(
    ("data_files", "expected"),
    [
        ("[('share/own', ['config/a.yaml'])]", ["own/a.yaml"]),
        ("[('share/own/maps', glob(os.path.join('config', '*.y*ml')))]", ["own/maps/a.yaml", "own/maps/b.yml"]),
        ("[('share/own', [])]", []),
        ("[('share/own', ['config/missing.yaml'])]", []),
        # not known without running it: everything
        ("made()", ["own/config/a.yaml", "own/config/b.yml", "own/setup.py"]),
        ("[('share/own', glob('**/*', recursive=True))]", ["own/config/a.yaml", "own/config/b.yml", "own/setup.py"]),
        ("[('share/own', glob('../../../*'))]", ["own/config/a.yaml", "own/config/b.yml", "own/setup.py"]),
        # places and files outside of the package
        ("[('../../out', ['config/a.yaml']), ('/tmp/out', ['config/a.yaml'])]", []),
        ("[('share/own', ['../../outside.yaml', '/etc/passwd'])]", []),
    ],
)
def test_files_land_where_setup_py_says(
    tmp_path: Path, ros: RosInstallation, data_files: str, expected: list[str]
) -> None:
    """One folder, one file at a time; what is missing stays missing, as in reality."""
    (tmp_path / "outside.yaml").write_text("no")
    package = tmp_path / "ws" / "own"
    (package / "config").mkdir(parents=True)
    (package / "config" / "a.yaml").write_text("a")
    (package / "config" / "b.yml").write_text("b")
    (package / "setup.py").write_text(SETUP.replace("{}", data_files))
    assert installed(tmp_path / "ws", ros, tmp_path / "prefix") == expected
    assert not (tmp_path / "out").exists()


def test_a_cmake_package_shares_its_files_and_a_loose_file_nothing(tmp_path: Path, ros: RosInstallation) -> None:
    """Packages do not share each other's files, and a name that is none for ROS is left out."""
    for name, package in (("outer", "outer"), ("outer/inner", "inner"), ("odd", "../odd")):
        folder = tmp_path / "ws" / name
        folder.mkdir(parents=True)
        (folder / "package.xml").write_text(f"<package><name>{package}</name></package>")
        (folder / f"{folder.name}.yaml").write_text("x")
    found = installed(tmp_path / "ws", ros, tmp_path / "prefix")
    assert [name for name in found if not name.startswith("odd")] == [
        "inner/inner.yaml",
        "inner/package.xml",
        "outer/outer.yaml",
        "outer/package.xml",
    ]
    loose = tmp_path / "loose"
    loose.mkdir()
    (loose / "node.py").write_text("pass")
    assert installed(loose, ros, tmp_path / "none") == []
    assert install_shares(loose, read_projects(loose)[0], tmp_path / "none", ros) == ((), ())


@pytest.mark.breadth(1, 1)
@pytest.mark.ros
@pytest.mark.parametrize("clock", ["virtual", *more(["wall"]), "bare"])
def test_a_node_finds_what_its_package_shares(tmp_path: Path, clock: str) -> None:
    """And what ROS shares; also without the grader in its process, where a spot check disagrees with nothing."""
    folder = tmp_path / "ws"
    shutil.copytree(WORKSPACE, folder, ignore=shutil.ignore_patterns("__pycache__"))
    nodes = folder / "src/robot/robot/nodes.py"
    text = nodes.read_text().replace(
        "import rclpy\n",
        "from ament_index_python.packages import get_package_share_directory\n\nimport rclpy\n",
    )
    read = """        path = get_package_share_directory("robot") + "/config/talker.yaml"
        known = get_package_share_directory("std_msgs").endswith("share/std_msgs")
        self.get_logger().info(f"{len(open(path).read()) > 20} {known} {path}")
"""
    first = '        self.declare_parameter("rate", 1.0)\n'
    nodes.write_text(text.replace(first, read + first))
    said = "^True True share/robot/config/talker.yaml$"
    rubric = {
        "schema": "grader/rubric/v1",
        "exercise": {"id": "shares", "number": "P1", "title": "Shared files"},
        "files": ["robot/talker"],
        "scenarios": [{"id": "alone", "processes": ["robot/talker"], "observe": {"duration": "2 s"}}],
        "criteria": [
            {
                "id": "found",
                "title": "Finds its files",
                "points": 1,
                "scenario": "alone",
                "check": {"logs_matching": {"process": "robot/talker", "pattern": said}},
            }
        ],
    }
    path = tmp_path / "rubric.yaml"
    YAML().dump(rubric, path)
    spot = {"clock": "auto", "spot_checks": 1.0} if clock == "bare" else {"clock": clock}
    report = grade_until_decided(GradeRequest(str(folder), rubrics=(path,), **spot))
    (verdict,) = report.exercises[0].verdicts
    assert verdict.outcome.value == "met", verdict.reason
