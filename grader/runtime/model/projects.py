"""The ROS packages of a submission, as their project files describe them, and what their build would leave out."""

from __future__ import annotations

from enum import Enum

from grader.runtime.model.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class PackageManifest:
    """What a package.xml says.

    Attributes:
        problem: Why colcon does not take it for the manifest of a ROS package, and the tag or name concerned; empty if
            it does.
        dependencies: The packages that it depends on in any way, but for tests and documentation.
        build_types: The build types that it exports; whether a condition holds is not known.
    """

    problem: tuple[str, str] | None = None
    dependencies: tuple[str, ...] = ()
    build_types: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SetupCall:
    """What a setup.py passes to setup(), as far as all of it is known.

    Attributes:
        name: The name that it gives the package; empty if that is not known.
        packages: Its Python packages, dotted; None if they are not known.
        folders: Python package, empty for all others -> the folder that holds it, relative to the package.
        installs_files: Whether it passes data_files, known or not.
    """

    name: str = ""
    packages: tuple[str, ...] | None = None
    folders: tuple[tuple[str, str], ...] = ()
    installs_files: bool = True


@dataclass(frozen=True, slots=True)
class PackageBuild:
    """What is known of the build of a package, besides what it installs.

    Attributes:
        manifest: What package.xml says; None if that is not known.
        setup: What setup.py passes to setup(); None without one, or if it is not known.
        script_folders: Where setup.cfg has console scripts installed, below the prefix: for `install` and for
            `develop`; empty if it does not say, None if it was not read.
        cmake_name: The name in project() of CMakeLists.txt; empty if that is not known.
        missing: The files that CMakeLists.txt installs, whatever its conditions are, and that are not there.
        no_launch: Whether CMakeLists.txt certainly installs no launch file.
        not_scripts: The console scripts of setup.py that are not written as `name = module:function`.
    """

    manifest: PackageManifest | None = None
    setup: SetupCall | None = None
    script_folders: tuple[str, str] | None = None
    cmake_name: str = ""
    missing: tuple[str, ...] = ()
    no_launch: bool = False
    not_scripts: tuple[str, ...] = ()


class FlawKind(Enum):
    """What a build with colcon refuses or leaves out."""

    MANIFEST = "manifest"  # package.xml is not that of a ROS package
    BUILD_TYPE = "build_type"  # it does not name a build type
    NO_SETUP = "no_setup"  # there is no setup.py to build with
    PROJECT_NAME = "project_name"  # CMakeLists.txt has another name
    SETUP_NAME = "setup_name"  # setup.py has another name
    NO_FOLDER = "no_folder"  # a Python package has no folder
    NO_FILE = "no_file"  # a file that is to be installed is not there
    MARKER = "marker"  # nothing tells ROS that the package is installed
    SCRIPT_FOLDER = "script_folder"  # programs go where `ros2 run` does not look
    NO_SCRIPT = "no_script"  # an entry point is not written as one
    NO_MODULE = "no_module"  # an entry point names a module that is not there
    NO_FUNCTION = "no_function"  # an entry point names a function that is not there
    LEFT_OUT = "left_out"  # an entry point is in a Python package that is not installed
    NOT_SHARED = "not_shared"  # a file that launch files or programs look up is not installed
    UNDECLARED = "undeclared"  # a package that is imported is not declared


@dataclass(frozen=True, slots=True)
class InstallFlaw:
    """One thing that a build refuses or leaves out."""

    kind: FlawKind
    file: str  # the file to correct, relative to the submission
    line: int = 0  # its line, from 1; 0 if that is not known
    names: tuple[str, ...] = ()  # what is concerned, in an order that the kind decides


@dataclass(frozen=True, slots=True)
class ExaminedPackage:
    """A ROS package of a submission, and what its build refuses or leaves out."""

    name: str
    folder: str  # relative to the submission; empty for the submission's own folder
    flaws: tuple[InstallFlaw, ...] = ()


@dataclass(frozen=True, slots=True)
class Project:
    """One ROS package. Whoever reads its files checks every name and path: none leads out of its folder.

    Attributes:
        folder: Its folder, relative to the submission; empty for the submission's own folder.
        name: Its name: what package.xml says, or else setup.py, or else the name of the folder.
        scripts: Name, module and function of each console script.
        data_files: The folders below the prefix, with the files that setup.py installs to them, relative to the
            package; None if that is not known.
        programs: Name and file of each Python program that is installed as it is, by CMake for instance; the file is
            relative to the package.
        unrunnable: The same for other Python files beside them: `ros2 run` finds one only if its source is executable
            and was linked, not copied.
        foreign: The names of programs that are not in Python.
        imported: Folders with installed Python packages, relative to the package, besides its own.
        unread: Whether it may have programs that its files do not tell.
        by_cmake: Whether it has a CMakeLists.txt.
        build: What else is known of its build.
    """

    folder: str
    name: str
    scripts: tuple[tuple[str, str, str], ...] = ()
    data_files: tuple[tuple[str, tuple[str, ...]], ...] | None = None
    programs: tuple[tuple[str, str], ...] = ()
    unrunnable: tuple[tuple[str, str], ...] = ()
    foreign: tuple[str, ...] = ()
    imported: tuple[str, ...] = ()
    unread: bool = False
    by_cmake: bool = False
    build: PackageBuild = PackageBuild()
