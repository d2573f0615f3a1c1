"""What was probably meant by a command line that cannot be used, as hints for people at a terminal."""

from __future__ import annotations

import difflib
import os
import re
from collections.abc import Collection, Sequence
from pathlib import Path

import click

from grader.grading.reporting.formats import FORMATS

#: How alike a name must be to one that exists, and how many entries of a folder are compared with it.
_ALIKE, _MOST_ENTRIES = 0.75, 500
#: Words for commands that are options.
_WORDS = {"help": "grade --help", "version": "grade --version", "watch": "grade --watch", "all": "grade --all"}
#: Suffixes of reports -> format; of several formats with one suffix, people mean the first.
_BY_SUFFIX = {".htm": "html", **{FORMATS[name].suffix: name for name in reversed(FORMATS)}}
#: Files of formats that nobody grades, and that are often given.
_NO_REPORT = ".pdf"


def meant_submission(submission: str, commands: Collection[str]) -> str:
    """Return a hint for a submission that does not exist: a file, an exercise or a command of nearly this name.

    Empty if the path exists or nothing is like it.
    """
    if os.path.lexists(submission) or not submission:
        return ""
    return _path(submission) or _exercise(submission) or _command(submission, commands)


def _path(submission: str) -> str:
    """Return a hint about a file or folder of nearly this name in the same folder."""
    place = Path(submission)
    if place.suffix != ".py" and Path(f"{submission}.py").is_file():
        return f"did you mean {submission}.py"
    try:
        entries = [entry.name for entry in sorted(place.parent.iterdir())[:_MOST_ENTRIES] if _gradable(entry)]
    except (OSError, ValueError):
        return ""
    folded = {name.casefold(): name for name in entries}
    near = difflib.get_close_matches(place.name.casefold(), folded, n=1, cutoff=_ALIKE)
    return f"did you mean {place.with_name(folded[near[0]])}" if near else ""


def _gradable(entry: Path) -> bool:
    return not entry.name.startswith(".") and (entry.suffix in ("", ".py", ".ipynb", ".zip") or entry.is_dir())


def _exercise(name: str) -> str:
    """Return a hint about the option for an exercise: `grade 1`, `grade project 2`, `grade exercise_1`."""
    from grader.grading.rubrics.builtin import builtin_exercises, exercise_ids
    from grader.runtime.model.errors import RubricError

    spaced = re.sub(r"[\s_-]+", " ", name).strip()
    for written in (name.removeprefix("exercise "), spaced.casefold().removeprefix("exercise ")):
        try:
            exercise_ids((written,), builtin_exercises())
        except RubricError:
            continue
        quoted = f'"{written}"' if " " in written else written
        return f"did you mean --exercise {quoted}"
    return ""


def _command(name: str, commands: Collection[str]) -> str:
    if name.casefold() in _WORDS:
        return f"did you mean {_WORDS[name.casefold()]}"
    plain = "" if os.sep in name or name in commands else name.casefold()  # a folder of that name may be meant
    near = difflib.get_close_matches(plain, sorted(commands), n=1, cutoff=_ALIKE)
    return f"did you mean grade {near[0]}" if near else ""


def too_many(first: str, others: Sequence[str]) -> click.UsageError:
    """Return the error for more than one submission, with what was probably meant as its second line."""
    given = " ".join((first, *others))
    if all(Path(name).suffix == ".py" for name in (first, *others)):
        hint = "name the folder that holds the files"
    else:
        hint = _exercise(given) or (_exercise(" ".join(others)) if os.path.lexists(first) else "")
    return Misused(f"expected one submission, found {len(others) + 1}: {given}", hint)


class Misused(click.UsageError):
    """A command line that cannot be used, with a hint of its own.

    Attributes:
        hint: One thing to do; empty for the usual reference to the help.
    """

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


def usage_hint(error: click.ClickException) -> str:
    """Return a hint for a mistake on the command line; empty if nothing is known but what the help says."""
    if isinstance(error, Misused):
        return error.hint
    if isinstance(error, click.NoSuchOption):
        name = error.option_name.lstrip("-").casefold()
        format_ = next((known for known in FORMATS if name in (known, f"output-{known}")), "")
        if format_:
            return f"did you mean -o {format_}=report{FORMATS[format_].suffix}"
        if name in ("report", "out", "output-file"):
            return "did you mean -o html=report.html"
    return ""


def output_meant(value: str) -> str:
    """Return the `FORMAT=PATH` that was probably meant by another value of `-o`; empty if unknown."""
    plain = value.lstrip("=")
    format_, colon, path = plain.partition(":")
    if colon and format_ in FORMATS and path:
        return f"{format_}={path}"
    if "=" in plain:
        return plain if plain != value else ""
    if plain in FORMATS:
        return f"{plain}=report{FORMATS[plain].suffix}"
    by_suffix = _BY_SUFFIX.get(Path(plain).suffix.casefold(), "")
    if by_suffix:
        return f"{by_suffix}={plain}"
    if Path(plain).suffix.casefold() == _NO_REPORT:
        return f"html={Path(plain).with_suffix('.html')}"
    return ""
