"""Finds what a build with colcon would refuse or leave out of a submission's packages; it builds and reads nothing.

What is not known for certain is not a flaw: a file that a loop of setup.py may install, a function that a star import
may bring, a package that an unknown one may depend on.
"""

from __future__ import annotations

import ast
import posixpath
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace

from grader.grading.judging.installation import INTERFACES, ROS_PACKAGES
from grader.grading.judging.source import Source, argument, chain, last_name, literal_text, read_source
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.projects import ExaminedPackage, FlawKind, InstallFlaw, Project, SetupCall
from grader.runtime.model.submission import ReadProgram

#: Where a package tells ROS that it is installed.
_INDEX = "share/ament_index/resource_index/packages"
#: Endings of launch files.
_LAUNCH = (".launch.py", "_launch.py", ".launch.xml", "_launch.xml", ".launch.yaml", "_launch.yaml", ".launch.yml")
#: Folders whose modules run in a build or a test alone.
_APART = frozenset({"test", "tests", "docs", "examples"})
#: What a declared package brings for certain; one that is not listed may bring any package of ROS.
_BRINGS: Mapping[str, tuple[str, ...]] = {
    "rclpy": (
        *("builtin_interfaces", "rcl_interfaces", "rosgraph_msgs", "action_msgs", "unique_identifier_msgs"),
        *("lifecycle_msgs", "service_msgs", "type_description_interfaces", "ament_index_python"),
    ),
    "std_msgs": ("builtin_interfaces",),
    "std_srvs": (),
    "geometry_msgs": ("std_msgs", "builtin_interfaces"),
    "sensor_msgs": ("geometry_msgs", "std_msgs", "builtin_interfaces"),
    "nav_msgs": ("geometry_msgs", "std_msgs", "builtin_interfaces"),
    "builtin_interfaces": (),
    "rcl_interfaces": ("builtin_interfaces",),
    "action_msgs": ("builtin_interfaces", "unique_identifier_msgs"),
    "example_interfaces": ("action_msgs", "builtin_interfaces", "unique_identifier_msgs"),
    "rosidl_default_runtime": (),
    "setuptools": (),
    "python3": (),
}
_BROUGHT = frozenset(name for names in _BRINGS.values() for name in names)
#: Beginnings of declared names that bring no interfaces and no Python package that a node imports.
_BRING_NOTHING = ("python3-", "ament_", "rosidl_default_")
#: What a desktop installation has as ROS packages of another name, or not as ROS packages.
_NO_PACKAGES = frozenset({"cv2", "matplotlib", "PyKDL", "launch", "launch_ros", "launch_xml", "launch_yaml", "tf2_py"})
#: How often names in each other are followed, and the longest path that is made of them.
_DEPTH, _PATH_CHARACTERS = 8, 500
#: The most flaws of a package: one cause may have as many effects as there are files.
MOST_FLAWS = 40


def examined_packages(
    projects: Sequence[Project], names: Iterable[str], programs: Mapping[str, ReadProgram]
) -> tuple[ExaminedPackage, ...]:
    """Return each package with what its build refuses or leaves out.

    Args:
        projects: The packages.
        names: The paths of all files of the submission.
        programs: Its Python files by path.
    """
    if not projects:
        return ()
    every = sorted(names)
    sources = _Sources(programs)
    # Only data_files are compared with what is looked up, and only a file that names a share folder looks something up.
    asks = any(not one.by_cmake and one.build.setup is not None for one in projects)
    texts = {path: program.text or "" for path, program in programs.items()} if asks else {}
    looked_up = [
        found for path, text in texts.items() if "share" in text.casefold() for found in _looked_up(sources.of(path))
    ]
    return tuple(
        ExaminedPackage(
            project.name,
            project.folder,
            tuple(_Examination(project, projects, every, sources, looked_up).flaws())[:MOST_FLAWS],
        )
        for project in projects
    )


class _Sources:
    """The Python files of a submission as trees, each made once."""

    def __init__(self, programs: Mapping[str, ReadProgram]) -> None:
        self._programs = programs
        self._made: dict[str, Source | None] = {}

    def of(self, path: str) -> Source | None:
        """Return a file; None if its text is not known, or no Python can read it."""
        if path not in self._made:
            program = self._programs.get(path)
            source = None if program is None or program.text is None else read_source(path, program.text)
            self._made[path] = source if source is not None and source.tree is not None else None
        return self._made[path]


