"""What a bundle is made of: the installed package as a wheel, the versions it runs with, and the platforms' scripts."""

from __future__ import annotations

import base64
import hashlib
import importlib
import importlib.metadata
import io
import re
import sys
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import grader
from grader.model.errors import EnvironmentFault
from grader.reading.shipped import shipped

PACKAGE = "rclpy-grader"
#: A zip knows no time before this; the same files give the same bytes.
_LONG_AGO = (1980, 1, 1, 0, 0, 0)
_PROGRAM, _FILE, _PRIVATE = 0o100755, 0o100644, 0o100600
#: What every environment has of its own, for its own Python.
_WITH_PYTHON = ("pip", "setuptools", "wheel")
_NOT_PACKED = ("__pycache__", "shipped")


def integration(name: str) -> bytes:
    """Return one of the files that platforms run, such as `gradescope/setup.sh`."""
    return (shipped("integrations") / name).read_bytes()


def wheel() -> tuple[str, bytes]:
    """Return the name and the bytes of a wheel of the package that is running.

    Raises:
        EnvironmentFault: The package is not installed, only importable, or needs more than when it was installed.
    """
    try:
        installed = importlib.metadata.distribution(PACKAGE)
    except importlib.metadata.PackageNotFoundError:
        text = f"{PACKAGE}: expected an installed package, found only its code"
        raise EnvironmentFault(text, "python3 -m pip install . in the checkout of the grader") from None
    _refuse_stale(installed)
    stem = f"{PACKAGE.replace('-', '_')}-{installed.version}"
    files = _code()
    for name in ("METADATA", "entry_points.txt"):
        files[f"{stem}.dist-info/{name}"] = (installed.read_text(name) or "").encode()
    files[f"{stem}.dist-info/WHEEL"] = (
        b"Wheel-Version: 1.0\nGenerator: grade\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    )
    record = f"{stem}.dist-info/RECORD"
    files[record] = "".join([*map(_recorded, files, files.values()), f"{record},,\n"]).encode()
    return f"{stem}-py3-none-any.whl", zipped(files)


def pins() -> str:
    """Return the versions of all that the package needs, as they are installed here, as constraints for pip.

    They hold for this Python and later ones: of an older one it is not known whether it can have them.
    """
    found: dict[str, str] = {}
    done: set[tuple[str, tuple[str, ...]]] = set()
    waiting: list[tuple[str, tuple[str, ...]]] = [(PACKAGE, ())]
    while waiting:
        name, extras = waiting.pop()
        try:
            distribution = importlib.metadata.distribution(name)
        except importlib.metadata.PackageNotFoundError:
            continue  # for another system
        if (name, extras) not in done:
            done.add((name, extras))
            found[_normal(name)] = distribution.version
            waiting += _needed(distribution.requires or [], extras)
    for name in (PACKAGE, *_WITH_PYTHON):
        found.pop(name, None)
    since = f'python_version >= "{sys.version_info.major}.{sys.version_info.minor}"'
    return "".join(f"{name}=={version} ; {since}\n" for name, version in sorted(found.items()))


def zipped(files: Mapping[str, bytes], programs: tuple[str, ...] = (), private: tuple[str, ...] = ()) -> bytes:
    """Return a zip of files by name, in that order; programs can be run, private files read by their owner."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            info = zipfile.ZipInfo(name, _LONG_AGO)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = (_PROGRAM if name in programs else _PRIVATE if name in private else _FILE) << 16
            archive.writestr(info, content)
    return stream.getvalue()


def _refuse_stale(installed: importlib.metadata.Distribution) -> None:
    """Refuse a checkout that was installed before it came to need what it needs now."""
    if sys.version_info < (3, 11):
        return
    tomllib = importlib.import_module("tomllib")  # Python 3.10 has none
    project = Path(grader.__file__).resolve().parent.parent / "pyproject.toml"
    if not project.is_file():
        return

    wanted = tomllib.loads(project.read_text(encoding="utf-8"))["project"]["dependencies"]
    have = {_normal(name) for name, _ in _needed(installed.requires or [], ())}
    new = sorted({_normal(name) for name, _ in _needed(wanted, ())} - have)
    if new:
        text = f"{PACKAGE}: expected an installation that knows its requirements, found none of {', '.join(new)}"
        raise EnvironmentFault(text, "python3 -m pip install -e . in the checkout of the grader")


def _code() -> dict[str, bytes]:
    package = Path(grader.__file__).resolve().parent
    files = {f"grader/{name}": content for name, content in _below(package, but=_NOT_PACKED).items()}
    for folder in ("rubrics", "integrations"):
        for name, content in _below(shipped(folder)).items():
            files[f"grader/shipped/{folder}/{name}"] = content
    return files


def _below(folder: Path, but: tuple[str, ...] = ("__pycache__",)) -> dict[str, bytes]:
    paths = (path for path in sorted(folder.rglob("*")) if path.is_file())
    relative = ((path, path.relative_to(folder)) for path in paths)
    return {
        name.as_posix(): path.read_bytes()
        for path, name in relative
        if name.parts[0] not in but and "__pycache__" not in name.parts
    }


def _recorded(name: str, content: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(content)}\n"


def _needed(requirements: Iterable[str], extras: tuple[str, ...]) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the name and the extras of each requirement that holds for some extras of the one that requires it."""
    for requirement in requirements:
        of_extra = re.search(r"extra *== *['\"]([^'\"]+)", requirement)
        if of_extra is None or of_extra[1] in extras:
            match = re.match(r"([A-Za-z0-9._-]+) *(?:\[([^]]*)\])?", requirement)
            assert match is not None, requirement
            yield match[1], tuple(extra.strip() for extra in (match[2] or "").split(",") if extra)


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
