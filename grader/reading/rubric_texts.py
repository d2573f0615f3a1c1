"""The texts of a rubric that are written by the rules of a language: formulas and regular expressions."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from grader.judging.formula import FormulaError, curve
from grader.reading.rubric_types import wrong

_LONGEST_PATTERN = 400


def _formula(text: str) -> str:
    try:
        curve(text)
    except FormulaError as error:
        raise wrong(str(error)) from None
    return text


def _pattern(text: str) -> str:
    if not 0 < len(text) <= _LONGEST_PATTERN:
        raise wrong(f"a regular expression of at most {_LONGEST_PATTERN} characters")
    try:
        re.compile(text)
    except (re.error, RecursionError, OverflowError) as error:
        raise wrong("a regular expression of Python", str(error)) from None
    return text


@dataclass(frozen=True, slots=True)
class _Readable:
    """Marks a text that a reader has to understand."""

    example: str
    is_formula: bool

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Read the text after its type was checked."""
        read = _formula if self.is_formula else _pattern
        return core_schema.no_info_after_validator_function(read, core_schema.str_schema(strict=True))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Describe the text to editors."""
        described: dict[str, Any] = {"type": "string", "examples": [self.example]}
        return described if self.is_formula else {**described, "format": "regex"}


FormulaText = Annotated[str, _Readable("sin(0.1 * n)", is_formula=True)]
PatternText = Annotated[str, _Readable("[0-9]+", is_formula=False)]
