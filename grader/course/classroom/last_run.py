"""The options that a class was last graded with, in `class.yaml` of its results folder: the next run takes them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path

from grader.grading.rubrics.mistakes import YamlSyntaxError, read_yaml
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError

#: The file in the results folder.
RUN = "class.yaml"
#: Larger files are not read, in bytes: options of a class take a few hundred.
_MOST_BYTES = 1 << 20
_HEAD = (
    "# How this class is graded. An option that is not given is taken from here: to leave one out, delete its line.\n"
)
#: The key of the folders and downloads, beside the options.
_SOURCES = "sources"


@dataclass(frozen=True, slots=True)
class LastRun:
    """How a class was last graded."""

    # Name of an option without dashes -> its values as they were typed, paths absolute; none for an option without one
    options: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    sources: tuple[str, ...] = ()  # absolute paths of the folders and downloads that were graded


def read_last_run(results: Path) -> LastRun:
    """Read how a class was last graded; empty if it never was. Raises ClassError if the file cannot be used."""
    path = results / RUN
    try:
        with path.open("rb") as file:
            content = file.read(_MOST_BYTES + 1)
        text = content.decode()
    except (FileNotFoundError, NotADirectoryError):
        return LastRun()
    except (OSError, UnicodeDecodeError) as error:
        raise _unusable(path, str(error)) from None
    if len(content) > _MOST_BYTES:
        raise _unusable(path, f"more than {_MOST_BYTES} bytes")
    try:
        data = read_yaml(text).data
    except YamlSyntaxError as error:
        raise _unusable(path, str(error)) from None
    if not isinstance(data, Mapping):
        raise _unusable(path, "none" if data is None else "something else")
    found = {str(name): _texts(path, str(name), value) for name, value in data.items() if value is not False}
    sources = found.pop(_SOURCES, ())
    return LastRun(found, sources)


def dump_last_run(last: LastRun) -> bytes:
    """Encode how a class was graded as YAML, one line an option."""
    lines = [f"{name}: {_written(values)}\n" for name, values in last.options.items()]
    return "".join([_HEAD, *lines, f"{_SOURCES}: [{', '.join(map(_quoted, last.sources))}]\n"]).encode()


def _texts(path: Path, name: str, value: object) -> tuple[str, ...]:
    """Return the values of an option as texts; none for one without a value."""
    if value is True:
        return ()
    values = value if isinstance(value, list) else [value]
    if not all(isinstance(each, (str, int, float)) for each in values):
        raise _unusable(path, f"`{name}` with something else than a text, a number, or a list of these")
    return tuple(map(str, values))


def _written(values: tuple[str, ...]) -> str:
    if not values:
        return "true"
    return _quoted(values[0]) if len(values) == 1 else f"[{', '.join(map(_quoted, values))}]"


def _quoted(text: str) -> str:
    """Return a text in quotes, as JSON and YAML have it; a path need not be valid text or printable."""
    escaped = (c if c.isprintable() else f"\\u{ord(c):04x}" for c in json.dumps(text, ensure_ascii=False))
    return "".join(escaped)


def _unusable(path: Path, found: str) -> ClassError:
    hint = (
        "correct it, or delete it and give all options again: --adjust, --roster, --rubric, --exercise and the others"
    )
    return ClassError(f"{path}: expected the options of this class, one a line, found {found}", hint)
