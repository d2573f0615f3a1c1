"""Byte code that an interpreter would not load is found, whatever the way in which it is stale."""

import importlib.util
import os
import py_compile
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from grader.runtime.compiled import state_of_package
from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.ros_installation import find_ros
from grader.runtime.sandbox.environment import PACKAGE
from grader.runtime.supervisor.byte_code import _roots, byte_code, compile_command, compile_own, is_current

MODE = py_compile.PycInvalidationMode


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "package" / "module.py"
    path.parent.mkdir()
    path.write_text("x = 1\n", encoding="utf-8")
    return path


def compiled(source: Path, mode: py_compile.PycInvalidationMode = MODE.TIMESTAMP) -> Path:
    place = py_compile.compile(str(source), doraise=True, invalidation_mode=mode)
    assert place is not None
    return Path(place)


def loads(source: Path, place: Path) -> bool:
    """Ask the interpreter itself: whether it loads byte code that says something else than the source."""
    header, code = place.read_bytes()[:16], place.read_bytes()[16:]
    place.write_bytes(header + code.replace(b"x", b"y"))
    script = "import sys; sys.path.insert(0, sys.argv[1]); import module; print(hasattr(module, 'y'))"
    done = subprocess.run(
        [sys.executable, "-I", "-B", "-c", script, source.parent], capture_output=True, text=True, check=True
    )
    place.write_bytes(header + code)
    return done.stdout.strip() == "True"


def other_time(source: Path, place: Path) -> None:
    os.utime(source, (1, 1))


def other_size(source: Path, place: Path) -> None:
    stamp = source.stat()
    source.write_text("x = 1  \n", encoding="utf-8")
    os.utime(source, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))


def other_content(source: Path, place: Path) -> None:
    stamp = source.stat()
    source.write_text("x = 2\n", encoding="utf-8")
    os.utime(source, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))


def other_python(source: Path, place: Path) -> None:
    place.write_bytes(b"\x00\x00\r\n" + place.read_bytes()[4:])


def nothing(source: Path, place: Path) -> None:
    pass


@pytest.mark.parametrize("change", [nothing, other_time, other_size, other_content, other_python])
@pytest.mark.parametrize("mode", list(MODE), ids=lambda mode: mode.name)
def test_what_the_interpreter_loads_is_current(
    source: Path, mode: py_compile.PycInvalidationMode, change: Callable[[Path, Path], None]
) -> None:
    """For each kind of byte code and each change the answer is that of the interpreter."""
    place = compiled(source, mode)
    change(source, place)
    assert is_current(source, place) == loads(source, place)


def test_a_missing_or_cut_file_is_not_current(source: Path) -> None:
    """Both are compiled again at each start."""
    place = Path(importlib.util.cache_from_source(str(source)))
    assert not is_current(source, place)
    compiled(source)
    assert is_current(source, place)
    place.write_bytes(place.read_bytes()[:10])
    assert not is_current(source, place)


@pytest.mark.parametrize("change", [other_time, other_size, other_python])
def test_the_command_that_is_named_mends_it(source: Path, change: Callable[[Path, Path], None]) -> None:
    """Whichever way it is stale."""
    place = compiled(source)
    change(source, place)
    assert not is_current(source, place)
    subprocess.run(compile_command(Path(sys.executable), _roots([source])), shell=True, check=True)
    assert is_current(source, place)


@pytest.mark.ros
def test_a_stale_installation_is_told_with_the_command_that_mends_it(
    tmp_path: Path,
) -> None:
    """Of what nodes load, nothing is stale in the environment of the tests; with one file that is, it is named."""
    try:
        ros = find_ros()
    except EnvironmentFault as fault:
        pytest.skip(fault.message)
    assert byte_code(ros.runtime).value == "up to date", "in the environment that .ci/setup made"
    # A copy of the package, which nodes load instead: other processes compile this one whenever they like.
    copy = tmp_path / PACKAGE.name
    shutil.copytree(PACKAGE, copy)
    Path(importlib.util.cache_from_source(str(copy / "runtime" / "host" / "launcher.py"))).write_bytes(b"")
    fact = byte_code(replace(ros.runtime, python_paths=(tmp_path, *ros.runtime.python_paths)))
    assert fact.fits
    assert fact.value.startswith("missing or stale for 1 file:")
    assert fact.remedy.endswith(f"-m compileall -q -f {tmp_path}")


def test_own_modules_are_compiled_once_for_each_state(source: Path) -> None:
    """A start looks at the byte code of the package only if a module has changed since it was last compiled."""
    place = Path(importlib.util.cache_from_source(str(source)))
    compile_own(source.parent)
    assert is_current(source, place)
    place.unlink()
    compile_own(source.parent)
    assert not place.exists()
    source.write_text("x = 1000\n", encoding="utf-8")
    state_of_package.cache_clear()  # as in the next process
    compile_own(source.parent)
    assert is_current(source, place)
