"""Kinds of text that rubrics hold beside plain sentences: types, formulas and patterns, told apart by annotation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True, slots=True)
class Language:
    """Marks an annotated text as one that is written by the rules of some language."""

    name: str


#: A service type such as `std_srvs/srv/Trigger`.
ServiceType = Annotated[str, Language("service type")]
#: An action type such as `example_interfaces/action/Fibonacci`.
ActionType = Annotated[str, Language("action type")]
#: A formula of `n` and `t` such as `sin(0.1 * n)`.
Formula = Annotated[str, Language("formula")]
#: A regular expression.
Pattern = Annotated[str, Language("pattern")]
