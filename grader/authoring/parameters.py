"""The parameters that a reference declares, as a rubric would name them."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator

from grader.model.trace import Offer, Trace

#: What every node has.
_EVERYBODYS = ("use_sim_time", "start_type_description_service")
_OVERRIDES = "qos_overrides."


def parameters(trace: Trace) -> Iterator[tuple[str, str, str | float | bool | None]]:
    """Yield node, name and value of each parameter; the node is empty where one alone has any, a list is None."""
    offers = [(o.name.partition(":"), o.detail) for o in trace.of(Offer) if o.kind == "parameter"]
    own = {(node, name): value for (node, _, name), value in offers if not _is_everybodys(name)}
    several = len({node for node, _ in own}) > 1
    for (node, name), value in own.items():
        yield node if several else "", name, _read(value)


def _is_everybodys(name: str) -> bool:
    return name in _EVERYBODYS or name.startswith(_OVERRIDES)


def _read(text: str) -> str | float | bool | None:
    """Return the value that a node told as Python writes it; None for a list and for what is no value."""
    try:
        value = ast.literal_eval(text)
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return None
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, (str, int, float)) and value != "" else None
