"""What a build with colcon refuses or leaves out is found in the files of a package, and a right one has no flaw."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest
from places import ROOT, TESTS

from grader.grading.judging.installs import told_flaw
from grader.grading.submissions.contents import read_contents
from grader.grading.submissions.installing import examined_packages
from grader.runtime.model.projects import ExaminedPackage, FlawKind

MANIFEST = """<?xml version="1.0"?>
<package format="3">
  <name>my_robot</name>
  <version>0.0.0</version>
  <description>A robot</description>
  <maintainer email="ada@example.org">Ada</maintainer>
  <license>MIT</license>
  <depend>rclpy</depend>
  <exec_depend>std_msgs</exec_depend>
  <export><build_type>ament_python</build_type></export>
</package>
"""
SETUP = """import os
from glob import glob
from setuptools import find_packages, setup

package_name = 'my_robot'

setup(
    name=package_name,
    version='0.0.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + package_name]),
        ('share/' + package_name, ['package.xml']),
        (os.path.join('share', package_name, 'launch'), glob('launch/*.launch.py')),
        (os.path.join('share', package_name, 'config'), glob('config/*.yaml')),
    ],
    install_requires=['setuptools'],
    entry_points={'console_scripts': ['talker = my_robot.talker:main']},
)
"""
CONFIGURATION = "[develop]\nscript_dir=$base/lib/my_robot\n[install]\ninstall_scripts=$base/lib/my_robot\n"
LAUNCH = """import os
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription

def generate_launch_description():
    share = get_package_share_directory('my_robot')
    parameters = os.path.join(share, 'config', 'talker.yaml')
    return LaunchDescription([])
