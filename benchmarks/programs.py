"""Draws random programs, records them in virtual time, and prints where they do not do what their model says.

Usage: python benchmarks/programs.py COUNT [--seed N] [--results FILE] [--jobs N] [--isolation TIER] [--wall N]
       python benchmarks/programs.py COUNT --reached [--seed N]
       COUNT programs are drawn in parts of 50; FILE keeps the result of each part, so that a run that was stopped goes
       on. Of a part in which programs differ, the first one is shrunk and printed with its description, its files and
       its first differences. With --wall, the first N programs of one process of each part are recorded on the
       wall clock as well, and compared within tolerances. With --reached, COUNT programs run without a sandbox in a
       copy of the grader that notes each function which is called, and the share of each module is printed.

The tests run 200 programs (`tests/runtime/random_programs/`), which also hold the generator and the model. The exit
code is 1 if a program differs.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests" / folder) for folder in ("runtime/random_programs", "support")]

from hostile import staging
from hypothesis import HealthCheck, Phase, given, seed, settings
from program_comparison import compared, differences_of_each, on_the_wall_clock
from program_description import Program
from program_strategy import drawn, programs

from grader.runtime.files import write_whole
from grader.runtime.session import RecordingSession, open_session

#: How many programs are drawn and recorded together.
AT_ONCE = 50
#: How often a program is recorded on the wall clock until it agrees.
WALL_TRIES = 3
#: What runs in the student's process, and what steps it.
MEASURED = (
    "host",
    *(f"worker/{name}.py" for name in ("claims", "core", "delay", "discovery", "matching", "observer")),
    *(f"worker/{name}.py" for name in ("runner", "service_ends", "service_peers")),
    *(f"worker/{name}.py" for name in ("topic_peers", "trace_recorder", "virtual_runner", "worker", "workload")),
)
#: The first lines of a module that notes which of its functions are called, in a file that its process can append to.
NOTING = """
def _note(name, _known=set()):
    if name not in _known:
        _known.add(name)
        import posix
        file = posix.open({path!r}, posix.O_WRONLY | posix.O_APPEND)
        posix.write(file, name.encode() + b"\\n")
        posix.close(file)
"""
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


def used_s() -> float:
    """Return the processor time of this process and of those that it has waited for."""
    both = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in both)


def shrunk(session: RecordingSession, part_seed: int, count: int) -> str:
    """Find the smallest program of a part that differs; return its description with its files and differences."""
    smallest: list[str] = []

    @seed(part_seed)
    @settings(
        max_examples=count,
        database=None,
        deadline=None,
        phases=[Phase.generate, Phase.shrink],
        suppress_health_check=list(HealthCheck),
        report_multiple_bugs=False,
    )
    @given(programs())
    def agrees(program: Program) -> None:
        with tempfile.TemporaryDirectory(dir=session.folder) as folder:
            found = compared(session, program, Path(folder))
        if found:
            smallest[:] = [repr(program), *found]
            raise AssertionError

    try:
        agrees()
    except AssertionError:
        return "\n".join(smallest)
    return "none of these programs differs when it is recorded again"


def once_right(session: RecordingSession, program: Program, folder: Path) -> str:
    """Return how a program differs on the wall clock in each of three recordings; empty if one of them does not.

    A busy machine can make the clocks differ, never agree.
    """
    for number in range(WALL_TRIES):
        told = on_the_wall_clock(session, program, folder / f"wall{number}")
        if not told:
            return ""
    return "\n".join([repr(program), *told])


def run_part(session: RecordingSession, part_seed: int, count: int, wall: int) -> dict[str, Any]:
    """Record the programs of a part, and return how many differ and how."""
    chosen = drawn(part_seed, count)
    began_s, found = time.monotonic(), []
    with tempfile.TemporaryDirectory(dir=session.folder) as name:
        folder = Path(name)
        folder.chmod(0o755)
        for program, differing in differences_of_each(session, chosen, folder):
            if differing:
                found.append("\n".join([repr(program), *differing]))
        alone = [program for program in chosen if len(program.processes) == 1][:wall]
        on_wall = [told for program in alone if (told := once_right(session, program, folder))]
    return {
        "programs": len(chosen),
        "differ": found,
        "wall": len(alone),
        "differ_on_wall": on_wall,
        "s": round(time.monotonic() - began_s, 1),
        "kinds": Counter(process.spinning.name for program in chosen for process in program.processes),
    }


def run(arguments: argparse.Namespace) -> int:
    """Run the parts that have no result yet, and print a summary."""
    path: Path = arguments.results
    results: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path and path.exists() else {}
    before_s, new = used_s(), 0
    with open_session(arguments.isolation, arguments.jobs) as session:
        staging(session)
        for first in range(0, arguments.count, AT_ONCE):
            part_seed, count = arguments.seed + first // AT_ONCE, min(AT_ONCE, arguments.count - first)
            known = results.get(str(part_seed))
            if known is None or known["programs"] < count:
                known = results[str(part_seed)] = run_part(session, part_seed, count, arguments.wall)
                new += known["programs"]
                if known["differ"]:
                    known["smallest"] = shrunk(session, part_seed, count)
                    print(known["smallest"], flush=True)
                if path:
                    write_whole(path, json.dumps(results, indent=1).encode())
            differ = len(known["differ"])
            print(f"seed {part_seed}: {known['programs']} programs, {differ} differ, {known['s']} s", flush=True)
    differ = sum(len(part["differ"]) for part in results.values())
    total = sum(part["programs"] for part in results.values())
    kinds = sum((Counter(part["kinds"]) for part in results.values()), Counter())
    print(f"{total} programs, {differ} differ; processes by the way they spin: {dict(kinds)}")
    if arguments.wall:
        told = [one for part in results.values() for one in part["differ_on_wall"]]
        print(*told, sep="\n\n")
        print(f"on the wall clock: {sum(part['wall'] for part in results.values())} programs, {len(told)} differ")
    if new and arguments.isolation == "none":  # a sandbox keeps what its processes have used to itself
        print(f"{(used_s() - before_s) / new:.2f} s of processor time for each program")
    return int(bool(differ))


def functions(tree: ast.AST, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every function with its qualified name."""
    for node in ast.iter_child_nodes(tree):
        name = f"{prefix}{node.name}" if isinstance(node, (*FUNCTIONS, ast.ClassDef)) else ""
        if isinstance(node, FUNCTIONS):
            yield name, node
        yield from functions(node, f"{name}." if name else prefix)