@dataclass(frozen=True, slots=True)
class _LookedUp:
    """A path in the share folder of a package that a program or launch file asks for."""

    package: str
    path: str
    file: str
    line: int


@dataclass(slots=True)
class _Examination:
    """One package, and all that is needed to examine it."""

    project: Project
    projects: Sequence[Project]
    every: Sequence[str]
    sources: _Sources
    looked_up: Sequence[_LookedUp]
    files: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        inner = [one.folder for one in self.projects if one is not self.project and one.folder]
        begin = f"{self.project.folder}/" if self.project.folder else ""
        apart = tuple(f"{folder}/" for folder in inner if f"{folder}/".startswith(begin))
        own = (name.removeprefix(begin) for name in self.every if name.startswith(begin) and not name.startswith(apart))
        self.files = frozenset(own)

    def flaws(self) -> Iterator[InstallFlaw]:
        """Yield the flaws, first those that end the build."""
        manifest, setup = self.project.build.manifest, self.project.build.setup
        if manifest is not None and manifest.problem is not None:
            code, name = manifest.problem
            line = int(name) if code == "xml" and name.isdecimal() else 0
            yield replace(self._flaw(FlawKind.MANIFEST, "package.xml", code, name), line=line)
        elif manifest is not None:
            yield from self._build_type(manifest.build_types)
        if self.project.by_cmake:
            yield from self._by_cmake()
        elif setup is not None and "setup.py" in self.files:
            yield from self._by_setup(setup)
        yield from self._undeclared()

    def _flaw(self, kind: FlawKind, file: str, *names: str, find: Sequence[str] = ()) -> InstallFlaw:
        """Return a flaw of a file of the package, with the first line that has one of the texts to find."""
        path = self._path(file)
        source = self.sources.of(path) if find else None
        lines = source.lines if source is not None else ()
        line = next((n for text in find for n, one in enumerate(lines, 1) if text in one), 0)
        return InstallFlaw(kind, path, line, names)

    def _path(self, file: str) -> str:
        return posixpath.join(self.project.folder, file)

    def _build_type(self, types: Sequence[str]) -> Iterator[InstallFlaw]:
        """Yield what is wrong with the build type; a manifest with several has conditions."""
        if not types and "setup.py" in self.files and not self.project.by_cmake:
            yield self._flaw(FlawKind.BUILD_TYPE, "package.xml")
        needed = {"ament_python": "setup.py", "ament_cmake": "CMakeLists.txt"}.get("".join(types[:1]), "")
        if len(types) == 1 and needed and needed not in self.files:
            yield self._flaw(FlawKind.NO_SETUP, "package.xml", needed, types[0])

    def _by_cmake(self) -> Iterator[InstallFlaw]:
        build = self.project.build
        ament = build.manifest is not None and "ament_cmake" in build.manifest.build_types
        if ament and build.cmake_name and build.cmake_name != self.project.name:
            yield self._flaw(FlawKind.PROJECT_NAME, "CMakeLists.txt", build.cmake_name, self.project.name)
        for file in dict.fromkeys(build.missing):
            yield self._flaw(FlawKind.NO_FILE, "CMakeLists.txt", file)
        if build.no_launch:
            for file in self._launch_files():
                yield self._flaw(FlawKind.NOT_SHARED, "CMakeLists.txt", file, self.project.name)

    def _by_setup(self, setup: SetupCall) -> Iterator[InstallFlaw]:
        found = [*self._script_folder(), *self._data_files(setup)]
        # colcon takes any name; what is installed under it is not found
        if found and setup.name and setup.name != self.project.name:
            yield self._flaw(FlawKind.SETUP_NAME, "setup.py", setup.name, self.project.name, find=("name",))
        if setup.packages is not None:
            for package in setup.packages:
                folder = _folder_of(setup, package)
                if not any(file.startswith(f"{folder}/") for file in self.files):
                    find = (f"'{package}'", f'"{package}"', "packages=")
                    yield self._flaw(FlawKind.NO_FOLDER, "setup.py", package, folder, find=find)
            for script, module, function in self.project.scripts:
                yield from self._entry_point(setup, script, module, function)
        for script in self.project.build.not_scripts:
            yield self._flaw(FlawKind.NO_SCRIPT, "setup.py", script, find=(script, "console_scripts"))
        yield from found

    def _entry_point(self, setup: SetupCall, script: str, module: str, function: str) -> Iterator[InstallFlaw]:
        find = (f"{module}:{function}", module)
        place = _folder_of(setup, module)
        path = next((p for p in (f"{place}.py", f"{place}/__init__.py") if p in self.files), "")
        package = module if path.endswith("/__init__.py") else module.rpartition(".")[0]
        if not path:
            if not self._may_come_from_elsewhere(setup, module.partition(".")[0]):
                meant = self._meant(setup, module)
                yield self._flaw(FlawKind.NO_MODULE, "setup.py", script, module, f"{place}.py", *meant, find=find)
        elif package and package not in (setup.packages or ()):
            marked = f"{_folder_of(setup, package)}/__init__.py"
            lacks = () if marked in self.files else (marked,)
            yield self._flaw(FlawKind.LEFT_OUT, "setup.py", script, package, *lacks, find=find)
        elif not _may_have(self.sources.of(self._path(path)), function.partition(".")[0]):
            yield self._flaw(FlawKind.NO_FUNCTION, "setup.py", script, function, path, find=find)

    def _meant(self, setup: SetupCall, module: str) -> list[str]:
        """Return the only installed module whose last name a wrong one has."""
        last = module.removesuffix(".py").rpartition(".")[2]
        found = [one for one in setup.packages or () if f"{_folder_of(setup, one)}/{last}.py" in self.files]
        return [f"{found[0]}.{last}"] if len(found) == 1 else []

    def _may_come_from_elsewhere(self, setup: SetupCall, top: str) -> bool:
        """Return whether a Python package may be another one's: it is declared, or lies in another place here."""
        manifest = self.project.build.manifest
        # what is in a Python package of its own is not imported without the name of that
        folders = (top, *(_folder_of(setup, one) for one in setup.packages or ()))
        own = tuple(self._path(f"{folder}/") for folder in folders)
        elsewhere = (f"/{name}" for name in self.every if not name.startswith(own))
        ends = (f"/{top}/__init__.py", f"/{top}.py")
        return manifest is None or top in manifest.dependencies or any(name.endswith(ends) for name in elsewhere)

    def _script_folder(self) -> Iterator[InstallFlaw]:
        given = self.project.build.script_folders
        if not self.project.scripts or (given is None and "setup.cfg" in self.files):
            return
        wanted = f"lib/{self.project.name}"
        found = [
            posixpath.normpath(one.strip().replace("${base}", "$base")) if one else "" for one in given or ("", "")
        ]
        wrong = [one for one in found if one.removeprefix("$base/") != wanted]
        if wrong:
            yield self._flaw(FlawKind.SCRIPT_FOLDER, "setup.cfg", self.project.name, wrong[0])

    def _data_files(self, setup: SetupCall) -> Iterator[InstallFlaw]:
        name, shared = self.project.name, self.project.data_files if setup.installs_files else ()
        if shared is None:
            return
        for target, files in shared:
            for file in files:
                if file not in self.files and not any(one.startswith(f"{file}/") for one in self.files):
                    find = (file, f"{posixpath.dirname(file)}/", "data_files")
                    yield self._flaw(FlawKind.NO_FILE, "setup.py", file, target, find=find)
        markers = [posixpath.basename(file) for target, files in shared if target == _INDEX for file in files]
        described = any("package.xml" in files for target, files in shared if target == f"share/{name}")
        if name not in markers or not described:
            lacks = [f"resource/{name}"] * (name not in markers) + ["package.xml"] * (not described)
            yield self._flaw(FlawKind.MARKER, "setup.py", name, ", ".join(markers[:1]), *lacks, find=("data_files",))
        places = {
            posixpath.normpath(posixpath.join(target, posixpath.basename(file)))
            for target, files in shared
            for file in files
        }
        sources = {file for target, files in shared if f"{target}/".startswith(f"share/{name}/") for file in files}
        left = [file for file in self._launch_files() if file not in sources]
        for file in left:
            yield self._flaw(FlawKind.NOT_SHARED, "setup.py", file, name, find=("data_files",))
        told = set(left)
        asked = (one for one in self.looked_up if one.package == name and one.path in self.files)
        for one in asked:
            if f"share/{name}/{one.path}" not in places and one.path not in told:
                told.add(one.path)
                by = f"{one.file}:{one.line}"
                yield self._flaw(FlawKind.NOT_SHARED, "setup.py", one.path, name, by, find=("data_files",))

    def _launch_files(self) -> list[str]:
        """Return the launch files of the package's folder for them."""
        return sorted(file for file in self.files if file.startswith("launch/") and file.endswith(_LAUNCH))

    def _undeclared(self) -> Iterator[InstallFlaw]:
        manifest = self.project.build.manifest
        if manifest is None or manifest.problem is not None:
            return
        siblings = {one.name: one for one in self.projects}
        declared, unknown = _with_what_they_bring(manifest.dependencies, siblings)
        told: set[str] = {self.project.name}
        for file in self._modules():
            source = self.sources.of(self._path(file))
            for name, line in () if source is None else _imported(source):
                known = name in siblings or (not unknown and _is_ros(name))
                if known and name not in declared | told and f"{name}/__init__.py" not in self.files:
                    told.add(name)
                    yield self._flaw(FlawKind.UNDECLARED, "package.xml", name, f"{self._path(file)}:{line}")

    def _modules(self) -> list[str]:
        """Return the Python files that run where the package is installed."""
        setup = self.project.build.setup
        folders = {_folder_of(setup, one) for one in setup.packages or ()} if setup is not None else set()
        found = {file for file in self.files if posixpath.dirname(file) in folders and file.endswith(".py")}
        installed = {file for _, file in self.project.programs if file in self.files}
        return sorted(file for file in found | installed if _APART.isdisjoint(file.split("/")))


