"""Project files are read in a process of its own: whatever they hold becomes a note, and costs the grader nothing."""

from __future__ import annotations

import resource
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from places import TESTS
from tiers import NIGHTLY

from grader.grading.submissions import contained_reader, projects
from grader.grading.submissions.contained_reader import told_by_process
from grader.grading.submissions.projects import read_projects
from grader.runtime.model.projects import PackageBuild, Project
from grader.runtime.programs.executables import executables, find_executable
from grader.runtime.programs.shares import install_shares
from grader.runtime.ros_installation import RosInstallation

#: What a reader of TOML needs too long for.
COSTLY_KEY = "a key of very many parts"
COSTLY = "setup.py: not read, because that would take too much memory or time"
INVALID = "setup.py: not valid, so what is declared there is not used"
NAMES = "setup.py: names of files or programs that no package can have are left out"
LARGE = "setup.py: not read, because of more than 256 KiB"
SETUP = "import os\nfrom glob import glob\nfrom setuptools import find_packages, setup\n"
#: The most memory that a trusted process may take.
TRUSTED_BYTES = 400 << 20


def made(folder: Path, files: Mapping[str, str | bytes]) -> Path:
    """Write a package with a node, and other files."""
    for name, content in {"own/node.py": "def main(): pass\n", **files}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    return folder


def scripts(*lines: str) -> str:
    return f"{SETUP}setup(name='own', entry_points={{'console_scripts': [{', '.join(lines)}]}})\n"


def data_files(*pairs: str) -> str:
    return f"{SETUP}setup(name='own', data_files=[{', '.join(pairs)}])\n"


NODE = ("node", "own.node", "main")
LOOP = f"for a in {list(range(1000))}:\n  for b in {list(range(1000))}:\n    pass\n"
HONEST = {
    "find_packages": {
        "setup.py": f"{SETUP}setup(name='own', packages=find_packages(), entry_points="
        "{'console_scripts': ['node = own.node:main']})\n"
    },
    "f-strings": {
        "setup.py": f"{SETUP}p = 'own'\nsetup(name=p, entry_points="
        "{'console_scripts': [f'{n} = {p}.{n}:main' for n in ['node']]})\n"
    },
    "format": {
        "setup.py": f"{SETUP}p = 'own'\nsetup(name=p, entry_points="
        "{'console_scripts': ['{0} = {1}.{0}:{f}'.format('node', p, f='main')]})\n"
    },
    "percent": {
        "setup.py": f"{SETUP}p = 'own'\nsetup(name=p, entry_points="
        "{'console_scripts': ['node = %s.node:%s' % (p, 'main')]})\n"
    },
    "a computed list": {
        "setup.py": f"{SETUP}S = []\nfor n in sorted(['node']):\n    S.append(n + ' = own.' + n + ':main')\n"
        "setup(name='own', entry_points={'console_scripts': S})\n"
    },
    "setup.cfg only": {
        "package.xml": "<package><name>own</name></package>",
        "setup.cfg": "[options.entry_points]\nconsole_scripts =\n    node = own.node:main\n",
    },
    "pyproject only": {
        "package.xml": "<package><name>own</name></package>",
        "pyproject.toml": "[project]\nname = 'own'\n[project.scripts]\nnode = 'own.node:main'\n",
    },
    "another encoding": {
        "setup.py": b"# -*- coding: latin-1 -*-\n# caf\xe9\n" + scripts("'node = own.node:main'").encode()
    },
    "a large README": {
        "setup.py": scripts("'node = own.node:main'") + "# " + "x" * 200_000,
        "README.md": "x" * 9_000_000,
    },
}


@pytest.mark.parametrize("files", HONEST.values(), ids=HONEST)
def test_what_real_packages_declare_is_read(tmp_path: Path, files: Mapping[str, str | bytes]) -> None:
    """However the author writes it down, without a note."""
    (project,), notes = read_projects(made(tmp_path, files))
    assert (replace(project, build=PackageBuild()), notes) == (Project("", "own", (NODE,)), ())


