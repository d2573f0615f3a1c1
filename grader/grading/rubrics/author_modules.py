"""Runs files with checks and hint rules, and makes their values again in another process, or from the compiled form.

This needs nothing else of how rubrics are read: grading with the built-in rubrics loads them compiled, and would wait
for pydantic.
"""

from __future__ import annotations

import copyreg
import dataclasses
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from types import ModuleType
from typing import Any

from grader.grading.model.exercise import HintRule
from grader.runtime.model.author_files import run_author_file
from grader.runtime.model.dataclass import dataclass


def module_of(path: str, content: bytes) -> ModuleType:
    """Return the module of a file, whose checks other processes can recreate."""
    module = run_author_file("_own_checks", path, content)
    for kind in vars(module).values():
        if isinstance(kind, type) and kind.__module__ == module.__name__ and dataclasses.is_dataclass(kind):
            copyreg.pickle(kind, _reduced)
    return module


@cache
def rules_in(path: str, content: bytes) -> tuple[Any, ...]:
    """Return the rules of a file in the order of its text."""
    from grader.grading.judging.diagnosis.rules import (  # noqa: PLC0415  takes 50 ms, and most rubrics have no rules
        Rule,
    )

    rules = (value for value in vars(module_of(path, content)).values() if isinstance(value, Rule))
    return tuple(dataclasses.replace(rule, file=path) for rule in dict.fromkeys(rules))


@dataclass(frozen=True, slots=True)
class OwnHints:
    """The hint rules of a rubric, by the path and the text of each file that holds some.

    A file runs when its rules are first asked for: they need all of diagnosis, which takes 50 ms to import.
    """

    files: tuple[tuple[str, bytes], ...] = ()

    def __iter__(self) -> Iterator[HintRule]:
        """Yield the rules in the order of the files and of their text."""
        for path, content in self.files:
            yield from rules_in(path, content)

    def __add__(self, others: OwnHints) -> OwnHints:
        """Return these rules and others."""
        return OwnHints(self.files + others.files)


def _reduced(value: Any) -> tuple[Any, ...]:
    """Return how another process recreates a value of such a class; it has to run the file first."""
    module = sys.modules[type(value).__module__]
    given = {field.name: getattr(value, field.name) for field in dataclasses.fields(value) if field.init}
    return _remade, (module.__file__, vars(module)["__content__"], type(value).__qualname__, given)


def _remade(path: str, content: bytes, name: str, given: Mapping[str, object]) -> Any:
    return getattr(module_of(path, content), name)(**given)