def _folder_of(setup: SetupCall, package: str) -> str:
    """Return the folder of a Python package, or the path of a module without its ending; relative to the package."""
    folders = dict(setup.folders)
    head, tail = package, ""
    while head:
        if head in folders:
            return posixpath.normpath(posixpath.join(folders[head], tail))
        head, _, last = head.rpartition(".")
        tail = posixpath.join(last, tail) if tail else last
    return posixpath.normpath(posixpath.join(folders.get("", ""), tail))


_DEFINES = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
#: Names with which a module may bind others that are not written down.
_BINDS = frozenset({"globals", "vars", "exec", "setattr", "__getattr__"})


def _may_have(source: Source | None, name: str) -> bool:
    """Return whether a module may have a name: it is bound at the top level, or not all of them are known."""
    if source is None or source.stars or any(source.all(ast.Global)):
        return True
    bound = {node.id for node in source.all(ast.Name)} & _BINDS
    for node in source.nodes:
        names = _bound_by(node)
        if names and not any(isinstance(up, _DEFINES) for up in source.around(node, ast.AST)):
            bound |= names
    return name in bound or not bound.isdisjoint(_BINDS)


def _bound_by(node: ast.AST) -> set[str]:
    """Return the names that a part of a program binds itself."""
    if isinstance(node, _DEFINES):
        return {node.name}
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
        return {node.id}
    if isinstance(node, (ast.Import, ast.ImportFrom)):
        return {alias.asname or alias.name.partition(".")[0] for alias in node.names}
    return set()