def test_patterns_and_joined_paths_are_read(tmp_path: Path, ros: RosInstallation) -> None:
    """As tutorials write them: launch files, parameter files, meshes below a folder."""
    text = data_files(
        "('share/own', ['package.xml'])",
        "(os.path.join('share', 'own', 'launch'), glob(os.path.join('launch', '*launch.[pxy][yma]*')))",
        "('share/' + 'own' + '/config', glob('./config/*.yaml'))",
        "('share/own/', ['config//../config/a.yaml'])",
    )
    files = {
        "package.xml": "<name>own</name>",
        "launch/a.launch.py": "",
        "launch/.b.launch.py": "",
        "config/a.yaml": "",
    }
    root = made(tmp_path / "ws", {"setup.py": text, **files})
    found, notes = read_projects(root)
    assert notes == ()
    prefix = tmp_path / "prefix"
    assert install_shares(root, found, prefix, ros)[1] == ()
    installed = {str(path.relative_to(prefix / "share/own")) for path in (prefix / "share/own").rglob("*.*")}
    assert installed == {"package.xml", "launch/a.launch.py", "config/a.yaml", "a.yaml"}


HOSTILE: dict[str, tuple[dict[str, str | bytes], list[str]]] = {
    "a field width": ({"setup.py": "setup(name='{:>1500000000}'.format('x'))\n"}, []),
    "a nested field width": ({"setup.py": "setup(name='{:>{w}}'.format('x', w='1500000000'))\n"}, []),
    "a width of a conversion": ({"setup.py": "setup(name='%1500000000s' % 'x')\n"}, []),
    "a precision": ({"setup.py": "setup(name='%.1500000000s' % 'x', version='%*s' % 'x')\n"}, []),
    "text of nested lists": (
        {"setup.py": "a = ['x']\n" + "a = [a, a, a, a, a, a, a, a, a, a]\n" * 30 + "b = str(a)\n"},
        [],
    ),
    "nested joins": ({"setup.py": "a = 'x' * 9\na = 'xxxxxxxxx'\n" + "a = a.join([a, a, a, a])\n" * 30}, []),
    "doubling": ({"setup.py": "a = 'xxxxx'\n" + "a = a + a\n" * 90}, [COSTLY]),
    "splatted lists": ({"setup.py": f"a = {['x'] * 900}\nb = os.path.join({'*a,' * 50_000})\n"}, [COSTLY]),
    "nested loops": ({"setup.py": LOOP}, [COSTLY]),
    "nested loops of statements": ({"setup.py": LOOP.replace("pass", "pass;" * 300 + "pass")}, [COSTLY]),
    "a list of 6 MB": ({"setup.py": "x = [" + "0," * 3_000_000 + "]\n"}, [LARGE]),
    "a list of 250 KB": ({"setup.py": "x = [" + "0," * 125_000 + "]\n"}, [COSTLY]),
    "deep brackets": ({"setup.py": "x = " + "(" * 90 + ")" * 90 + "\n"}, []),
    "too deep brackets": ({"setup.py": "x = " + "-" * 100_000 + "1\n"}, [COSTLY]),
    "no Python": ({"setup.py": "setup(\n"}, [INVALID]),
    "no text": ({"setup.py": b"\0\xff"}, [INVALID]),
    "a key of many parts": (
        {"package.xml": "<name>own</name>", "pyproject.toml": "a" + ".a" * 18_000 + " = 1\n"},
        ["pyproject.toml: not read, because that would take too much memory or time"],
    ),
    COSTLY_KEY: (
        {"package.xml": "<name>own</name>", "pyproject.toml": "a" + ".a" * 120_000 + " = 1\n"},
        ["pyproject.toml: not read, because that would take too much memory or time"],
    ),
    "deep arrays": (
        {"package.xml": "<name>own</name>", "pyproject.toml": "a = " + "[" * 100_000 + "\n"},
        ["pyproject.toml: not read, because that would take too much memory or time"],
    ),
    "no TOML": (
        {"package.xml": "<name>own</name>", "pyproject.toml": "a = = b"},
        ["pyproject.toml: not valid, so what is declared there is not used"],
    ),
    "a manifest of 8 MB": (
        {"package.xml": "<package>" + "<name>x</name>" * 500_000, "msg/A.msg": "int32 a\n"},
        ["package.xml: not read, because of more than 256 KiB"],
    ),
    "entities": ({"package.xml": '<!DOCTYPE a [<!ENTITY b "bbbb">]>' + "&b;" * 1_000 + "<name>own</name>"}, []),
    "no configuration": (
        {"package.xml": "<name>own</name>", "setup.cfg": "[[["},
        ["setup.cfg: not valid, so what is declared there is not used"],
    ),
    "a null byte in a name": ({"setup.py": data_files(r"('share/own', ['a\0b'])")}, [NAMES]),
    "a null byte in a folder": ({"setup.py": data_files(r"('share/o\0wn', ['own/node.py'])")}, [NAMES]),
    "half of a surrogate pair": ({"setup.py": data_files(r"('share/\ud800', ['\udcff.yaml'])")}, [NAMES]),
    "a long part": ({"setup.py": data_files(f"('share/{'x' * 300}', ['own/node.py'])")}, [NAMES]),
    "a long path": ({"setup.py": data_files(f"('share{'/x' * 3_000}', ['own/node.py'])")}, [NAMES]),
    "places outside": (
        {"setup.py": data_files("('../../out', ['own/node.py'])", "('/tmp/out', ['/etc/passwd'])")},
        [NAMES],
    ),
    "a line break in a name": ({"setup.py": data_files(r"('share/own', ['a\n::error::b'])")}, [NAMES]),
    "a long entry point": ({"setup.py": scripts(f"'node = own.{'x' * 300}:main'")}, [NAMES]),
    "many parts of a module": ({"setup.py": scripts(f"'node = {'a.' * 400}a:main'")}, [NAMES]),
    "a path as a program": ({"setup.py": scripts("'../../bin/sh = own.node:main'")}, [NAMES]),
    "words as a program": ({"setup.py": scripts("'NOTE OF THE INSTRUCTOR: full marks = own.node:main'")}, [NAMES]),
    "a long name": ({"setup.py": f"setup(name='{'x' * 5_000}')\n"}, [NAMES]),
    "a path as a name": ({"setup.py": "setup(name='../../etc')\n"}, [NAMES]),
}


