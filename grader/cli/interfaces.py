"""The commands `grade interfaces ...`: packages of messages, services and actions from their definitions."""

from __future__ import annotations

from pathlib import Path

import click

from grader.cli.options import PATH, print_result
from grader.runtime.model.errors import ALL_MET


@click.group(name="interfaces")
def command() -> None:
    """Build and list packages of messages, services and actions that are not installed."""


@command.command(name="build")
@click.argument("folders", metavar="FOLDER...", nargs=-1, required=True, type=PATH)
@click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
def _build(*, folders: tuple[Path, ...], as_json: bool) -> int:
    """Build the interface packages in FOLDER: a package, a workspace or any folder with packages.

    No compiler is needed. What is built is kept, and used again for the same definitions. Where ROS has a package of
    the same name, that one is used instead. Exit code 2 if a definition cannot be used.
    """
    return _print(folders, ready=False, as_json=as_json)


@command.command(name="list")
@click.argument("folders", metavar="[FOLDER]...", nargs=-1, type=PATH)
@click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
def _list(*, folders: tuple[Path, ...], as_json: bool) -> int:
    """List the packages that come with the grader, and those in each FOLDER, with their types."""
    return _print(folders, ready=True, as_json=as_json)


def _print(folders: tuple[Path, ...], *, ready: bool, as_json: bool) -> int:
    from grader.grading.reporting.interface_list import packages_to_json, render_packages
    from grader.runtime.interface_packages import course_packages

    found = course_packages(folders, ready=ready)
    print_result(
        lambda: packages_to_json(found),
        lambda page: render_packages(found, width=page.width, colour=page.colour),
        as_json=as_json,
    )
    return ALL_MET