def _imported(source: Source) -> Iterator[tuple[str, int]]:
    """Yield the top-level packages that a file imports, whatever is decided at run time, each with its line."""
    plain = ((node, alias.name) for node in source.all(ast.Import) for alias in node.names)
    parts = ((node, node.module or "") for node in source.all(ast.ImportFrom) if not node.level)
    for node, name in (*plain, *parts):
        if not any(isinstance(up, (ast.Try, ast.If)) for up in source.around(node, ast.AST)):
            yield name.partition(".")[0], node.lineno


def _is_ros(name: str) -> bool:
    known = name in _BRINGS or name in ROS_PACKAGES or name.endswith((*INTERFACES, "_srvs"))
    return known and name not in _NO_PACKAGES


def _with_what_they_bring(declared: Sequence[str], siblings: Mapping[str, Project]) -> tuple[set[str], bool]:
    """Return the declared packages with those that they bring, and whether there may be others."""
    found: set[str] = set()
    waiting, unknown = list(declared), False
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        found.add(name)
        if name in siblings:
            manifest = siblings[name].build.manifest
            unknown = unknown or manifest is None
            waiting += manifest.dependencies if manifest is not None else ()
        elif name in _BRINGS:
            waiting += _BRINGS[name]
        else:
            unknown = unknown or not (name in _BROUGHT or name.startswith(_BRING_NOTHING))
    return found, unknown