"""
RIGHT = {
    "package.xml": MANIFEST,
    "setup.py": SETUP,
    "setup.cfg": CONFIGURATION,
    "resource/my_robot": "",
    "my_robot/__init__.py": "",
    "my_robot/talker.py": "import rclpy\nfrom std_msgs.msg import String\n\n\ndef main():\n    pass\n",
    "launch/talker.launch.py": LAUNCH,
    "config/talker.yaml": "/**: {ros__parameters: {a: 1}}\n",
    "test/test_talker.py": "import geometry_msgs\n",
}
CMAKE = """cmake_minimum_required(VERSION 3.8)
project(my_robot)
find_package(ament_cmake REQUIRED)
install(PROGRAMS scripts/talker.py DESTINATION lib/${PROJECT_NAME})
install(DIRECTORY launch DESTINATION share/${PROJECT_NAME})
ament_package()
"""
OF_CMAKE = {
    "package.xml": MANIFEST.replace("ament_python", "ament_cmake"),
    "CMakeLists.txt": CMAKE,
    "scripts/talker.py": "#!/usr/bin/env python3\nimport rclpy\n",
    "launch/talker.launch.py": LAUNCH,
}


def examined(root: Path, files: Mapping[str, str | None], base: Mapping[str, str] = RIGHT) -> list[ExaminedPackage]:
    """Write a package, with changes, and examine it as a submission does."""
    for name, content in {**base, **files}.items():
        if content is not None:
            path = root / "my_robot" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content)
    return examine(root)


def examine(root: Path) -> list[ExaminedPackage]:
    contents = read_contents(root, ())
    names = [path.relative_to(root).as_posix() for path in root.rglob("*") if path.is_file()]
    return list(examined_packages(contents.projects, names, contents.programs))


WRONG: dict[str, tuple[FlawKind, Mapping[str, str | None], str]] = {
    "an open tag": (
        FlawKind.MANIFEST,
        {"package.xml": MANIFEST.replace("<depend>rclpy</depend>", "<depend>rclpy<depend>")},
        "my_robot/package.xml:11: is not valid XML, so colcon does not build it as a ROS package",
    ),
    "entities": (
        FlawKind.MANIFEST,
        {"package.xml": MANIFEST.replace("<package", '<!DOCTYPE x [<!ENTITY a "b">]>\n<package', 1)},
        "my_robot/package.xml: declares entities, so colcon does not build it as a ROS package",
    ),
    "no licence": (
        FlawKind.MANIFEST,
        {"package.xml": MANIFEST.replace("<license>MIT</license>", "")},
        "my_robot/package.xml: does not have exactly one <license>, so colcon does not build it as a ROS package",
    ),
    "a tag of format 1": (
        FlawKind.MANIFEST,
        {"package.xml": MANIFEST.replace("exec_depend", "run_depend")},
        "my_robot/package.xml: has the tag <run_depend>, which its format does not know, so colcon does not build it "
        "as a ROS package",
    ),
    "declared twice": (
        FlawKind.MANIFEST,
        {"package.xml": MANIFEST.replace("<exec_depend>std_msgs", "<exec_depend>rclpy")},
        "my_robot/package.xml: depends on rclpy by <depend> and again by another tag, so colcon does not build it as a "
        "ROS package",
    ),
    "an address without a domain": (
        FlawKind.MANIFEST,
        {"package.xml": MANIFEST.replace("ada@example.org", "ada@laptop")},
        "my_robot/package.xml: has the e-mail address ada@laptop, so colcon does not build it as a ROS package",
    ),
    "a maintainer without an address": (
        FlawKind.MANIFEST,
        {"package.xml": MANIFEST.replace(' email="ada@example.org"', "")},
        "my_robot/package.xml: has a maintainer without an e-mail address, so colcon does not build it as a ROS "
        "package",
    ),
    "no build type": (
        FlawKind.BUILD_TYPE,
        {"package.xml": MANIFEST.replace("<build_type>ament_python</build_type>", "")},
        "my_robot/package.xml: it does not name a build type, which stands for ROS 1 with CMake, so the build fails",
    ),
    "no setup.py": (
        FlawKind.NO_SETUP,
        {"setup.py": None},
        "my_robot/package.xml: the build type ament_python needs setup.py, which is not there, so the build fails",
    ),
    "a package without a folder": (
        FlawKind.NO_FOLDER,
        {"setup.py": SETUP.replace("packages=find_packages(exclude=['test'])", "packages=['my_robot', 'nodes']")},
        "my_robot/setup.py:10: it installs the Python package nodes, and there is no folder nodes, so the build fails",
    ),
    "no marker file": (
        FlawKind.NO_FILE,
        {"resource/my_robot": None},
        "my_robot/setup.py:12: it installs resource/my_robot, which is not there, so the build fails",
    ),
    "another marker": (
        FlawKind.MARKER,
        {
            "resource/my_robot": None,
            "resource/robot": "",
            "setup.py": SETUP.replace("'resource/' + package_name", "'resource/robot'"),
        },
        "my_robot/setup.py:11: it does not install resource/my_robot, by which ROS finds the package; its marker is "
        "called robot, not my_robot; colcon adds what is missing for now, with a warning that this will end",
    ),
    "no setup.cfg": (
        FlawKind.SCRIPT_FOLDER,
        {"setup.cfg": None},
        "my_robot/setup.cfg: programs are installed to bin/, so `ros2 run my_robot` does not find them in lib/my_robot",
    ),
    "a copied setup.cfg": (
        FlawKind.SCRIPT_FOLDER,
        {"setup.cfg": CONFIGURATION.replace("my_robot", "my_package")},
        "my_robot/setup.cfg: programs are installed to $base/lib/my_package, so `ros2 run my_robot` does not find them "
        "in lib/my_robot",
    ),
    "a misspelt module": (
        FlawKind.NO_MODULE,
        {"setup.py": SETUP.replace("my_robot.talker:", "my_robot.talkr:")},
        "my_robot/setup.py:18: the entry point talker names the module my_robot.talkr, and there is no "
        "my_robot/talkr.py, so `ros2 run` fails",
    ),
    "a module without its package": (
        FlawKind.NO_MODULE,
        {"setup.py": SETUP.replace("my_robot.talker:", "talker:")},
        "my_robot/setup.py:18: the entry point talker names the module talker, and there is no talker.py, so "
        "`ros2 run` fails",
    ),
    "a point in place of a colon": (
        FlawKind.NO_SCRIPT,
        {"setup.py": SETUP.replace(".talker:main", ".talker.main")},
        "my_robot/setup.py:18: the entry point `talker = my_robot.talker.main` is not written as "
        "`name = module:function`, so `ros2 run` fails",
    ),
    "no comma between two": (
        FlawKind.NO_SCRIPT,
        {"setup.py": SETUP.replace("talker:main'", "talker:main' 'two = my_robot.talker:main'")},
        "my_robot/setup.py:18: the entry point `talker = my_robot.talker:maintwo = my_robot.talker:main` is not "
        "written as `name = module:function`, so `ros2 run` fails",
    ),
    "a missing function": (
        FlawKind.NO_FUNCTION,
        {"setup.py": SETUP.replace(".talker:main", ".talker:run")},
        "my_robot/setup.py:18: the entry point talker names run, which my_robot/talker.py does not define, so "
        "`ros2 run` fails",
    ),
    "a folder without __init__.py": (
        FlawKind.LEFT_OUT,
        {
            "my_robot/nodes/talker.py": "def main(): pass\n",
            "setup.py": SETUP.replace("my_robot.talker:", "my_robot.nodes.talker:"),
        },
        "my_robot/setup.py:18: the entry point talker is in my_robot.nodes, which `packages` does not install, so "
        "`ros2 run` fails",
    ),
    "a launch file that no pattern takes": (
        FlawKind.NOT_SHARED,
        {"launch/other_launch.py": LAUNCH},
        "my_robot/setup.py:11: it does not install launch/other_launch.py to share/my_robot/launch, so "
        "`ros2 launch` does not find it",
    ),
    "a file that a launch file looks up": (
        FlawKind.NOT_SHARED,
        {
            "config/talker.yaml": None,
            "config/talker.yml": "",
            "launch/talker.launch.py": LAUNCH.replace(".yaml", ".yml"),
        },
        "my_robot/setup.py:11: it does not install config/talker.yml to share/my_robot/config, where "
        "my_robot/launch/talker.launch.py:7 looks for it",
    ),
    "an import": (
        FlawKind.UNDECLARED,
        {"my_robot/talker.py": "from sensor_msgs.msg import LaserScan\n\n\ndef main(): pass\n"},
        "my_robot/package.xml: it does not declare sensor_msgs, which my_robot/my_robot/talker.py:1 imports",
    ),
}
OF_CMAKE_WRONG: dict[str, tuple[FlawKind, Mapping[str, str | None], str]] = {
    "another name": (
        FlawKind.PROJECT_NAME,
        {"CMakeLists.txt": CMAKE.replace("project(my_robot)", "project(robot)")},
        "my_robot/CMakeLists.txt: project(robot) is not the name in package.xml, my_robot, so the build fails",
    ),
    "a missing program": (
        FlawKind.NO_FILE,
        {"CMakeLists.txt": CMAKE.replace("scripts/talker.py", "scripts/talker.py scripts/listener.py")},
        "my_robot/CMakeLists.txt: it installs scripts/listener.py, which is not there, so the build fails",
    ),
    "no launch folder": (
        FlawKind.NOT_SHARED,
        {"CMakeLists.txt": CMAKE.replace("install(DIRECTORY launch DESTINATION share/${PROJECT_NAME})\n", "")},
        "my_robot/CMakeLists.txt: it does not install launch/talker.launch.py to share/my_robot/launch, so "
        "`ros2 launch` does not find it",
    ),
}


@pytest.mark.parametrize(("kind", "files", "told"), WRONG.values(), ids=WRONG)
def test_a_flaw_is_found_and_told_with_its_place(
    tmp_path: Path, kind: FlawKind, files: Mapping[str, str | None], told: str
) -> None:
    """Each was tried with colcon: it refuses the package, warns, or leaves out what the sentence says."""
    (package,) = examined(tmp_path, files)
    assert [(flaw.kind, told_flaw(flaw)[0]) for flaw in package.flaws] == [(kind, told)]
    assert all(told_flaw(flaw)[1] for flaw in package.flaws)


@pytest.mark.parametrize(("kind", "files", "told"), OF_CMAKE_WRONG.values(), ids=OF_CMAKE_WRONG)
def test_a_flaw_of_a_package_built_by_cmake_is_found(
    tmp_path: Path, kind: FlawKind, files: Mapping[str, str | None], told: str
) -> None:
    """As far as its CMakeLists.txt is read."""
    (package,) = examined(tmp_path, files, OF_CMAKE)
    flaws = [flaw for flaw in package.flaws if flaw.kind is not FlawKind.NO_FILE or kind is FlawKind.NO_FILE]
    assert [(flaw.kind, told_flaw(flaw)[0]) for flaw in flaws] == [(kind, told)]


UNKNOWN: dict[str, Mapping[str, str | None]] = {
    "as it is": {},
    "a loop over files": {
        "launch/other_launch.py": LAUNCH,
        "setup.py": SETUP.replace(
            "setup(\n",
            "files = [('share/a', [])]\nfor here, _, names in os.walk('launch'):\n    files.append(here)\nsetup(\n",
        ).replace("data_files=[", "data_files=files + ["),
    },
    "an unknown pattern": {
        "launch/other_launch.py": LAUNCH,
        "setup.py": SETUP.replace("glob('launch/*.launch.py')", "glob('launch/**', recursive=True)"),
    },
    "another command": {
        "setup.cfg": None,
        "setup.py": SETUP.replace("name=package_name", "name=package_name, cmdclass={'install': Mine}"),
    },
    "a star import": {"my_robot/talker.py": "from .other import *\n", "my_robot/other.py": "def main(): pass\n"},
    "an alias": {"my_robot/talker.py": "import rclpy\nif True:\n    main = rclpy.init\n"},
    "an import that may fail": {
        "my_robot/talker.py": "try:\n    import nav_msgs\nexcept ImportError:\n    pass\n\n\ndef main(): pass\n"
    },
    "what a declared one brings": {
        "package.xml": MANIFEST.replace("std_msgs", "sensor_msgs"),
        "my_robot/talker.py": "import std_msgs, geometry_msgs, builtin_interfaces\n\n\ndef main(): pass\n",
    },
    "an unknown package that may bring it": {
        "package.xml": MANIFEST.replace("std_msgs", "nav2_bringup"),
        "my_robot/talker.py": "import nav_msgs\n\n\ndef main(): pass\n",
    },
    "another folder": {
        "my_robot/__init__.py": None,
        "my_robot/talker.py": None,
        "src/my_robot/__init__.py": "",
        "src/my_robot/talker.py": "def main(): pass\n",
        "setup.py": SETUP.replace(
            "packages=find_packages(exclude=['test'])", "package_dir={'': 'src'}, packages=find_packages(where='src')"
        ),
    },
    "dashes": {"setup.cfg": CONFIGURATION.replace("_dir", "-dir").replace("_scripts", "-scripts")},
}


@pytest.mark.parametrize("files", UNKNOWN.values(), ids=UNKNOWN)
def test_what_may_be_right_is_no_flaw(tmp_path: Path, files: Mapping[str, str | None]) -> None:
    """A false alarm is worse than a flaw that is missed."""
    (package,) = examined(tmp_path, files)
    assert package.flaws == ()


@pytest.mark.parametrize(
    "folder",
    ["packages/workspace", "world/workspace", "real_checks/right"],
)
def test_packages_of_the_project_have_no_flaw(folder: str) -> None:
    """They are built as they are."""
    assert [flaw for package in examine(TESTS / folder) for flaw in package.flaws] == []


@pytest.mark.parametrize("folder", ["examples", "student_template"])
def test_what_the_project_hands_out_has_no_flaw(folder: str) -> None:
    """Neither the definitions of an example's interfaces nor folders without packages."""
    assert [flaw for package in examine(ROOT / folder) for flaw in package.flaws] == []


def test_a_path_that_grows_without_end_is_given_up(tmp_path: Path) -> None:
    """Each expression is looked at once, however often names in it lead to others."""
    lines = ["from ament_index_python.packages import get_package_share_directory as share", "import os"]
    lines.append("a0 = share('my_robot')")
    lines += [f"a{n} = os.path.join({', '.join([f'a{n - 1}'] * 50)})" for n in range(1, 30)]
    (package,) = examined(tmp_path, {"launch/talker.launch.py": "\n".join([*lines, "b = b + b", ""])})
    assert package.flaws == ()
