"""Says what a build with colcon would refuse or leave out of a submission's packages, and what to do about it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from grader.grading.model.exercise import Location
from grader.grading.model.wording import quote
from grader.runtime.model.projects import ExaminedPackage, FlawKind, InstallFlaw

#: The most flaws that notes list; a criterion names the first, and counts the others.
MOST_NOTES = 5
_NOT_ROS = "so colcon does not build it as a ROS package"
_BUILD_FAILS = "so the build fails"
#: Code of a manifest's problem -> what is wrong, with the tag or text concerned, and what to do.
_MANIFEST: Mapping[str, tuple[str, str]] = {
    "xml": ("is not valid XML", "close each tag that you open"),
    "entities": ("declares entities", "leave them out"),
    "root": ("has no <package> around everything", 'put everything into <package format="3">'),
    "format": ("has the format {}", 'write <package format="3">'),
    "number": ("does not have exactly one <{0}>", "write one <{0}> into it"),
    "empty": ("has an empty <{0}>", "write something into <{0}>"),
    "version": ("has the version {}", "write a version such as 0.1.0"),
    "email": ("has the e-mail address {}", "write a whole address, such as name@example.org"),
    "no_email": ("has a maintainer without an e-mail address", "write a whole address, such as name@example.org"),
    "tag": ("has the tag <{}>, which its format does not know", "{advice}"),
    "twice": (
        "depends on {0} by <depend> and again by another tag",
        "keep <depend>{0}</depend> alone: it stands for building and running",
    ),
    "itself": ("depends on {}, which is itself", "remove that"),
}


def told_flaw(flaw: InstallFlaw) -> tuple[str, str]:
    """Return what is wrong, as a sentence that begins with the place, and one thing to do about it."""
    place = f"{quote(flaw.file)}:{flaw.line}" if flaw.line else quote(flaw.file)
    what, hint = _TOLD[flaw.kind]([quote(name) for name in flaw.names])
    return f"{place}: {what}", hint


def place_of_flaw(flaw: InstallFlaw) -> Location | None:
    """Return the line to correct; None if it is not known."""
    return Location(flaw.file, flaw.line) if flaw.line else None


def notes_on_installing(packages: Sequence[ExaminedPackage]) -> tuple[str, ...]:
    """Return a note for each of the first flaws, with what to do."""
    flaws = [flaw for package in packages for flaw in package.flaws]
    notes = [": ".join(told_flaw(flaw)) for flaw in flaws[:MOST_NOTES]]
    if len(flaws) > MOST_NOTES:
        notes.append(f"{len(flaws) - MOST_NOTES} more things would not be installed by colcon build")
    return tuple(notes)


def _manifest(names: Sequence[str]) -> tuple[str, str]:
    code, name = names
    what, hint = _MANIFEST.get(code, ("cannot be used", "compare it with one that `ros2 pkg create` makes"))
    advice = f"write <exec_depend> for <{name}>" if name == "run_depend" else 'remove it, or write format="3"'
    return f"{what.format(name)}, {_NOT_ROS}", hint.format(name, advice=advice)


def _build_type(_: Sequence[str]) -> tuple[str, str]:
    what = f"it does not name a build type, which stands for ROS 1 with CMake, {_BUILD_FAILS}"
    return what, "write <export><build_type>ament_python</build_type></export> into it"


def _no_setup(names: Sequence[str]) -> tuple[str, str]:
    file, kind = names
    return f"the build type {kind} needs {file}, which is not there, {_BUILD_FAILS}", f"add {file}, or correct the type"


def _project_name(names: Sequence[str]) -> tuple[str, str]:
    found, name = names
    what = f"project({found}) is not the name in package.xml, {name}, {_BUILD_FAILS}"
    return what, f"write project({name}), or <name>{found}</name> in package.xml"


def _setup_name(names: Sequence[str]) -> tuple[str, str]:
    found, name = names
    what = f"setup.py calls the package {found}, package.xml calls it {name}, so `ros2` looks in other folders"
    return what, "give both the same name, also in setup.cfg and in resource/"


def _no_folder(names: Sequence[str]) -> tuple[str, str]:
    package, folder = names
    what = f"it installs the Python package {package}, and there is no folder {folder}, {_BUILD_FAILS}"
    return what, f"rename the folder of your modules to {folder}, or correct `packages`"


def _no_file(names: Sequence[str]) -> tuple[str, str]:
    file = names[0]
    empty = "create it, as an empty file" if file.startswith("resource/") else "add it, or correct the path"
    return f"it installs {file}, which is not there, {_BUILD_FAILS}", empty


def _marker(names: Sequence[str]) -> tuple[str, str]:
    name, other, *lacks = names
    what = f"it does not install {' and '.join(lacks)}, by which ROS finds the package"
    what += f"; its marker is called {other}, not {name}" if other and lacks[0].startswith("resource/") else ""
    what += "; colcon adds what is missing for now, with a warning that this will end"
    pairs = {
        "package.xml": f"('share/{name}', ['package.xml'])",
        f"resource/{name}": f"('share/ament_index/resource_index/packages', ['resource/{name}'])",
    }
    return what, f"add {' and '.join(pairs[one] for one in lacks if one in pairs)} to data_files"


def _script_folder(names: Sequence[str]) -> tuple[str, str]:
    name, found = names
    where = f"to {found}" if found else "to bin/"
    what = f"programs are installed {where}, so `ros2 run {name}` does not find them in lib/{name}"
    lines = f"[develop] script_dir=$base/lib/{name} and [install] install_scripts=$base/lib/{name}"
    return what, f"write into setup.cfg, beside setup.py: {lines}"


def _no_script(names: Sequence[str]) -> tuple[str, str]:
    what = f"the entry point `{names[0]}` is not written as `name = module:function`, so `ros2 run` fails"
    return what, "write it so, as a text of its own with a comma behind it"


def _no_module(names: Sequence[str]) -> tuple[str, str]:
    script, module, path, *meant = names
    what = f"the entry point {script} names the module {module}, and there is no {path}, so `ros2 run` fails"
    return what, f"write {meant[0]} in place of {module}" if meant else "correct the module of the entry point"


def _no_function(names: Sequence[str]) -> tuple[str, str]:
    script, function, path = names
    what = f"the entry point {script} names {function}, which {path} does not define, so `ros2 run` fails"
    return what, f"define {function}() in {path}, or correct the entry point"


def _left_out(names: Sequence[str]) -> tuple[str, str]:
    script, package, *lacks = names
    what = f"the entry point {script} is in {package}, which `packages` does not install, so `ros2 run` fails"
    return what, f"add an empty {lacks[0]}, and use find_packages()" if lacks else f"add '{package}' to `packages`"


def _not_shared(names: Sequence[str]) -> tuple[str, str]:
    file, package, *by = names
    who = f", where {by[0]} looks for it" if by else ", so `ros2 launch` does not find it"
    folder = file.rpartition("/")[0]
    into = f"share/{package}/{folder}".rstrip("/")
    return f"it does not install {file} to {into}{who}", f"install {file} to {into}"


def _undeclared(names: Sequence[str]) -> tuple[str, str]:
    package, by = names
    return f"it does not declare {package}, which {by} imports", f"write <depend>{package}</depend> into it"


_TOLD: Mapping[FlawKind, Callable[[Sequence[str]], tuple[str, str]]] = {
    FlawKind.MANIFEST: _manifest,
    FlawKind.BUILD_TYPE: _build_type,
    FlawKind.NO_SETUP: _no_setup,
    FlawKind.PROJECT_NAME: _project_name,
    FlawKind.SETUP_NAME: _setup_name,
    FlawKind.NO_FOLDER: _no_folder,
    FlawKind.NO_FILE: _no_file,
    FlawKind.MARKER: _marker,
    FlawKind.SCRIPT_FOLDER: _script_folder,
    FlawKind.NO_SCRIPT: _no_script,
    FlawKind.NO_MODULE: _no_module,
    FlawKind.NO_FUNCTION: _no_function,
    FlawKind.LEFT_OUT: _left_out,
    FlawKind.NOT_SHARED: _not_shared,
    FlawKind.UNDECLARED: _undeclared,
}
