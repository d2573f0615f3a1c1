"""The syntax trees of source texts, parsed once for all tests of a process: see the group `source`."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path


@cache
def parsed(text: str) -> ast.Module:
    """Return the tree of a source text."""
    return ast.parse(text)


@cache
def nodes_of(text: str) -> tuple[ast.AST, ...]:
    """Return all nodes of a source text, as `ast.walk` gives them."""
    return tuple(ast.walk(parsed(text)))


def nodes_in(path: Path) -> tuple[ast.AST, ...]:
    """Return all nodes of a file."""
    return nodes_of(path.read_text(encoding="utf-8"))
