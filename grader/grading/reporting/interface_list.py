"""Renders interface packages for `grade interfaces`, as text for people and as JSON for programs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict

from grader.grading.reporting.escape import json_value, shown
from grader.grading.reporting.page import Page
from grader.runtime.model.packages import DescribedPackage

SCHEMA = "grader/runtime/interfaces/v1"
_ORIGINS = {"class": "from the folder given", "grader": "comes with the grader"}
_DIGEST = len("sha256:") + 12


def packages_to_json(packages: Sequence[DescribedPackage]) -> str:
    """Return packages as indented JSON text."""
    return json.dumps(json_value({"schema": SCHEMA, "packages": [asdict(one) for one in packages]}), indent=2) + "\n"


def render_packages(packages: Sequence[DescribedPackage], *, width: int, colour: bool) -> str:
    """Return packages as text: where each comes from, where it is kept, and its types by kind."""
    page = Page(width=width, colour=colour)
    for number, package in enumerate(packages):
        if number:
            page.blank()
        page.put(f"{shown(package.name)}  {_ORIGINS[package.origin]}, {package.digest[:_DIGEST]}", style="bold")
        page.put(
            f"kept in {shown(package.folder)}" if package.folder else "not used: it is installed", prefix="  ", indent=2
        )
        for kind in ("msg", "srv", "action"):
            names = [type_.rpartition("/")[2] for type_ in package.types if type_.split("/")[1] == kind]
            if names:
                page.put(shown(", ".join(names)), prefix=f"  {kind:7}", indent=9)
    return page.text()
