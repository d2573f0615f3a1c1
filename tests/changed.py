"""Runs the tests that a change can break: fast ones first, and of these the tests of what changed.

Usage: python tests/changed.py [BASE] [--list] [OPTION OF PYTEST...]

A change is what differs from the commit BASE, by default HEAD, also new files. A module can break what imports it or
runs it in another process; a helper, the tests that import it; any other file, the tests that read its folder, or all.
`--list` prints the files and runs nothing. Exit codes: pytest's; 0 for no test.
"""

import ast
import re
import subprocess
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

import grimp

ROOT = Path(__file__).resolve().parents[1]
TESTS = ROOT / "tests"
#: What these packages hold runs in processes of its own, which a session starts.
STARTED = re.compile(r"grader\.runtime\.(host|worker|sandbox|supervisor|contained|interfaces|ros_packages)\b")
#: Files that are no modules, by how their paths begin, and the tests that read them; all tests may read others.
READ = {
    r"rubrics/": ("exercises", "recorded", "grading/rubrics", "grading/judging", "cli", "test_tutorials.py"),
    r"(reference_solutions|student_template)/": ("cli", "test_documents.py", "test_tutorials.py"),
    r"examples/": ("test_examples.py", "test_documents.py", "grading/judging/diagnosis"),
    r"docs/|[A-Z]+\.md": ("test_documents.py", "test_messages.py", "test_tutorials.py", "test_how_to.py", "world"),
    r"(integrations|\.github)/": ("integrations", "test_workplace.py"),
}


def changed(base: str) -> set[str]:
    """Return the paths of what differs from a commit, from the repository's root."""
    asked = (["git", "diff", "--name-only", base], ["git", "ls-files", "--others", "--exclude-standard"])
    return {line for each in asked for line in subprocess.check_output(each, cwd=ROOT, text=True).splitlines()}


@cache
def imports(path: Path) -> frozenset[str]:
    """Return what a file of tests imports or reads, helpers by their bare names; the commands if it starts programs."""
    text = path.read_text(encoding="utf-8")
    found = {re.sub(r"\W+", ".", place) + ".*" for place in re.findall(r'ROOT / "(grader(?:(?:/|" / ")\w+)*)', text)}
    found.update(re.findall(r"\bgrader(?:\.\w+)+", text))  # also in a command or a program
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            module = getattr(node, "module", None) or ""
            found.update((module, *(f"{module}.{alias.name}".lstrip(".") for alias in node.names)))
    return frozenset(found | ({"grader.cli.main"} if "places.GRADE" in found else set()))


def needs(path: Path, helpers: Mapping[str, Path], seen: set[Path]) -> set[str]:
    """Return all that a file of tests imports, with what its helpers import, and their paths."""
    seen.add(path)
    found = {str(path), *imports(path)}
    for helper in {helpers[name] for name in found & helpers.keys()} - seen:
        found |= needs(helper, helpers, seen)
    return found


def breakable(paths: Iterable[str]) -> list[Path]:
    """Return the files of tests that a change of these paths can break, those that import what changed first."""
    graph = grimp.build_graph("grader", cache_dir=None)
    helpers = {path.stem: path for path in TESTS.rglob("*.py") if not path.stem.startswith("test_")}
    near, far, readers = set[str](), set[str](), set[Path]()
    for path in map(Path, paths):
        module = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
        if module in graph.modules:
            reached = {module, *graph.find_downstream_modules(module)}
            if any(map(STARTED.match, reached)):
                reached |= {"grader.runtime.session", *graph.find_downstream_modules("grader.runtime.session")}
            near, far = near | {module}, far | reached
        elif path.parts[0] == "tests" and path.suffix == ".py" and (ROOT / path).exists():
            near, far = near | {str(ROOT / path)}, far | {str(ROOT / path)}
        elif path.parts[0] == "tests" and len(path.parts) > 2:
            readers.add(ROOT.joinpath(*path.parts[:3]))  # data: programs, tables, golden texts
        else:
            readers |= {TESTS / each for each in next((READ[row] for row in READ if re.match(row, str(path))), ("",))}
    tests = {path: needs(path, helpers, set()) for path in TESTS.rglob("test_*.py") if "workspace" not in path.parts}
    far |= {name[: dot.start()] + ".*" for name in far & graph.modules for dot in re.finditer(r"\.|$", name)}
    chosen = [path for path in tests if tests[path] & far or readers & {path, *path.parents}]
    return sorted(chosen, key=lambda path: (not tests[path] & near, path))


def main(arguments: list[str]) -> int:
    """Run the tests of a change, and return pytest's exit code."""
    base = arguments.pop(0) if arguments and arguments[0][0] != "-" else "HEAD"
    files = [str(path.relative_to(ROOT)) for path in breakable(changed(base))]
    if "--list" in arguments:
        print(*files, sep="\n")
    for marker in ("fast", "not fast") if files and "--list" not in arguments else ():
        command = [sys.executable, "-m", "pytest", "-m", marker, *arguments, *files]
        if (code := subprocess.run(command, cwd=ROOT, check=False).returncode) not in (0, 5):  # 5: no test is so
            return code
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
