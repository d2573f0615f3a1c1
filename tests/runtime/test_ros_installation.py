"""Which ROS is found, and what children get of it."""

import importlib.machinery
import importlib.util
import platform
import subprocess
import sys
import sysconfig
from collections.abc import Sequence
from pathlib import Path

import pytest

from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.ros_installation import INSTALLED_HERE, RosInstallation, find_ros, install_hint
from grader.runtime.sandbox.environment import runtime_environment

HERE = f"python{sys.version_info.major}.{sys.version_info.minor}"
MESSAGES = ("geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs")


def install(
    prefix: Path, *, suffix: str = importlib.machinery.EXTENSION_SUFFIXES[0], packages: Sequence[str] = MESSAGES
) -> Path:
    """Make a folder that looks like an installed ROS, and return its folder of Python packages."""
    folder = prefix / "lib" / HERE / "site-packages"
    for package in ("rclpy", *packages):
        (folder / package).mkdir(parents=True)
        (folder / package / "__init__.py").touch()
    (folder / "rclpy" / f"_rclpy_pybind11{suffix}").touch()
    (prefix / "lib" / "librmw_fastrtps_cpp.so").touch()
    (prefix / "share" / "rclpy").mkdir(parents=True)
    (prefix / "share" / "rclpy" / "package.xml").write_text("<package><version>7.1.3</version></package>")
    return folder


def sourced(prefix: Path, **changes: str) -> dict[str, str]:
    """Return the variables that sourcing an installation sets."""
    return {
        "AMENT_PREFIX_PATH": str(prefix),
        "ROS_DISTRO": "jazzy",
        "PYTHONPATH": str(prefix / "lib" / HERE / "site-packages"),
        "LD_LIBRARY_PATH": f"{prefix}/opt/vendor/lib:{prefix}/lib",
        "PATH": "/usr/bin",
        **changes,
    }


@pytest.fixture
def wheels() -> RosInstallation:
    try:
        return find_ros({})
    except EnvironmentFault as fault:
        pytest.skip(fault.message)


def test_an_interpreter_may_be_started_by_a_relative_path(wheels: RosInstallation) -> None:
    """As `../.venv/bin/python`: the paths of a sandbox are the same."""
    folder = Path(sys.executable).parent
    name = f"../{folder.name}/python"
    code = "from grader.runtime.ros_installation import find_ros; print(find_ros({}))"
    done = subprocess.run([name, "-c", code], capture_output=True, text=True, check=True, env={}, cwd=folder)
    assert done.stdout.strip() == str(wheels)


def test_a_sourced_installation_is_used_and_nothing_of_the_wheels(tmp_path: Path) -> None:
    """Children get its Python folders and its libraries, and no library beside this interpreter."""
    folder = install(tmp_path / "jazzy")
    ros = find_ros(sourced(tmp_path / "jazzy"))
    assert (ros.source, ros.distro, ros.rclpy_version, ros.prefix) == ("sourced", "jazzy", "7.1.3", tmp_path / "jazzy")
    assert ros.runtime.python_paths == (folder,)
    assert ros.runtime.library_paths == (tmp_path / "jazzy" / "opt/vendor/lib", tmp_path / "jazzy" / "lib")
    assert ros.runtime.executable == Path(sys.executable)
    environment = runtime_environment(ros.runtime)
    assert environment["PYTHONPATH"] == str(folder)
    assert environment["AMENT_PREFIX_PATH"] == str(tmp_path / "jazzy")
    # Wheels that happen to be installed would otherwise start Python anew with their own libraries.
    assert environment["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] == "1"
    assert not [path for path in ros.runtime.library_paths if path.name.endswith(".libs")]


def test_the_version_of_a_sourced_rclpy_is_that_of_its_distribution(tmp_path: Path) -> None:
    """The metadata beside the package is asked before the manifest."""
    folder = install(tmp_path / "jazzy")
    metadata = folder / "rclpy-7.1.9.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: rclpy\nVersion: 7.1.9\n")
    assert find_ros(sourced(tmp_path / "jazzy")).rclpy_version == "7.1.9"