def noting(path: Path, module: str, log: str) -> list[str]:
    """Let a module note which of its functions are called, and return the names of all."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names = []
    for name, function in list(functions(tree)):
        names.append(f"{module} {name}")
        function.body.insert(0, ast.parse(f"_note({names[-1]!r})").body[0])
    future = (isinstance(node, ast.ImportFrom) and node.module == "__future__" for node in tree.body)
    at = next((number + 1 for number, found in enumerate(future) if found), 0)
    tree.body[at:at] = ast.parse(NOTING.format(path=log)).body
    path.write_text(ast.unparse(ast.fix_missing_locations(tree)), encoding="utf-8")
    return names


def reached(arguments: argparse.Namespace) -> int:
    """Run programs in a copy of the grader that notes which functions are called, and print the shares of modules."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        log = folder / "called"
        log.touch()
        log.chmod(0o666)
        shutil.copytree(ROOT / "grader", folder / "grader", ignore=shutil.ignore_patterns("__pycache__"))
        every: list[str] = []
        for part in MEASURED:
            place = folder / "grader" / "runtime" / part
            for path in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
                every += noting(path, str(path.relative_to(folder / "grader" / "runtime")), str(log))
        command = [sys.executable, __file__, str(arguments.count), "--seed", str(arguments.seed), "--isolation", "none"]
        subprocess.run(command, check=False, env={**os.environ, "PYTHONPATH": str(folder)})
        called = set(log.read_text(encoding="utf-8").splitlines())
    modules = Counter(one.split()[0] for one in every)
    for module, count in modules.items():
        missing = [one.split()[1] for one in every if one.split()[0] == module and one not in called]
        print(f"{module}: {count - len(missing)} of {count}; not {', '.join(missing) or 'any'}")
    for part in ("host", "worker"):
        known = [one for one in every if one.startswith(part)]
        found = sum(one in called for one in known)
        print(f"{part}: {found} of {len(known)} functions ({100 * found / len(known):.0f} %)")
    return 0


def main() -> int:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--results", type=Path)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--isolation", default="auto")
    parser.add_argument("--wall", type=int, default=0)
    parser.add_argument("--reached", action="store_true")
    arguments = parser.parse_args()
    return reached(arguments) if arguments.reached else run(arguments)


if __name__ == "__main__":
    sys.exit(main())
