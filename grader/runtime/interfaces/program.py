"""Builds the packages of a submission in a process of its own, which the caller confines.

Usage: python -m grader.runtime.interfaces.program < JSON, with an object of `submission`, the staged folder; `into`,
the folder
to write to; `others`, packages that the submission's may refer to; `taken`, names that a submission cannot bring; and
`share`, the share folders of ROS. Prints an object of `packages`, name -> digest; `folder`, the name of the folder in
`into` with their modules; and `problems`, sentences about what could not be built.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from grader.runtime.interfaces.build import build
from grader.runtime.interfaces.definitions import (
    DefinitionError,
    DefinitionFile,
    InterfacePackage,
    digest,
    find_packages,
)
from grader.runtime.model.errors import GraderError
from grader.runtime.model.wording import printable

#: Characters of an exception that a note shows.
_CAUSE = 200
_PLAIN = InterfacePackage("plain_msgs", (DefinitionFile("msg", "Plain", "int32 value\n"),))


def main() -> None:
    """Build what the request on standard input asks for, and print the answer."""
    request = json.load(sys.stdin)
    others = [
        InterfacePackage(name, tuple(DefinitionFile(*d) for d in definitions))
        for name, definitions in request["others"]
    ]
    try:
        answer = answer_to(Path(request["submission"]), Path(request["into"]), others, request)
    except DefinitionError as error:
        answer = _failed(f"{error.message}; {error.hint}")
    except MemoryError:
        raise
    except Exception as error:
        # Names and values that ROS's generators or the file system do not take: no list of them can be complete.
        if not _builds_others(Path(request["into"]), request):
            raise
        cause = printable(f"{type(error).__name__}: {error}", _CAUSE)
        answer = _failed(f"the interface definitions of the submission are not used: building them ended with {cause}")
    sys.stdout.write(json.dumps(answer))


def _failed(problem: str) -> dict[str, Any]:
    return {"packages": {}, "folder": "", "problems": [problem]}


def _builds_others(into: Path, request: Mapping[str, list[str]]) -> bool:
    """Whether a plain package can be built here, so that what failed are the definitions and not the machine."""
    try:
        with tempfile.TemporaryDirectory(dir=into) as cache:
            build([_PLAIN], Path(cache), [*map(Path, request["share"])])
    except (GraderError, OSError):
        return False
    return True


def answer_to(
    submission: Path, into: Path, others: list[InterfacePackage], request: Mapping[str, list[str]]
) -> dict[str, Any]:
    """Build the packages in a folder together with the others; raises DefinitionError."""
    found, taken = find_packages(submission), request["taken"]
    own = [package for package in found if package.name not in taken]
    kept = [package.name for package in found if package.name in taken]
    problems = [
        f"{name}: the definitions in the submission are not used, because there is such a package" for name in kept
    ]
    if not own:
        return {"packages": {}, "folder": "", "problems": problems}
    folder = build(needed(own, others), into, [*map(Path, request["share"])]).prefix
    return {"packages": {p.name: f"sha256:{digest([p])}" for p in own}, "folder": folder.name, "problems": problems}


def needed(packages: Iterable[InterfacePackage], others: Collection[InterfacePackage]) -> list[InterfacePackage]:
    """Return packages with those of the others that they refer to, directly or not."""
    found = list(packages)
    for package in found:  # which grows meanwhile
        text = "".join(definition.text for definition in package.definitions)
        found += [other for other in others if f"{other.name}/" in text and other not in found]
    return found


if __name__ == "__main__":
    main()