def test_workspaces_beside_a_sourced_installation_stay_out_of_sight(tmp_path: Path) -> None:
    """An overlay may hold solutions; a source build's packages, one prefix each, are all needed."""
    built, overlay = tmp_path / "ros2_jazzy" / "install", tmp_path / "my_workspace" / "install" / "solutions"
    install(built / "rclpy", packages=())
    for name in MESSAGES:
        (built / name / "lib" / HERE / "site-packages" / name).mkdir(parents=True)
    (overlay / "lib" / HERE / "site-packages" / "solutions").mkdir(parents=True)
    prefixes = [overlay, built / "rclpy", *(built / name for name in MESSAGES)]
    variables = sourced(
        built / "rclpy",
        AMENT_PREFIX_PATH=":".join(map(str, prefixes)),
        PYTHONPATH=":".join(str(prefix / "lib" / HERE / "site-packages") for prefix in prefixes),
        LD_LIBRARY_PATH=":".join(f"{prefix}/lib" for prefix in prefixes),
    )
    runtime = find_ros(variables).runtime
    assert len(runtime.python_paths) == 1 + len(MESSAGES)
    everything = [*runtime.read_paths, *runtime.library_paths, *runtime.python_paths]
    assert not [path for path in everything if overlay in (path, *path.parents)]
    assert str(overlay) not in "".join(runtime.environment.values())
    own = find_ros(variables, workspaces=True).runtime  # for programs of whoever sourced it
    assert own.environment["AMENT_PREFIX_PATH"] == variables["AMENT_PREFIX_PATH"]
    assert own.python_paths[0] == overlay / "lib" / HERE / "site-packages"
    assert own.library_paths[0] == overlay / "lib"
    assert overlay in own.read_paths


def test_an_empty_entry_of_a_search_path_is_not_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Shell set-ups often leave a colon at the end."""
    install(tmp_path / "jazzy")
    monkeypatch.chdir(tmp_path)
    variables = {name: f":{value}:" for name, value in sourced(tmp_path / "jazzy").items() if name.endswith("PATH")}
    runtime = find_ros({**variables, "ROS_DISTRO": "jazzy"}).runtime
    assert len(runtime.python_paths) == 1
    assert tmp_path not in (*runtime.read_paths, *runtime.library_paths)


def test_a_sourced_installation_for_another_python_is_a_fault(tmp_path: Path) -> None:
    """Neither mixed with the wheels nor silently left aside."""
    install(tmp_path / "humble", suffix=".cpython-38-x86_64-linux-gnu.so")
    with pytest.raises(EnvironmentFault, match=rf"expected rclpy for {HERE}, .*found rclpy for python3\.8") as caught:
        find_ros(sourced(tmp_path / "humble", ROS_DISTRO="humble"))
    assert "unset AMENT_PREFIX_PATH" in caught.value.hint


@pytest.mark.parametrize("lack", ["lib/librmw_fastrtps_cpp.so", f"lib/{HERE}/site-packages/nav_msgs"])
def test_an_incomplete_installation_is_a_fault_with_the_command_that_mends_it(tmp_path: Path, lack: str) -> None:
    """Fast DDS and the messages of the exercises are asked for before anything is run."""
    install(tmp_path / "jazzy")
    (tmp_path / "jazzy" / lack).rename(tmp_path / "elsewhere")
    with pytest.raises(
        EnvironmentFault, match=r"expected the (Fast DDS middleware|message package nav_msgs)"
    ) as caught:
        find_ros(sourced(tmp_path / "jazzy"))
    assert caught.value.hint.startswith("sudo apt install ros-jazzy-")


def test_variables_without_an_rclpy_under_them_are_not_a_sourced_ros(tmp_path: Path, wheels: RosInstallation) -> None:
    """An overlay alone, or leftovers of an installation that is gone, leave the wheels."""
    (tmp_path / "lib").mkdir()
    assert find_ros(sourced(tmp_path)) == wheels
    assert find_ros(sourced(tmp_path / "gone")) == wheels
    install(tmp_path / "jazzy")
    variables = sourced(tmp_path / "jazzy")
    del variables["ROS_DISTRO"]
    assert find_ros(variables) == wheels


def test_the_wheels_of_this_interpreter_are_found(wheels: RosInstallation) -> None:
    """Every folder of bundled libraries is named, so that Python need not start twice."""
    libraries = wheels.runtime.library_paths
    assert wheels.source == "wheels"
    assert wheels.distro.isalpha()
    assert wheels.rclpy_version[0].isdigit()
    assert (libraries[0] / "librmw_fastrtps_cpp.so").exists()
    site = next(path.parent for path in libraries if path.name == "ros_rclpy.libs")
    assert {path.name for path in site.glob("ros_*.libs")} == {path.name for path in libraries[1:]}
    assert wheels.runtime.environment["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] == "1"


@pytest.mark.ros
def test_a_child_needs_only_what_was_found(wheels: RosInstallation) -> None:
    """With exactly this environment rclpy, its libraries and the messages load."""
    code = """
