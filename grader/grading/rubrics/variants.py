"""The `variants` of a rubric: their possible values, and a document with the drawn values filled in."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from typing import Annotated, Self

from pydantic import ConfigDict, PlainValidator, WithJsonSchema, model_validator

from grader.grading.model.exercise import Value, Variant
from grader.grading.rubrics.mistakes import nearest_hint
from grader.grading.rubrics.types import Id, Shape, must, wrong
from grader.grading.rubrics.yaml_tree import Mistake, TreePath, YamlTree
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.wording import listed, printable

#: Key of a placeholder for a value: `{variant: rate}`.
REFERENCE = "variant"
#: Maximum number of values of a variant.
MOST = 10_000
#: If a variant has more values than this, checking a rubric tries only the first and the last.
TRIED = 24
#: Where a variant may be used, by the keys below `scenarios` and `criteria`; names of other things never vary.
_FIXED_IN_SCENARIOS = ("id", "processes", "may_exit", "start")
_FREE_IN_CRITERIA = ("check", "title", "hint")
_AMOUNT = re.compile(r"([+-]?[0-9]{1,30}(?:\.[0-9]{1,30})?)\s*([^\W\d_][^\s\d]{0,20})?")


def _scalar(value: object) -> object:
    if isinstance(value, float) and not math.isfinite(value):
        raise wrong("a finite number")
    if not isinstance(value, (str, int, float)) or value == "":
        raise wrong("a value such as 10 Hz, /cmd_vel or 0.5")
    return value


def _split(value: object) -> tuple[Decimal, str]:
    """Return number and unit; raises ValueError for anything but a number, with or without a unit."""
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise ValueError("no number")
    found = _AMOUNT.fullmatch(value.strip()) if isinstance(value, str) else None
    if isinstance(value, str) and found is None:
        raise ValueError("no number")
    number = Decimal(repr(value)) if found is None else Decimal(found[1])
    if not number.is_finite():
        raise ValueError("no finite number")
    return number, "" if found is None else found[2] or ""


def _amount(value: object) -> object:
    try:
        _split(value)
    except ValueError:
        raise wrong("a number, with its unit if it has one, such as 0.5 or 10 Hz") from None
    return value


_Scalar = Annotated[Value, PlainValidator(_scalar), WithJsonSchema({"type": ["string", "number", "boolean"]})]
_Amount = Annotated[Value, PlainValidator(_amount), WithJsonSchema({"type": ["string", "number"]})]


def _are_several(values: tuple[Value, ...]) -> bool:
    return len({(type(value), value) for value in values}) >= max(2, len(values))


_Choice = Annotated[tuple[_Scalar, ...], must(_are_several, "two or more different values")]
_Pair = Annotated[tuple[_Amount, ...], must(lambda pair: len(pair) == 2, "two numbers, the lower one first")]


class VariantShape(Shape):
    """What one value may be: one of those in `choose`, or those `between` two, a `step` apart."""

    choose: _Choice | None = None
    between: _Pair | None = None
    step: _Amount | None = None

    @model_validator(mode="after")
    def _has_a_meaning(self) -> Self:
        if (self.choose is None) == (self.between is None) or (self.between is None) != (self.step is None):
            raise wrong("either `choose`, or `between` and `step`")
        if self.between is not None:
            _span(self)
        return self


VariantsField = dict[Id, VariantShape]


def _span(shape: VariantShape) -> tuple[Decimal, Decimal, int, str]:
    """Return the least value, the step, the number of values, and their unit."""
    assert shape.between is not None
    (low, *units), (high, unit), (step, last) = map(_split, (*shape.between, shape.step))
    if {unit, last} != {*units}:
        raise wrong("one unit in `between` and `step`")
    if not (step > 0 and low < high):
        raise wrong("two numbers, the lower one first, and a step above 0")
    count = int((high - low) / step) + 1
    if not 2 <= count <= MOST:
        raise wrong(f"a step that gives 2 to {MOST:,} values")
    return low, step, count, unit


@dataclass(frozen=True, slots=True)
class VariantOptions:
    """The possible values of a variant."""

    name: str
    count: int
    _shape: VariantShape

    def value(self, index: int) -> Value:
        """Return the value with the given index, counted from 0."""
        if self._shape.choose is not None:
            return self._shape.choose[index]
        low, step, _, unit = _span(self._shape)
        number = low + index * step
        if unit:
            return f"{number} {unit}"
        return int(number) if number == number.to_integral_value() and low % 1 == step % 1 == 0 else float(number)

    def tried(self) -> Iterator[Value]:
        """Yield the values that checking a rubric tries."""
        every = range(self.count)
        few = every if self.count <= TRIED else (*every[: TRIED // 2], *every[-TRIED // 2 :])
        yield from map(self.value, few)


def tried(options: Sequence[VariantOptions], usual: Mapping[str, Value]) -> Iterator[Mapping[str, Value]]:
    """Yield the combinations that checking a rubric tries: each value once, the others as usual."""
    for option in options:
        yield from ({**usual, option.name: value} for value in option.tried())


class Variants(Shape):
    """A rubric, reduced to its variants."""

    model_config = ConfigDict(extra="ignore")

    variants: Annotated[VariantsField, must(bool, "at least one variant")]


def options_of(validated: Variants) -> tuple[VariantOptions, ...]:
    """Return the possible values of the variants of a rubric."""
    return tuple(
        VariantOptions(name, len(shape.choose) if shape.choose is not None else _span(shape)[2], shape)
        for name, shape in validated.variants.items()
    )


def has_variants(tree: YamlTree) -> bool:
    """Return whether a rubric has variants."""
    return isinstance(tree.data, Mapping) and "variants" in tree.data


def with_values(tree: YamlTree, values: Mapping[str, Value]) -> YamlTree:
    """Return a document with every `{variant: name}` replaced by its value; positions stay the same.

    Mistakes in the use of variants are added to those of the document.
    """
    mistakes = list(tree.mistakes)
    used: set[str] = set()

    def replaced(node: object, path: TreePath) -> object:
        if isinstance(node, list):
            return [replaced(item, (*path, index)) for index, item in enumerate(node)]
        if not isinstance(node, Mapping):
            return node
        name = node.get(REFERENCE)
        if path[:1] == ("variants",) or set(node) != {REFERENCE} or not isinstance(name, str):
            return {key: replaced(item, (*path, key)) for key, item in node.items()}
        used.add(name)
        mistakes.extend(_misuse(name, path, values, tree))
        return values.get(name, node)

    data = replaced(tree.data, ())
    for name in values:
        if name not in used:
            text = f"expected `{{variant: {name}}}` somewhere in the rubric, found none"
            mistakes.append(tree.at_key(("variants", name)).mistake(text))
    return replace(tree, data=data, mistakes=mistakes)


def _misuse(name: str, path: TreePath, known: Mapping[str, Value], tree: YamlTree) -> Iterator[Mistake]:
    where = tree.at(path)
    if name not in known:
        names = listed([f"`{one}`" for one in known])
        yield where.mistake(
            f"expected one of `variants` ({names}), found `{printable(name)}`", nearest_hint(name, known)
        )
    elif not _may_vary(path):
        text = f"expected a value of its own here, found the variant `{printable(name)}`"
        yield where.mistake(text, "variants belong in scenarios, checks, titles and hints")


def _may_vary(path: Sequence[str | int]) -> bool:
    if len(path) < 3:
        return False
    if path[0] == "scenarios":
        return path[2] not in _FIXED_IN_SCENARIOS
    return path[0] == "criteria" and path[2] in _FREE_IN_CRITERIA


def varied_digest(digest: str, variant: Variant) -> str:
    """Return the digest of a rubric with the values of a variant filled in."""
    text = json.dumps([digest, variant.values])
    return f"sha256:{hashlib.sha256(text.encode()).hexdigest()}"
