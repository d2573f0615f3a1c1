"""What keeps judging pure and the host apart; `lint-imports` checks which package imports which (pyproject.toml)."""

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from places import ROOT
from sample_folders import GROUPS, folders_in
from source_trees import nodes_in, parsed

if TYPE_CHECKING:
    import grimp

pytestmark = pytest.mark.xdist_group("source")

PACKAGE = ROOT / "grader"

#: What pure packages never touch: files, processes, clocks, chance.
IMPURE = {"os", "subprocess", "socket", "time", "datetime", "random", "threading", "pathlib", "tempfile", "rclpy"}
#: Modules in pure packages that are not pure: a path is a value in some, two find what is shipped and rubrics, one runs
#: authors' files under a lock, others deliver what has been rendered or read what a platform says in the environment.
EXCUSED = {
    "grading/model/grading_options.py": {"pathlib"},
    "grading/model/rubric_files.py": {"os", "pathlib"},
    "runtime/shipped.py": {"pathlib"},
    "runtime/model/author_files.py": {"threading"},
    "runtime/model/submission.py": {"pathlib"},
    "grading/reporting/delivery.py": IMPURE,
    "grading/reporting/formats.py": {"os", "pathlib"},
    "grading/reporting/platforms/classroom50.py": {"pathlib", "datetime"},
    "grading/reporting/platforms/github.py": {"pathlib"},
    "grading/reporting/junit.py": {"pathlib"},
}
#: What the host may import besides the standard library and its own modules.
HOST_MAY_IMPORT = {"yaml", "rclpy", "time_machine", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs", "std_srvs"}


def imports_of(path: Path) -> Iterator[str]:
    """Yield the absolute module names that a file imports, wherever in it; relative ones begin with a dot."""
    for node in nodes_in(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")


#: Texts for people: nothing is decided by what they say.
FOR_PEOPLE = {"reason", "hint", "note", "sentence"}
TEXT_METHODS = {"startswith", "endswith", "removeprefix", "removesuffix", "partition", "rpartition", "find", "index"}
TEXT_METHODS |= {"split", "rsplit", "rfind", "rindex", "count"}
PATTERN_METHODS = {"search", "match", "fullmatch", "finditer", "findall", "split", "sub", "subn"}
#: What has a text that is not for people but from a program or a rubric; any other text may be that of a fault.
OF_PROGRAMS = r"o|t|side\.program|log|line|lines\[n\]|output|record|episode|value|self"
#: Modules that look into such texts all the same, and why.
READS_TEXT = {
    "grading/reporting/audience.py": "takes the parts with numbers out of what a student sees",
    "grading/reporting/text.py": "does not name a place twice",
    "grading/reporting/wording.py": "leaves out how every reason of a blocked criterion begins",
    "world/observed.py": "waits for what a program logs or writes",
}


def is_for_people(node: ast.AST) -> bool:
    """Return whether an expression is a reason, a hint, a note, or the text of a fault, by its name or its key."""
    if isinstance(node, ast.Call):
        called = node.func
        if isinstance(called, ast.Attribute) and called.attr == "get":
            return any(isinstance(argument, ast.Constant) and argument.value in FOR_PEOPLE for argument in node.args)
        of_str = isinstance(called, ast.Name) and called.id == "str"
        inner = node.args[:1] if of_str else [called.value] if isinstance(called, ast.Attribute) else []
        return any(map(is_for_people, inner))
    if isinstance(node, ast.Subscript):
        key = node.slice.value if isinstance(node.slice, ast.Constant) else None
        return key in FOR_PEOPLE or is_for_people(node.value)
    if isinstance(node, ast.BoolOp):
        return any(map(is_for_people, node.values))
    if isinstance(node, ast.Attribute) and node.attr == "text":
        return re.fullmatch(OF_PROGRAMS, ast.unparse(node.value)) is None
    name = node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""
    return name in FOR_PEOPLE


def reads_text(node: ast.AST) -> bool:
    """Return whether an expression decides or takes something by what a text for people says."""
    if isinstance(node, ast.Compare):
        pairs = zip(node.ops, node.comparators, strict=True)
        return any(isinstance(op, ast.In | ast.NotIn) and is_for_people(side) for op, side in pairs)
    if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
        return False
    own = node.func.attr in TEXT_METHODS and node.args and is_for_people(node.func.value)
    return own or (node.func.attr in PATTERN_METHODS and any(map(is_for_people, node.args)))


def text_readers(package: Path) -> list[str]:
    """Return the places that read texts for people, as `module:line`."""
    return [
        f"{path.relative_to(package).as_posix()}:{node.lineno}"
        for path in sorted(package.rglob("*.py"))
        for node in nodes_in(path)
        if isinstance(node, ast.expr) and reads_text(node)
    ]


def test_nothing_is_read_out_of_texts_for_people() -> None:
    """What a program has to know is a field of its own, so that sentences can be worded anew."""
    found = text_readers(PACKAGE)
    assert [place for place in found if place.partition(":")[0] not in READS_TEXT] == []
    assert READS_TEXT.keys() == {place.partition(":")[0] for place in found}


@pytest.mark.parametrize(
    "line",
    [
        "'bursts' in case.verdict.reason",
        "'code 0' not in fault.text",
        "found[0].fault.text.rstrip('.').endswith('code 0')",
        "f.text.startswith('EOFError')",
        "'code 2' not in found[0].text",
        "re.search('code', case.fault.text)",
        "PATTERN.fullmatch(str(criterion['hint'] or ''))",
        "PATTERN.fullmatch(str(criterion['hint']))",
        "PATTERN.sub('', verdict.reason)",
        "criterion.get('reason', '').split(';')",
        "note.startswith('x')",
        "'x' in str(verdict.hint)[:9]",
    ],
)
def test_a_planted_reader_of_texts_is_found(line: str, tmp_path: Path) -> None:
    """The rule can fail."""
    (tmp_path / "bad.py").write_text(f"def f(case, fault):\n    return {line}\n")
    assert text_readers(tmp_path) == ["bad.py:2"]


@pytest.mark.parametrize("line", ["fault.said('x')", "'x' in record.text", "case.reason == other", "reason in known"])
def test_what_is_no_reading_is_let_be(line: str, tmp_path: Path) -> None:
    """What a student's program wrote is no text of ours, and texts may be compared whole."""
    (tmp_path / "good.py").write_text(f"def f(case, fault):\n    return {line}\n")
    assert text_readers(tmp_path) == []


#: Packages and modules that are pure.
PURE = (
    "runtime/model",
    "runtime/worker/claims.py",
    "runtime/worker/core.py",
    "runtime/worker/delay.py",
    "runtime/worker/matching.py",
    "grading/model",
    "grading/judging",
    "grading/reporting",
    "course/class_page",
    "course/mutation/operators",
)


def impurities(package: Path) -> list[str]:
    """Return every import in a pure package of what touches the world, as sentences."""
    paths = sorted(path for pure in PURE for path in (package / pure).rglob("*.py"))
    paths += [package / pure for pure in PURE if pure.endswith(".py") and (package / pure).exists()]
    found = []
    for path in paths:
        name = path.relative_to(package).as_posix()
        touched = {imported.split(".")[0] for imported in imports_of(path)} & IMPURE
        found += [f"{name} imports {module}" for module in sorted(touched - EXCUSED.get(name, set()))]
    return found


def test_judging_and_rendering_are_pure() -> None:
    """They read neither files nor clocks, start nothing and roll no dice; delivery alone writes files."""
    assert impurities(PACKAGE) == []


def test_a_planted_impurity_is_found(tmp_path: Path) -> None:
    """Also inside a function, and under another name."""
    planted = {
        "grading/judging/checks/bad.py": "def f():\n    from time import sleep as rest\n",
        "runtime/model/bad.py": "import os.path as p, random\n",
        "grading/reporting/bad.py": "import datetime\n",
        "grading/reporting/delivery.py": "import tempfile\n",
        "runtime/worker/core.py": "import time\n",
    }
    for name, source in planted.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(source)
    assert impurities(tmp_path) == [
        "grading/judging/checks/bad.py imports time",
        "grading/reporting/bad.py imports datetime",
        "runtime/model/bad.py imports os",
        "runtime/model/bad.py imports random",
        "runtime/worker/core.py imports time",
    ]


def host_needs(package: Path) -> list[str]:
    """Return what the host imports beyond the standard library, ROS and itself, as sentences."""
    host = package / "runtime" / "host"
    return [
        f"{path.name} imports {imported}"
        for path in sorted(host.rglob("*.py"))
        for imported in imports_of(path)
        # A dot more than the module has folders above it leads out of the host.
        if not imported.startswith(".") or imported.startswith("." * (len(path.relative_to(host).parts) + 1))
        if imported.split(".")[0] not in HOST_MAY_IMPORT | sys.stdlib_module_names
    ]


def test_the_host_needs_little() -> None:
    """The host is the standard library, rclpy, its messages and its yaml: it runs where nothing else is readable.

    One file stands in for modules of matplotlib, and is read only when a program imports these. Two use what whoever
    tests own programs has asked for.
    """
    for_some = ("windows.py imports matplotlib", "covered.py imports coverage", "debugging.py imports debugpy")
    assert [need for need in host_needs(PACKAGE) if not need.startswith(for_some)] == []


def test_a_planted_need_is_found(tmp_path: Path) -> None:
    """Other libraries, the rest of the grader, and what lies above the host's folder."""
    (tmp_path / "runtime" / "host" / "part").mkdir(parents=True)
    source = "import os, numpy\nimport rclpy.node\nfrom . import fine\nfrom .fine import a\n"
    (tmp_path / "runtime" / "host" / "bad.py").write_text(source + "from ..model import trace\nimport grader\n")
    (tmp_path / "runtime" / "host" / "part" / "worse.py").write_text("from ..fine import a\nfrom ...model import b\n")
    assert host_needs(tmp_path) == [
        *("bad.py imports numpy", "bad.py imports ..model", "bad.py imports grader"),
        "worse.py imports ...model",
    ]


def test_every_module_says_what_it_holds() -> None:
    """One sentence at the top of every file."""
    for path in sorted(PACKAGE.rglob("*.py")):
        assert ast.get_docstring(parsed(path.read_text(encoding="utf-8"))), path


def class_names(package: Path) -> dict[str, list[str]]:
    """Return the modules that define a public class of each name."""
    found: dict[str, list[str]] = {}
    for path in sorted(package.rglob("*.py")):
        for node in parsed(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found.setdefault(node.name, []).append(path.relative_to(package).as_posix())
    return found


def test_a_name_of_a_class_has_one_meaning(tmp_path: Path) -> None:
    """No two public classes of the grader have one name, so that each search finds one thing."""
    shared = {name: places for name, places in class_names(PACKAGE).items() if len(places) > 1}

    assert shared == {}
    (tmp_path / "one.py").write_text("class Line: ...\nclass _Own: ...\n")
    (tmp_path / "other.py").write_text("class Line: ...\nclass _Own: ...\n")
    assert class_names(tmp_path) == {"Line": ["one.py", "other.py"]}


#: Places on one person's machine; what students hand in may name any.
AT_HOME = re.compile(r"(?<![\w.}])(/home/(?!log\b)\w|/root/|/Users/\w|[A-Z]:\\\\)")


def names_a_home(text: str) -> bool:
    """Return whether a text names a place that only one machine has."""
    return AT_HOME.search(text) is not None


def test_no_file_names_a_place_on_one_machine() -> None:
    """What is in the repository works anywhere, or it is not told where."""
    listed = subprocess.run(
        ["git", "ls-files", "*.py", "*.md", "*.toml", "*.yaml", "*.yml", "*.xml"],
        cwd=PACKAGE.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    if listed.returncode != 0:
        pytest.skip("this is no checkout")
    written = tuple(f"{place.relative_to(PACKAGE.parent)}/" for place in folders_in(*GROUPS))
    names = [name for name in listed.stdout.splitlines() if not name.startswith(written)]
    texts = {name: (PACKAGE.parent / name) for name in names if name != "tests/test_architecture.py"}
    assert [n for n, p in texts.items() if p.exists() and names_a_home(p.read_text(encoding="utf-8"))] == []


@pytest.mark.parametrize("place", ["/home/ada/x", "see /root/x", "'/Users/ada'", r"C:\\x"])
def test_a_place_on_one_machine_is_recognised(place: str) -> None:
    """The rule can fail."""
    assert names_a_home(place)


@pytest.mark.parametrize(
    "place", ["/tmp/home/log", "~/x", "https://a.b/home/x", "$HOME/x", "a/root/b", "/proc/{pid}/root/tmp"]
)
def test_places_that_every_machine_has_are_none(place: str) -> None:
    """Neither are paths inside a sandbox."""
    assert not names_a_home(place)


#: What asks checks for their roles and facts instead of knowing their classes.
KNOWS_NO_CHECK = (
    "grading/judging/diagnosis/__init__.py",
    "grading/judging/diagnosis/rules.py",
    "grading/judging/plots.py",
    "grading/judging/figures.py",
    "grading/rubrics/check_parameters.py",
)


def test_the_engine_of_hint_rules_and_the_charts_know_no_check() -> None:
    """A check declares what its parameters are, and hands typed facts to rules."""
    for name in KNOWS_NO_CHECK:
        assert [
            module for module in imports_of(PACKAGE / name) if module.startswith("grader.grading.judging.checks")
        ] == []


def test_no_hint_rule_reads_the_evidence_of_reports() -> None:
    """That is JSON for readers of reports; what rules need is in typed facts."""
    rules = sorted((PACKAGE / "grading" / "judging" / "diagnosis").glob("*.py"))
    reads = [
        f"{path.name}:{node.lineno}"
        for path in rules
        for node in nodes_in(path)
        if isinstance(node, ast.Attribute) and node.attr == "evidence" and path.name != "__init__.py"
    ]
    assert reads == []


TESTS = PACKAGE.parent / "tests"
#: The folders of tests that lie as the code that they test.
MIRRORED = ("cli", "course", "grading", "runtime", "world")
#: Folders with tests, or with programs that look like tests, that have no counterpart.
NO_COUNTERPART = {
    "runtime/random_programs": "programs drawn at random, and a model of what all of the runtime must do with them",
    "world/workspace/src/robot/test": "a package that is tested itself",
}
#: What shows that a test uses a part as its users do, without an import: it starts `grade`, or a pytest of its own.
FROM_OUTSIDE = {"cli": r"\bGRADE\b", "world": r'"pytest"|\bpytester\b'}


def parts_imported(path: Path) -> Iterator[str]:
    """Yield what a test imports of the grader, with the names that it takes out of packages."""
    for node in nodes_in(path):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
    yield from imports_of(path)


def misplaced(tests: Path) -> list[str]:
    """Return which test modules lie in a folder that the package lacks, or have nothing to do with theirs.

    A test module belongs to a folder if it imports something out of it, if its name holds that of the folder or of a
    module in it, or if it uses the part from outside.
    """
    found = []
    for path in sorted(path for part in MIRRORED for path in (tests / part).rglob("test_*.py")):
        folder = path.parent.relative_to(tests)
        if folder.as_posix() in NO_COUNTERPART:
            continue
        if not (PACKAGE / folder).is_dir():
            found.append(f"{path.relative_to(tests)}: there is no grader/{folder}")
            continue
        package = ".".join(("grader", *folder.parts, ""))
        modules = {folder.name, *(entry.stem for entry in (PACKAGE / folder).iterdir() if entry.name[0] not in "_.")}
        named = any(re.search(rf"_{module}(?:_|$)", path.stem) for module in modules)
        outside = FROM_OUTSIDE.get(folder.as_posix())
        used = outside is not None and re.search(outside, path.read_text(encoding="utf-8"))
        if not named and not used and not any(name.startswith(package) for name in parts_imported(path)):
            found.append(
                f"{path.relative_to(tests)}: neither imports {package[:-1]} nor has the name of a module in it"
            )
    return found


def test_tests_lie_where_the_code_lies() -> None:
    """What tests a module is found by the path of the module."""
    assert misplaced(TESTS) == []
    assert [folder for folder in NO_COUNTERPART if not list((TESTS / folder).glob("test_*.py"))] == []


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("runtime/execution/test_plan.py", "from grader.runtime import plan", "there is no grader/runtime/execution"),
        ("runtime/worker/test_marks.py", "import grader.grading.model.report", "neither imports grader.runtime.worker"),
        (
            "runtime/worker/test_marks.py",
            "from grader.runtime.workers import x",
            "neither imports grader.runtime.worker",
        ),
        ("runtime/worker/test_marks.py", "from grader.runtime.worker import runner", None),
        ("runtime/worker/test_marks.py", "import grader.runtime.worker.runner", None),
        ("runtime/worker/test_runner_marks.py", "import rclpy", None),
        ("cli/test_marks.py", "import pytest", "neither imports grader.cli"),
        ("cli/test_marks.py", "from places import GRADE", None),
    ],
)
def test_a_misplaced_test_is_found(name: str, text: str, said: str | None, tmp_path: Path) -> None:
    """The rule can fail."""
    path = tmp_path / name
    path.parent.mkdir(parents=True)
    path.write_text(text, encoding="utf-8")
    assert [said is not None and said in one for one in misplaced(tmp_path)] == ([True] if said else [])


#: Folders of modules that are tested elsewhere.
TESTED_ELSEWHERE: dict[str, str] = {
    "grading/judging/logs": "tests/grading/judging/checks: by the checks that read logs",
    "runtime/interfaces/runtime": "tests/runtime/interfaces",
    **dict.fromkeys(
        (f"runtime/ros_packages/{path.name}" for path in (PACKAGE / "runtime/ros_packages").iterdir() if path.is_dir()),
        "tests/runtime/ros_packages",
    ),
}


def test_every_folder_of_code_has_tests() -> None:
    """In the folder of the same path, or named above."""
    folders = {path.parent.relative_to(PACKAGE) for path in PACKAGE.rglob("*.py") if path.name != "__init__.py"}
    without = {
        folder.as_posix()
        for folder in folders
        if folder.parts and folder.parts[0] in MIRRORED and not list((TESTS / folder).glob("test_*.py"))
    }
    assert without <= set(TESTED_ELSEWHERE)


#: The parts, and where the lists of their doors stand: the modules that others may import.
DOORS = {f"doors-of-{part}": f"grader.{part}" for part in ("runtime", "grading", "course")}


def doors_of(contract: str) -> list[tuple[str, str]]:
    """Return who may import what of a part, as patterns of module names."""
    settings = tomllib.loads((PACKAGE.parent / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = {one["id"]: one for one in settings["tool"]["importlinter"]["contracts"]}
    pairs = (line.split(" -> ") for line in contracts[contract]["ignore_imports"])
    return [(importer, imported) for importer, imported in pairs]


def opened(door: tuple[str, str], one: tuple[str, str]) -> bool:
    """Return whether a door lets an import pass; `*` stands for one name, and `**` for any."""
    patterns = (re.escape(side).replace(r"\*\*", ".+").replace(r"\*", "[^.]+") for side in door)
    return all(re.fullmatch(pattern, module) for pattern, module in zip(patterns, one, strict=True))


def from_outside(graph: "grimp.ImportGraph", part: str) -> set[tuple[str, str]]:
    """Return the imports of modules of a part by modules outside of it, as pairs of importer and imported."""
    inside = {part, *graph.find_descendants(part)}
    return {
        (importer, module)
        for module in inside
        for importer in graph.find_modules_that_directly_import(module)
        if importer not in inside
    }


@pytest.fixture(scope="module")
def graph() -> "grimp.ImportGraph":
    return pytest.importorskip("grimp").build_graph("grader", cache_dir=None)  # type: ignore[no-any-return]


@pytest.mark.parametrize("contract", DOORS)
def test_a_part_is_imported_by_its_doors_alone(contract: str, graph: "grimp.ImportGraph") -> None:
    """And every door is used by somebody: one that nobody needs is closed."""
    doors, imports = doors_of(contract), from_outside(graph, DOORS[contract])
    assert [one for one in sorted(imports) if not any(opened(door, one) for door in doors)] == []
    assert [door for door in doors if not any(opened(door, one) for one in imports)] == []


@pytest.mark.parametrize(
    ("contract", "importer", "imported"),
    [
        ("doors-of-runtime", "grader.cli.main", "grader.runtime.supervisor.supervisor"),
        ("doors-of-runtime", "grader.grading.app.grade", "grader.runtime.serialization"),
        ("doors-of-grading", "grader.course.packaging", "grader.grading.judging.diagnosis.rules"),
        ("doors-of-course", "grader.cli.batch", "grader.course.classroom.cluster.dispatcher"),
    ],
)
def test_an_import_from_the_inside_of_a_part_is_found(
    contract: str, importer: str, imported: str, graph: "grimp.ImportGraph"
) -> None:
    """The rule can fail."""
    assert {importer, imported} <= graph.modules
    assert not any(opened(door, (importer, imported)) for door in doors_of(contract))


def modules_of(tests: Path) -> list[Path]:
    """Return the modules of tests, and the helpers beside them and in `support`; no programs that tests grade."""
    folders = {path.parent for path in tests.rglob("test_*.py")} | {tests / "support"}
    return sorted(path for folder in folders for path in folder.glob("*.py"))


def repeated(tests: Path) -> list[list[str]]:
    """Return the helpers and fixtures that do the same in several modules; those of one or two statements may."""
    found: dict[str, list[str]] = {}
    for path in modules_of(tests):
        for node in parsed(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("test_"):
                body = node.body[1:] if ast.get_docstring(node) is not None else node.body
                if sum(isinstance(part, ast.stmt) for line in body for part in ast.walk(line)) > 2:
                    place = f"{path.relative_to(tests)}: {node.name}"
                    found.setdefault("".join(map(ast.dump, body)), []).append(place)
    return [places for places in found.values() if len(places) > 1]


@pytest.mark.long
def test_helpers_have_one_home() -> None:
    """No two modules define the same helper, and none takes one out of a module of tests."""
    assert repeated(TESTS) == []
    names = {path.stem for path in modules_of(TESTS) if path.stem.startswith("test_")}
    assert [(path.name, name) for path in modules_of(TESTS) for name in imports_of(path) if name in names] == []


def test_a_repeated_helper_is_found(tmp_path: Path) -> None:
    """The rule can fail, whatever the helpers are called and say of themselves."""
    for name in ("one", "other"):
        text = f'def {name}(path):\n    """{name}"""\n    path.mkdir()\n    path.chmod(0o755)\n    return path\n'
        (tmp_path / f"test_{name}.py").write_text(text, encoding="utf-8")
    assert repeated(tmp_path) == [["test_one.py: one", "test_other.py: other"]]


#: Functions that several modules have under one name, because each is asked for by it.
HOOKS = {
    "main": "a program that is started with `python -m`, or a script of it",
    "command": "the command of a module in `grader/cli/`, which `CommandLine` imports by this name",
    "install": "puts the module's replacements in place, in a process that they are for",
}


def public_functions(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    named = (node.name for node in tree.body if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))
    return {name for name in named if not name.startswith("_")}


def test_a_public_function_has_a_name_of_its_own() -> None:
    """Whoever searches for a name finds one function; what stands in for packages of ROS has their names.

    The door `grader.api` has the names of the commands.
    """
    homes: dict[str, list[str]] = {}
    for path in sorted((ROOT / "grader").rglob("*.py")):
        if "ros_packages" not in path.parts:
            for name in public_functions(path) - HOOKS.keys():
                homes.setdefault(name, []).append(path.relative_to(ROOT).as_posix())
    assert {name: found for name, found in homes.items() if len(found) > 1} == {}


def test_a_planted_second_function_is_found(tmp_path: Path) -> None:
    """The rule can fail."""
    file = tmp_path / "planted.py"
    file.write_text("def shown(): ...\ndef _own(): ...\nasync def asked(): ...\n", encoding="utf-8")
    assert public_functions(file) == {"shown", "asked"}