import rclpy.node, geometry_msgs.msg, nav_msgs.msg, sensor_msgs.msg
print(rclpy.utilities.get_rmw_implementation_identifier())
"""
    environment = {**runtime_environment(wheels.runtime), "HOME": "/nonexistent"}
    done = subprocess.run(
        [wheels.runtime.executable, "-s", "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert done.stdout == "rmw_fastrtps_cpp\n", done.stderr


def test_no_home_folder_is_shown_as_a_whole(wheels: RosInstallation, monkeypatch: pytest.MonkeyPatch) -> None:
    """An environment made right in a home folder shows its parts, not the home."""
    prefix = wheels.prefix
    monkeypatch.setenv("HOME", str(prefix))
    paths = find_ros({}).runtime.read_paths
    assert prefix / "pyvenv.cfg" in paths or sys.prefix == sys.base_prefix
    assert not [path for path in paths if path in (prefix, *prefix.parents)]


def test_read_paths_are_absolute_and_exist(wheels: RosInstallation) -> None:
    """They are bound into sandboxes as they are."""
    assert [path for path in wheels.runtime.read_paths if not path.is_absolute() or not path.exists()] == []


def test_without_any_ros_the_command_that_installs_it_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The wheels where they exist, an installation to source where one lies ready."""
    with monkeypatch.context() as interpreter:
        interpreter.setattr(importlib.util, "find_spec", lambda name: None)
        interpreter.setattr(sysconfig, "get_path", lambda name: str(tmp_path))
        with pytest.raises(EnvironmentFault, match="expected rclpy, found none") as caught:
            find_ros({})
    assert caught.value.hint == install_hint(INSTALLED_HERE)
    monkeypatch.setattr(platform, "machine", lambda: "x86_64")
    wheels = '-m pip install "ros-jazzy-rclpy[fastrtps]" ros-jazzy-common-interfaces'
    assert install_hint(tmp_path).endswith(wheels)
    monkeypatch.setattr(platform, "machine", lambda: "riscv64")
    assert install_hint(tmp_path).startswith("install ROS 2 jazzy")
    for distro in ("humble", "rolling"):
        (tmp_path / distro).mkdir()
        (tmp_path / distro / "setup.bash").touch()
    assert install_hint(tmp_path) == f"source {tmp_path / 'rolling' / 'setup.bash'}"


def test_finding_ros_imports_none_of_it() -> None:
    """The supervisor must not load rclpy: its libraries need variables that only children have."""
    code = (
        "import sys; from grader.runtime.ros_installation import find_ros\n"
        "try: find_ros()\nexcept Exception as error: assert type(error).__name__ == 'EnvironmentFault'\n"
        "print([name for name in sys.modules if name.split('.')[0] in ('rclpy', 'std_msgs')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout == "[]\n", done.stderr
