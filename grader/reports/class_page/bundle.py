"""The scripts and style sheets of the page of a class; the chart library is the one that reports share."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.resources import files

from grader.reports.html.bundle import Bundle, bundle, policy_digest, shared_assets


@cache
def own_script() -> str:
    """Return the page's own script, which needs that of the reports before it."""
    return _read("assets/class.js")


@cache
def own_style() -> str:
    """Return the page's own style sheet, which stands on that of the reports."""
    return _read("assets/class.css")


def class_assets() -> dict[str, bytes]:
    """Return file name -> content of what a page rendered with `assets=...` loads from there."""
    return {**shared_assets(), own_name("js"): own_script().encode(), own_name("css"): own_style().encode()}


def own_name(ending: str) -> str:
    """Return the file name of the page's own script or style sheet; another version has another name."""
    text = own_script() if ending == "js" else own_style()
    return f"class-{hashlib.sha256(text.encode()).hexdigest()[:12]}.{ending}"


def scripts_policy(*, standalone: bool) -> str:
    """Return which scripts the page may run, as a Content-Security-Policy writes it."""
    if not standalone:
        return "'self' file:"
    return f"'{common().script_digest}' '{policy_digest(own_script())}'"


def common() -> Bundle:
    """Return what the page has in common with reports."""
    return bundle()


def _read(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")
