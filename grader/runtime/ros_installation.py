"""Finds the Python interpreter and the ROS 2 installation for child processes, without importing ROS."""

from __future__ import annotations

import importlib.machinery
import importlib.util
import os
import platform
import re
import sys
import sysconfig
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Literal

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.model.releases import DEFAULT


@dataclass(frozen=True, slots=True)
class PythonRuntime:
    """The interpreter and the ROS installation that children run with.

    Attributes:
        executable: Absolute path of the Python interpreter.
        read_paths: Absolute files and folders that the interpreter, its packages and ROS need, read-only.
        library_paths: Entries of LD_LIBRARY_PATH, in order.
        python_paths: Additional entries of sys.path, in order.
        environment: Further variables that ROS needs (AMENT_PREFIX_PATH, ROS_DISTRO, RMW_IMPLEMENTATION ...).
    """

    executable: Path
    read_paths: tuple[Path, ...]
    library_paths: tuple[Path, ...]
    python_paths: tuple[Path, ...]
    environment: Mapping[str, str]


MESSAGE_PACKAGES = ("geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs")
MIDDLEWARE = "librmw_fastrtps_cpp.so"
DEFAULT_DISTRO = DEFAULT.name
INSTALLED_HERE = Path("/opt/ros")

#: Sandboxes bind paths by name, so none may contain `..`, as in `../.venv/bin/python`. Links are kept.
EXECUTABLE = Path(os.path.normpath(sys.executable))
# What every program needs from the system: the C library, the loader and its cache, and libraries set by alternatives.
SYSTEM_PATHS = tuple(
    map(Path, ("/usr/lib", "/usr/lib64", "/lib", "/lib64", "/etc/alternatives", "/etc/ld.so.cache", "/etc/ld.so.conf"))
)