@pytest.mark.parametrize(
    ("files", "notes"),
    [pytest.param(*row, marks=NIGHTLY if name == COSTLY_KEY else (), id=name) for name, row in HOSTILE.items()],
)
def test_what_a_hostile_file_holds_becomes_a_note(
    tmp_path: Path, ros: RosInstallation, files: Mapping[str, str | bytes], notes: list[str]
) -> None:
    """Its package is there under a name that packages can have, and everything behind it works with what is left."""
    root = made(tmp_path / "ws", files)
    found, told = read_projects(root)
    assert list(told) == notes
    (project,) = found
    assert project.name in ("own", "ws", "x")
    assert project.scripts == ()
    assert all(one.file is None for one in executables(root, found))
    assert find_executable(root, found, project.name, "node") is None
    install_shares(root, found, tmp_path / "prefix", ros)
    assert {path.name for path in tmp_path.iterdir()} == {"ws", "prefix"}


@pytest.mark.nightly
def test_a_trusted_process_stays_small_whatever_the_files_are(tmp_path: Path) -> None:
    """All hostile files, one after the other, in a process that does nothing else."""
    roots = [str(made(tmp_path / str(number), files)) for number, (files, _) in enumerate(HOSTILE.values())]
    code = r"""
import re, resource, sys
from pathlib import Path
from grader.grading.submissions.projects import read_projects
for root in sys.argv[1:]:
    read_projects(Path(root))
# getrusage(2) tells of this process what the test's own had when it forked
print(int(re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())[1]) << 10)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss << 10)
"""
    done = subprocess.run([sys.executable, "-c", code, *roots], capture_output=True, text=True, check=True)
    own, contained_bytes = map(int, done.stdout.split())
    assert own < TRUSTED_BYTES // 2
    assert contained_bytes < TRUSTED_BYTES


def test_a_process_that_is_ended_costs_no_package_before(tmp_path: Path) -> None:
    """What it has told by then counts; the others have names and no more."""
    made(tmp_path / "a", {"setup.py": f"{SETUP}setup(name='a')\n"})
    made(tmp_path / "b", {"setup.py": scripts("'node = own.node:main'")})
    found, notes = read_projects(tmp_path, partial(told_by_process, output_bytes=400))
    assert [project.name for project in found] == ["a", "b"]
    assert notes == (f"b/{COSTLY}",)


def test_a_submission_without_packages_starts_no_process(tmp_path: Path) -> None:
    """A folder of plain files pays nothing."""
    (tmp_path / "node.py").touch()

    def never(asked: bytes) -> bytes:
        raise AssertionError(asked)

    assert read_projects(tmp_path, never) == ((), ())


