"""Reads an author's notes on the self-test of a rubric: folders, baseline, and why mutants survive."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from fnmatch import fnmatchcase
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from grader.grading.model.exercise import Exercise
from grader.grading.rubrics.mistakes import (
    Mistake,
    TreePath,
    YamlSyntaxError,
    YamlTree,
    mistakes_of,
    nearest_hint,
    read_yaml,
    refused_file,
)
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import RubricError
from grader.runtime.model.wording import listed, printable

SCHEMA = "grader/selftest-notes/v1"
MAX_BYTES = 256 * 1024
_Text = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=500)]
_Line = Annotated[_Text, AfterValidator(lambda text: " ".join(text.split()))]


@dataclass(frozen=True, slots=True)
class Explanation:
    """An author's note on some mutants or variants."""

    pattern: str
    because: str = ""  # the explanation; empty if it is still to be filled in, or the note names criteria
    criteria: tuple[str, ...] = ()  # criteria that should detect such a mutant; empty if the note has an explanation
    where: str = ""  # position in the file, for messages

    def fits(self, id_: str) -> bool:
        """Whether the pattern matches a mutant or variant."""
        return fnmatchcase(id_, self.pattern)


@dataclass(frozen=True, slots=True)
class Explained:
    """All notes of an author; `criteria` tells for a criterion's id why it detects no mutant, empty if not yet."""

    reference: Path | None = None
    template: Path | None = None
    template_score: Fraction | None = None
    survivors: Sequence[Explanation] = ()
    expected: Sequence[Explanation] = ()
    variants: Sequence[Explanation] = ()
    criteria: Mapping[str, str] = field(default_factory=dict)


class _Shape(BaseModel):
    model_config = ConfigDict(extra="forbid")


class _Survivor(_Shape):
    mutants: _Text
    because: _Line | None  # null until its author has filled it in


class _Expected(_Shape):
    mutants: _Text
    killed_by: tuple[_Text, ...] = Field(min_length=1)


class _Variant(_Shape):
    variants: _Text
    because: _Line | None


class _Criterion(_Shape):
    criterion: _Text
    because: _Line | None


class _File(_Shape):
    schema_: Literal["grader/selftest-notes/v1"] = Field(alias="schema")
    reference: _Text | None = None
    template: _Text | None = None
    template_score: float | None = Field(default=None, ge=0, le=1_000_000, allow_inf_nan=False)
    survivors: tuple[_Survivor, ...] = ()
    expected: tuple[_Expected, ...] = ()
    variants: tuple[_Variant, ...] = ()
    criteria: tuple[_Criterion, ...] = ()


def read_explained(path: Path, exercise: Exercise) -> Explained:
    """Read the notes on the self-test of an exercise, empty without a file; raises RubricError with every mistake."""
    if not path.exists():
        return Explained()
    tree = _tree(path)
    try:
        read = _File.model_validate(tree.data or {})
    except ValidationError as error:
        raise refused_file(path, [*tree.mistakes, *mistakes_of(error, tree, _File)]) from None
    mistakes = [*tree.mistakes, *_unknown_criteria(read, tree, exercise)]
    if mistakes:
        raise refused_file(path, mistakes)

    def where(*at: str | int) -> str:
        place = tree.values[at]
        return f"{printable(str(path), 500)}:{place.line}:{place.column}"

    def reasons(key: str, notes: Sequence[tuple[str, str | None]]) -> Iterator[Explanation]:
        for n, (pattern, because) in enumerate(notes):
            yield Explanation(pattern, because or "", (), where(key, n))

    expected = (Explanation(e.mutants, "", e.killed_by, where("expected", n)) for n, e in enumerate(read.expected))
    return Explained(
        reference=None if read.reference is None else path.parent / read.reference,
        template=None if read.template is None else path.parent / read.template,
        template_score=None if read.template_score is None else Fraction(str(read.template_score)),
        survivors=tuple(reasons("survivors", [(s.mutants, s.because) for s in read.survivors])),
        expected=tuple(expected),
        variants=tuple(reasons("variants", [(v.variants, v.because) for v in read.variants])),
        criteria={one.criterion: one.because or "" for one in read.criteria},
    )


def _tree(path: Path) -> YamlTree:
    where = printable(str(path), 500)
    try:
        data = path.read_bytes()
        if len(data) > MAX_BYTES:
            raise RubricError(f"{where}: expected at most {MAX_BYTES // 1024} KiB, found more")
        return read_yaml(data.decode("utf-8-sig"))
    except OSError as error:
        raise RubricError(f"{where}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise RubricError(f"{where}: expected UTF-8 text, found another encoding", "save the file as UTF-8") from None
    except YamlSyntaxError as error:
        raise refused_file(path, [error.mistake]) from None


def _unknown_criteria(read: _File, tree: YamlTree, exercise: Exercise) -> Iterator[Mistake]:
    known = [criterion.id for criterion in exercise.criteria]
    named: dict[TreePath, str] = {("criteria", n, "criterion"): one.criterion for n, one in enumerate(read.criteria)}
    for n, one in enumerate(read.expected):
        named |= {("expected", n, "killed_by", k): id_ for k, id_ in enumerate(one.killed_by)}
    for at, id_ in named.items():
        if id_ not in known:
            text = f"expected a criterion of {exercise.id} ({listed(known)}), found `{printable(id_)}`"
            yield tree.values[at].mistake(text, nearest_hint(id_, known))