def _looked_up(source: Source | None) -> Iterator[_LookedUp]:
    """Yield the paths in share folders that a file builds from literal parts."""
    if source is None:
        return
    paths = _Paths(source)
    for node in source.nodes:
        if isinstance(node, (ast.Call, ast.BinOp, ast.JoinedStr)):
            package, slash, path = paths.of(node).removeprefix(_SHARE).partition("/")
            if slash and path and paths.of(node).startswith(_SHARE):
                yield _LookedUp(package, posixpath.normpath(path), source.file, node.lineno)


#: Stands before the name of a package for its share folder; and what is not known.
_SHARE, _UNKNOWN = "\0share ", ""
_FINDS = ("get_package_share_directory", "get_package_share_path", "FindPackageShare")
_JOINS = ("join", "PathJoinSubstitution", "joinpath", "Path", "PurePath", "str", "fspath")


class _Paths:
    """The paths that the expressions of a file build of literal parts; each is found once.

    Args:
        source: The file.
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self._known: dict[ast.AST, str] = {}

    def of(self, node: ast.AST | None, depth: int = 0) -> str:
        """Return the path that an expression builds; empty if it is not known."""
        if node is None or depth > _DEPTH:
            return _UNKNOWN
        if node not in self._known:
            self._known[node] = _UNKNOWN  # of what is its own value, too
            self._known[node] = self._found(node, depth + 1)
        return self._known[node]

    def _found(self, node: ast.AST, depth: int) -> str:
        if isinstance(node, ast.Name):
            stores = self._source.stored.get(node.id, ())
            parent = self._source.parents.get(stores[0]) if len(stores) == 1 else None
            return self.of(parent.value, depth) if isinstance(parent, ast.Assign) else _UNKNOWN
        if isinstance(node, ast.JoinedStr):
            parts = [one.value if isinstance(one, ast.FormattedValue) else one for one in node.values]
            return _whole([self.of(one, depth) for one in parts], "")
        if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Div)):
            both = [self.of(one, depth) for one in (node.left, node.right)]
            return _whole(both, "" if isinstance(node.op, ast.Add) else "/")
        if isinstance(node, ast.Call):
            return self._called(node, depth)
        return literal_text(node) or _UNKNOWN

    def _called(self, call: ast.Call, depth: int) -> str:
        name = self._source.resolved(call.func).rpartition(".")[2]
        name = name or chain(call.func).rpartition(".")[2] or last_name(call.func)
        if name in _FINDS:
            package = self.of(argument(call, 0, "package") or argument(call, 0, "package_name"), depth)
            return f"{_SHARE}{package}" if package and _SHARE not in package else _UNKNOWN
        if name not in _JOINS:
            return _UNKNOWN
        given = list(call.args)
        if name == "PathJoinSubstitution":
            given = list(given[0].elts) if len(given) == 1 and isinstance(given[0], (ast.List, ast.Tuple)) else []
        if name == "joinpath" and isinstance(call.func, ast.Attribute):
            given.insert(0, call.func.value)
        return _whole([self.of(one, depth) for one in given], "/")


def _whole(parts: Sequence[str], between: str) -> str:
    """Return the parts put together; empty if one is not known, or another than the first is absolute."""
    if not parts or not all(parts) or any(one.startswith(_SHARE) for one in parts[1:]):
        return _UNKNOWN
    if between and any(one.startswith("/") for one in parts[1:]):
        return _UNKNOWN
    whole = between.join(parts)
    return whole if len(whole) <= _PATH_CHARACTERS else _UNKNOWN