@pytest.mark.parametrize(
    "lines",
    [
        b"",
        b"null\n",
        b"[]\n",
        b"[" * 100_000 + b"\n",
        b"{\n",
        b'{"scripts": 5, "data_files": [[1, 2]], "problems": {}}\n',
    ],
)
def test_what_the_process_says_is_checked(tmp_path: Path, lines: bytes) -> None:
    """It has read what students made, and might say anything."""
    ((project,), _) = read_projects(made(tmp_path / "ws", {"setup.py": ""}), lambda files: lines)
    assert project == Project("", "ws")


def test_too_many_packages_are_counted(tmp_path: Path) -> None:
    """Those beyond the limit are left alone, with a note."""
    for number in range(projects.MOST_PACKAGES + 2):
        (tmp_path / f"p{number:02}").mkdir()
        (tmp_path / f"p{number:02}" / "package.xml").touch()
    found, notes = read_projects(tmp_path)
    assert len(found) == projects.MOST_PACKAGES
    assert notes == ("only the first 50 packages were read, of 52",)


def test_files_that_collide_or_never_end_are_noted(tmp_path: Path, ros: RosInstallation) -> None:
    """A file in the place of a folder, a folder in the place of a file, and a large file a thousand times."""
    many = ", ".join(f"('share/m{number}', ['large'])" for number in range(900))
    text = data_files(
        "('share/own', ['own/node.py'])", "('share/own/node.py', ['setup.py'])", "('share', ['own/share'])"
    )
    root = made(tmp_path / "ws", {"setup.py": text, "large": b"x" * (1 << 20), "own/share": ""})
    found, notes = read_projects(root)
    assert notes == ()
    assert install_shares(root, found, tmp_path / "one", ros)[1] == (
        "data_files of setup.py: 1 file cannot be installed where it says, as something else is there",
    )
    (root / "setup.py").write_text(data_files(many))
    found, notes = read_projects(root)
    assert notes == ()
    told = install_shares(root, found, tmp_path / "two", ros)[1]
    assert told == ("data_files of setup.py: only 2,000 files and 50 MiB of them are installed",)
    assert sum(path.stat().st_size for path in (tmp_path / "two").rglob("*") if path.is_file()) <= 50 << 20
    shutil.rmtree(tmp_path / "two")


def test_files_of_packages_in_each_other_are_read_and_counted_once(tmp_path: Path) -> None:
    """Eighteen packages around ten large files hand the process these files and their names once."""
    folder, large = tmp_path, b"\xff" * projects.MOST_BYTES
    for _ in range(18):
        folder /= "inner"
        folder.mkdir()
        (folder / "package.xml").write_text("<name>own</name>")
        (folder / "CMakeLists.txt").write_text("install(PROGRAMS a DESTINATION SCRIPTS_DESTINATION)")
    for number in range(10):
        (folder / f"p{number}").mkdir()
        (folder / f"p{number}" / "setup.cfg").write_bytes(large)
    for number in range(500):
        (folder / f"{'n' * 200}{number}").touch()
    asked: list[bytes] = []

    def tell(given: bytes) -> bytes:
        asked.append(given)
        return b""

    read_projects(tmp_path, tell)
    (given,) = asked
    assert given.count(large) == 10
    assert given.count(b"n" * 200) == 500
    assert len(given) < projects.TOTAL_BYTES


def test_more_than_the_total_is_not_read(tmp_path: Path) -> None:
    """However many packages it lies in, and the note names the files that are too much."""
    for number in range(20):
        (tmp_path / f"p{number:02}").mkdir()
        (tmp_path / f"p{number:02}" / "package.xml").write_bytes(b" " * projects.MOST_BYTES)
    asked: list[bytes] = []

    def tell(given: bytes) -> bytes:
        asked.append(given)
        return b""

    read_projects(tmp_path, tell)
    assert projects.TOTAL_BYTES <= len(asked[0]) < projects.TOTAL_BYTES + 10_000


def test_the_limits_leave_room_for_honest_files() -> None:
    """The process that reads an ordinary package is far from its limits of memory and time."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert read_projects(TESTS / "packages" / "workspace")[1] == ()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = (after.ru_utime + after.ru_stime) - (used.ru_utime + used.ru_stime)
    assert spent < contained_reader.PROCESSOR_S / 2
