"""The options that decide how a submission is graded, one row each: what is made of them follows from these rows.

The options of `grade`, `grade batch`, `grade verify` and `grade observe` (`grader/cli/run_options.py`), the line that
reproduces a report, the request in evidence, the key of a result in a class, what is sent to another machine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import Field, field, fields, replace
from enum import Enum, auto
from pathlib import Path
from typing import Any, TypeVar

from grader.runtime.model.checkup import TIERS
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.limits import TIME_BUDGET_S

#: The commands that take options of a run.
GRADE, BATCH, VERIFY, OBSERVE = "grade", "batch", "verify", "observe"
#: Environment variable that chooses the sandbox of a machine, such as a container that can have one only.
ISOLATION = "GRADER_ISOLATION"
#: The values of `--clock`, and of `--isolation`.
CLOCKS, SANDBOXES = ("virtual", "wall", "auto"), ("auto", *TIERS)
_AS_IN_GRADE = "As in `grade`."


class OptionKind(Enum):
    """What an option is given, and how it is written."""

    TEXT = auto()
    EXERCISE = auto()  # id, number or file
    FLAG = auto()
    COUNT = auto()
    SECONDS = auto()
    SHARE = auto()  # in percent; from 0 to 1 in the record
    CHOICE = auto()
    PATH = auto()
    RUBRIC = auto()  # a path: a file, or the folder that stands for it
    BAG = auto()  # a topic or message type, and a path


class Keyed(Enum):
    """How the key of a result in a class depends on an option."""

    NO = auto()  # not at all, or by the digest of what it names
    RESULT = auto()  # by its value
    RECORDING = auto()  # by its value, and so do the recordings


@dataclass(frozen=True, slots=True)
class Option:
    """How an option is written, and what depends on it."""

    flag: str
    help: str
    kind: OptionKind = OptionKind.TEXT
    metavar: str = ""
    choices: tuple[str, ...] = ()
    # Each command that has it -> its help there; empty for the usual one
    commands: Mapping[str, str] = field(default_factory=lambda: {GRADE: "", BATCH: ""})
    defaults: Mapping[str, object] = field(default_factory=dict)  # command -> its default there, if it is another one
    environment: str = ""  # variable that gives it a value, where it is not given
    reads_environment: tuple[str, ...] = ()  # the commands that read the variable
    shows_default: bool = False
    kept: bool = False  # whether the request in evidence holds it
    keyed: Keyed = Keyed.NO


def _row(default: Any, flag: str, help: str, **row: Any) -> Any:  # noqa: A002  as everywhere on the command line
    return field(default=default, metadata={"option": Option(flag, help, **row)})


@dataclass(frozen=True, slots=True, kw_only=True)
class GradingOptions:
    """What a submission is graded by, in the order of the line that reproduces a report."""

    # Empty for all exercises of the rubrics, except built-in ones that are only graded by request
    exercises: tuple[str, ...] = _row(
        (),
        "--exercise",
        "Grade only this exercise, named by its id, number or file; repeatable.",
        kind=OptionKind.EXERCISE,
        metavar="ID",
        commands={
            GRADE: "",
            BATCH: "Grade only this exercise; repeatable.",
            VERIFY: "Record only this exercise; repeatable. By default each for which there is a file.",
        },
        kept=True,
    )
    every: bool = _row(
        False,  # noqa: FBT003
        "--all",
        "Grade every exercise and project for which there is a file.",
        kind=OptionKind.FLAG,
        commands={GRADE: "", BATCH: "Grade every exercise and project for which a student has a file."},
        keyed=Keyed.RESULT,
    )
    rubrics: tuple[Path, ...] = _row(  # empty for the built-in ones
        (),
        "--rubric",
        "Use this rubric; repeatable.",
        kind=OptionKind.RUBRIC,
        commands={GRADE: "", BATCH: "", VERIFY: ""},
    )
    seed: int | None = _row(  # of all drawn values; None derives it from the submission and a seed key
        None,
        "--seed",
        "Draw values from N, as a report names it.",
        kind=OptionKind.COUNT,
        metavar="N",
        commands={GRADE: "", BATCH: "Draw everybody's values from N.", VERIFY: ""},
        keyed=Keyed.RECORDING,
    )
    student: str = _row(  # whose variant is graded; empty if nothing varies
        "",
        "--student",
        "Grade with the variant of this student; see --variant-key.",
        metavar="ID",
        commands={GRADE: "", VERIFY: "Use the variant of this student; see --variant-key."},
        kept=True,
    )
    variant_key: Path | None = _row(  # file with the variant key, as the user typed it
        None,
        "--variant-key",
        "The variant key that rubrics draw variants from.",
        kind=OptionKind.PATH,
        metavar="FILE",
        commands={GRADE: "", BATCH: "The variant key; the roster says which variant each student has.", VERIFY: ""},
        kept=True,
    )
    # Recordings to play instead of those of the rubrics: `(name, path)`, where the name is a topic or a message type
    bags: tuple[tuple[str, Path], ...] = _row(
        (),
        "--recording",
        "Play this recording on a topic, or on all topics of a message type, instead of the rubric's; repeatable.",
        kind=OptionKind.BAG,
        metavar="TOPIC=BAG",
        commands={GRADE: "", BATCH: "", VERIFY: "", OBSERVE: ""},
        kept=True,
    )
    interfaces: tuple[Path, ...] = _row(
        (),
        "--interfaces",
        "Build the interface packages (msg, srv, action) in this folder for the nodes; repeatable.",
        kind=OptionKind.PATH,
        metavar="FOLDER",
        commands={GRADE: "", BATCH: "", VERIFY: "", OBSERVE: ""},
        kept=True,
    )
    clock: str = _row(
        "auto",
        "--clock",
        "The clock of the student's nodes; auto: virtual, or wall where virtual time does not work.",
        kind=OptionKind.CHOICE,
        choices=CLOCKS,
        commands={GRADE: "", BATCH: _AS_IN_GRADE, OBSERVE: _AS_IN_GRADE},
        kept=True,
        keyed=Keyed.RECORDING,
    )
    isolation: str = _row(  # `auto`, `none` or the name of a tier
        "auto",
        "--isolation",
        "auto: the strongest sandbox that holds here; none: run the student's code without one.",
        kind=OptionKind.CHOICE,
        choices=SANDBOXES,
        commands={
            GRADE: "",
            BATCH: f"As in `grade`, but {ISOLATION} is not read.",
            VERIFY: "",
            OBSERVE: _AS_IN_GRADE,
        },
        environment=ISOLATION,
        reads_environment=(GRADE, VERIFY, OBSERVE),  # what a class is graded in is said in the command
        kept=True,
        keyed=Keyed.RECORDING,
    )
    time_budget_s: float = _row(  # real time that all recordings of one submission together may take
        TIME_BUDGET_S,
        "--time-budget",
        "Limit of real time for all recordings of one submission; criteria left by then are not met.",
        kind=OptionKind.SECONDS,
        metavar="SECONDS",
        shows_default=True,
        keyed=Keyed.RECORDING,
    )
    spot_checks: float = _row(  # share of submissions, from 0 to 1, that are also recorded on the wall clock
        0.0,
        "--spot-checks",
        "Share of submissions to check on the wall clock too, drawn at random.",
        kind=OptionKind.SHARE,
        metavar="P%",
        commands={
            GRADE: "",
            BATCH: "Share of the class to check on the wall clock too, drawn at random; 5% is faster.",
        },
        defaults={BATCH: 1.0},
        shows_default=True,
    )


_Options = TypeVar("_Options", bound=GradingOptions)


def rows(options: GradingOptions | type[GradingOptions] = GradingOptions) -> Iterator[tuple[str, Option, Field[Any]]]:
    """Yield name, row and field of each option."""
    for each in fields(options):
        if "option" in each.metadata:
            yield each.name, each.metadata["option"], each


def values(options: GradingOptions) -> dict[str, Any]:
    """Return the value of each option, by its name; those of a request for one submission without the rest of it."""
    return {name: getattr(options, name) for name, _, _ in rows(options)}


def option_words(options: GradingOptions) -> Iterator[str]:
    """Yield the words of all options that have another value than the default."""
    for name, row, each in rows(options):
        value = getattr(options, name)
        if value != each.default:
            for one in value if isinstance(value, tuple) else (value,):
                yield from _written(row, one)


def _written(row: Option, value: Any) -> tuple[str, ...]:
    if row.kind is OptionKind.FLAG:
        return (row.flag,)
    if row.kind is OptionKind.SHARE:
        return row.flag, percent(value)
    if row.kind is OptionKind.SECONDS:
        return row.flag, f"{value:g}"
    if row.kind is OptionKind.BAG:
        name, path = value
        return row.flag, f"{name}={path}"
    return row.flag, str(value)


def percent(share: float) -> str:
    """Return a share from 0 to 1 in percent, as short as possible."""
    return f"{share:.6%}".rstrip("%").rstrip("0").rstrip(".") + "%"


#: What all requests in evidence hold, in their order; other options follow, where they are not as usual.
_IN_EVIDENCE = ("exercises", "bags", "clock", "isolation", "student", "variant_key")


def options_to_json(options: GradingOptions) -> dict[str, Any]:
    """Convert the options that evidence keeps to JSON."""
    kept = [(name, row, each) for name, row, each in rows(options) if row.kept]
    kept.sort(key=lambda row: (*_IN_EVIDENCE, row[0]).index(row[0]))
    found: dict[str, Any] = {}
    for name, row, each in kept:
        value = getattr(options, name)
        if row.kind is OptionKind.BAG:
            found["recordings"] = {key: str(path) for key, path in value}
        elif name in _IN_EVIDENCE or value != each.default:
            found[name] = _plain(value)
    return found


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return list(map(_plain, value))
    return str(value) if isinstance(value, Path) else value


def options_of_json(data: Mapping[str, Any], options: _Options) -> _Options:
    """Return the options with what evidence has kept of them; its values are those of some file, and converted."""
    given: dict[str, Any] = {}
    for name, row, each in rows(options):
        if row.kind is OptionKind.BAG:
            given[name] = tuple((str(key), Path(str(path))) for key, path in data.get("recordings", {}).items())
        elif row.kept and data.get(name) is not None:
            convert = _converter(row, each.default)
            value = data[name]
            given[name] = tuple(map(convert, value)) if isinstance(each.default, tuple) else convert(value)
    return replace(options, **given)


def _converter(row: Option, default: object) -> Callable[[Any], Any]:
    if row.kind in (OptionKind.PATH, OptionKind.RUBRIC):
        return lambda value: Path(str(value))
    if row.kind in (OptionKind.SECONDS, OptionKind.SHARE):
        return float
    return {OptionKind.COUNT: int, OptionKind.FLAG: bool}.get(
        row.kind, type(default) if isinstance(default, str) else str
    )


def key_values(options: GradingOptions, *, recordings: bool = False) -> dict[str, object]:
    """Return the options whose values are part of the key of a result, or of that of its recordings."""
    of = (Keyed.RECORDING,) if recordings else (Keyed.RECORDING, Keyed.RESULT)
    return {name: getattr(options, name) for name, row, _ in rows(options) if row.keyed in of}


def with_paths(options: _Options, changed: Callable[[Path], Path]) -> _Options:
    """Return the options with each path changed."""
    given: dict[str, Any] = {}
    for name, row, _ in rows(options):
        value = getattr(options, name)
        if row.kind is OptionKind.BAG:
            given[name] = tuple((key, changed(path)) for key, path in value)
        elif row.kind in (OptionKind.PATH, OptionKind.RUBRIC):
            given[name] = tuple(map(changed, value)) if isinstance(value, tuple) else value and changed(value)
    return replace(options, **given)


def paths(options: GradingOptions) -> list[Path]:
    """Return all paths of the options."""
    found: list[Path] = []

    def noted(path: Path) -> Path:
        found.append(path)
        return path

    with_paths(options, noted)
    return found


def option_names(command: str, record: type[GradingOptions] = GradingOptions) -> Sequence[str]:
    """Return the names of the options that a command has."""
    return [name for name, row, _ in rows(record) if command in row.commands]