# The wheels re-execute Python once to set LD_LIBRARY_PATH; setting this as well avoids the second start.
NO_BOOTSTRAP = {"_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}


@dataclass(frozen=True, slots=True)
class RosInstallation:
    """The ROS 2 installation that children use.

    Attributes:
        runtime: Interpreter, paths and variables for child processes.
        source: Where it comes from: Python wheels of this interpreter, or an installation that the shell sourced.
        distro: Name of the ROS release, e.g. `jazzy`.
        rclpy_version: Version of rclpy, e.g. `7.1.6`.
        prefix: Root folder of the installation.
        share: The folders that hold packages' shared files, such as the definitions of their messages.
    """

    runtime: PythonRuntime
    source: Literal["wheels", "sourced"]
    distro: str
    rclpy_version: str
    prefix: Path
    share: tuple[Path, ...]


def find_ros(environment: Mapping[str, str] | None = None, *, workspaces: bool = False) -> RosInstallation:
    """Find the ROS installation to use: the sourced one if there is one, else the wheels of this interpreter.

    The two are never mixed: with a sourced installation, child processes get no libraries of the wheels.

    Args:
        environment: Variables of the shell; those of this process if None.
        workspaces: Whether sourced workspaces belong to it, for programs of whoever sourced them.

    Raises:
        EnvironmentFault: There is no usable ROS; the hint is the command that fixes it.
    """
    environment = os.environ if environment is None else environment
    found = _find_sourced(environment, workspaces=workspaces) or _find_wheels()
    if found is None:
        raise EnvironmentFault("ROS 2: expected rclpy, found none in this environment", install_hint(INSTALLED_HERE))
    _require_parts(found)
    return found


def _find_sourced(environment: Mapping[str, str], *, workspaces: bool) -> RosInstallation | None:
    prefixes = _paths(environment.get("AMENT_PREFIX_PATH", ""))
    distro = environment.get("ROS_DISTRO", "")
    searched = _paths(environment.get("PYTHONPATH", ""))
    home_of_rclpy = next(
        (
            (prefix, folder)
            for prefix in prefixes
            for folder in _python_folders(prefix, searched)
            if _holds_rclpy(folder)
        ),
        None,
    )
    if not distro or home_of_rclpy is None:
        return None
    prefix, folder = home_of_rclpy
    _require_this_python(prefix, folder)
    # A source build has one prefix for each package, all in one folder. Other prefixes are workspaces: they may contain
    # solutions, and no exercise needs them.
    siblings = tuple(other for other in prefixes if workspaces or other.parent == prefix.parent)
    libraries = _below(siblings, _paths(environment.get("LD_LIBRARY_PATH", ""))) or tuple(
        other / "lib" for other in siblings
    )
    share = tuple(other / "share" for other in siblings)
    python_paths = tuple(path for other in siblings for path in _python_folders(other, searched))
    if workspaces:  # `colcon build --symlink-install` leaves modules in its build folder
        python_paths = _existing((*searched, *python_paths))
    runtime = PythonRuntime(
        executable=EXECUTABLE,
        read_paths=_existing((*_interpreter_paths(), *SYSTEM_PATHS, *siblings)),
        library_paths=libraries,
        python_paths=_once(python_paths),
        environment={
            "AMENT_PREFIX_PATH": ":".join(map(str, siblings)),
            "ROS_DISTRO": distro,
            "ROS_VERSION": "2",
            "ROS_PYTHON_VERSION": "3",
            **NO_BOOTSTRAP,
        },
    )
    return RosInstallation(runtime, "sourced", distro, _version_of_rclpy(prefix, folder), prefix, share)


def _find_wheels() -> RosInstallation | None:
    found = next(
        (
            (folder, wheel)
            for folder in _site_packages()
            for wheel in sorted(folder.glob("ros_*_rclpy-*.dist-info"))
            if _holds_rclpy(folder)
        ),
        None,
    )
    if found is None:
        return None
    folder, wheel = found
    distro = re.sub(r"^ros_(.+)_rclpy-.*", r"\1", wheel.name)
    # Not sys.prefix: the site-packages of a user or a distribution, and their libraries, are elsewhere.
    prefix = folder.parents[2]
    index = prefix / "share" / "ament_index"
    parts = (prefix / "lib", folder, *((index.parent,) if index.is_dir() else ()))
    runtime = PythonRuntime(
        executable=EXECUTABLE,
        read_paths=_existing((*_interpreter_paths(), *SYSTEM_PATHS, *parts)),
        library_paths=(prefix / "lib", *sorted(path for path in folder.glob("ros_*.libs") if path.is_dir())),
        python_paths=() if str(folder) in _isolated_path() else (folder,),
        environment={"ROS_DISTRO": distro, **NO_BOOTSTRAP},
    )
    return RosInstallation(runtime, "wheels", distro, _version_of_wheel(wheel), prefix, (prefix / "share",))


def _require_this_python(prefix: Path, folder: Path) -> None:
    extensions = sorted((folder / "rclpy").glob("_rclpy_pybind11.*.so"))
    loadable = importlib.machinery.EXTENSION_SUFFIXES
    if not extensions or any(path.name == "_rclpy_pybind11" + suffix for path in extensions for suffix in loadable):
        return
    built_for = re.search(r"cpython-(\d)(\d+)", extensions[0].name)
    other = f"python{built_for[1]}.{built_for[2]}" if built_for else "another Python"
    here = f"python{sys.version_info.major}.{sys.version_info.minor}"
    raise EnvironmentFault(
        f"{prefix}: expected rclpy for {here}, which runs the grader, found rclpy for {other}",
        f"install the grader with {other}, or use its own ROS: "
        "unset AMENT_PREFIX_PATH ROS_DISTRO PYTHONPATH LD_LIBRARY_PATH",
    )


def _require_parts(ros: RosInstallation) -> None:
    runtime = ros.runtime
    pip = f'{sys.executable} -m pip install "ros-{ros.distro}-rclpy[fastrtps]" ros-{ros.distro}-common-interfaces'
    apt = f"sudo apt install ros-{ros.distro}-rmw-fastrtps-cpp ros-{ros.distro}-common-interfaces"
    hint = pip if ros.source == "wheels" else apt
    if not any((folder / MIDDLEWARE).exists() for folder in runtime.library_paths):
        raise EnvironmentFault(f"{ros.prefix}: expected the Fast DDS middleware ({MIDDLEWARE}), found none", hint)
    folders = runtime.python_paths or tuple(_site_packages())
    missing = [name for name in MESSAGE_PACKAGES if not any((folder / name).is_dir() for folder in folders)]
    if missing:
        raise EnvironmentFault(f"{ros.prefix}: expected the message package {missing[0]}, found none", hint)


def install_hint(installed: Path) -> str:
    """Return the command after which there is a ROS, given the folder of the system's own installations."""
    setups = sorted(installed.glob("*/setup.bash"))
    if setups:
        preferred = installed / DEFAULT_DISTRO / "setup.bash"
        return f"source {preferred if preferred in setups else setups[-1]}"
    if sys.platform == "linux" and platform.machine() == "x86_64":
        wheels = f'"ros-{DEFAULT_DISTRO}-rclpy[fastrtps]" ros-{DEFAULT_DISTRO}-common-interfaces'
        return f"{sys.executable} -m pip install {wheels}"
    return f"install ROS 2 {DEFAULT_DISTRO} and run: source {installed / DEFAULT_DISTRO / 'setup.bash'}"


def _interpreter_paths() -> tuple[Path, ...]:
    """Return the paths that the interpreter itself reads; never a whole prefix, which may be a home folder."""
    prefix, base = Path(sys.prefix), Path(sys.base_prefix)
    folders = [Path(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib", "purelib", "platlib")]
    return (
        EXECUTABLE,
        prefix / "pyvenv.cfg",
        *(root / name for root in (prefix, base) for name in ("lib", "lib64")),
        *folders,
    )


def _site_packages() -> tuple[Path, ...]:
    spec = importlib.util.find_spec("rclpy")
    of_rclpy = (Path(spec.origin).parent.parent,) if spec is not None and spec.origin else ()
    return _once((*of_rclpy, *(Path(sysconfig.get_path(name)) for name in ("purelib", "platlib"))))


def _isolated_path() -> tuple[str, ...]:
    """Return where `python -I` finds packages, which excludes the user's site-packages."""
    return tuple(os.path.normpath(sysconfig.get_path(name)) for name in ("purelib", "platlib"))


def _python_folders(prefix: Path, searched: Iterable[Path]) -> tuple[Path, ...]:
    of_shell = _below((prefix,), searched)
    here = f"python{sys.version_info.major}.{sys.version_info.minor}"
    usual = (prefix / "lib" / here / "site-packages", prefix / "local" / "lib" / here / "dist-packages")
    return _existing((*of_shell, *usual))


def _holds_rclpy(folder: Path) -> bool:
    return (folder / "rclpy" / "__init__.py").is_file()


def _version_of_wheel(wheel: Path) -> str:
    """Read the version in the metadata of a wheel; importing importlib.metadata takes 20 ms."""
    with (wheel / "METADATA").open(encoding="utf-8") as lines:
        return next(line.partition(":")[2].strip() for line in lines if line.startswith("Version:"))


def _version_of_rclpy(prefix: Path, folder: Path) -> str:
    import importlib.metadata  # noqa: PLC0415 - takes long, and no worker needs it

    for distribution in importlib.metadata.distributions(name="rclpy", path=[str(folder)]):
        return distribution.version
    manifest = prefix / "share" / "rclpy" / "package.xml"
    text = manifest.read_text(encoding="utf-8", errors="replace") if manifest.is_file() else ""
    version = re.search(r"<version>\s*([\w.+-]+)\s*</version>", text)
    return version[1] if version else "unknown"


def _paths(value: str) -> tuple[Path, ...]:
    """Split a search path and keep absolute entries; an empty entry would mean the working directory."""
    return _once(Path(entry) for entry in value.split(os.pathsep) if entry.startswith("/"))


def _below(prefixes: Iterable[Path], paths: Iterable[Path]) -> tuple[Path, ...]:
    prefixes = tuple(prefixes)
    return tuple(path for path in paths if any(prefix == path or prefix in path.parents for prefix in prefixes))


def _existing(paths: Iterable[Path]) -> tuple[Path, ...]:
    home = Path(os.path.expanduser("~"))  # noqa: PTH111  stays "~" for a user without a home, as in some containers
    return _once(path for path in paths if path.exists() and path != home and path not in home.parents)


def _once(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return each path once, in order, without `..`."""
    return tuple(dict.fromkeys(Path(os.path.normpath(path)) for path in paths))
