"""What is written for the whole class: the page, the gradebook, JSON, and files for the platforms asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.classroom.class_page import RunOfClass, class_page
from grader.classroom.gradebook import Gradebook, render_gradebook
from grader.classroom.platforms import Export, Users, export_canvas, export_gradescope, export_moodle, read_users
from grader.reporting.class_page.contents import PageLink
from grader.reporting.class_page.render import class_assets, render_class

PAGE, GRADEBOOK, CLASS, ASSETS = "index.html", "gradebook.csv", "batch.json", "assets"


@dataclass(frozen=True, slots=True)
class Platforms:
    """The platforms that are to be told.

    Attributes:
        canvas: Number of the assignment in Canvas; empty if Canvas is not asked for.
        canvas_gradebook: The gradebook that Canvas exported; None if the roster has Canvas' numbers.
        moodle: The users that Moodle exported; None if Moodle is not asked for.
        gradescope: Whether Gradescope is asked for.
    """

    canvas: str = ""
    canvas_gradebook: Users | None = None
    moodle: Users | None = None
    gradescope: bool = False


def platforms(canvas: str, canvas_gradebook: Path | None, moodle: Path | None, *, gradescope: bool) -> Platforms:
    """Return what the platforms need, read; raises ClassError for a table that cannot be used."""
    return Platforms(
        canvas,
        None if canvas_gradebook is None else read_users(canvas_gradebook),
        None if moodle is None else read_users(moodle),
        gradescope,
    )


def exports(book: Gradebook, wanted: Platforms, results: Mapping[str, str]) -> dict[str, Export]:
    """Return platform -> its files; raises ClassError for what a platform could not take.

    Args:
        book: The class.
        wanted: The platforms.
        results: Name of an entry -> Gradescope's results.json of its report.
    """
    made: dict[str, Export] = {}
    if wanted.canvas:
        made["canvas"] = export_canvas(book, wanted.canvas, wanted.canvas_gradebook)
    if wanted.moodle is not None:
        made["moodle"] = export_moodle(book, wanted.moodle)
    if wanted.gradescope:
        made["gradescope"] = export_gradescope(book, results)
    return made


def class_files(
    book: Gradebook,
    made: Mapping[str, Export],
    run: RunOfClass,
    *,
    links: Sequence[PageLink] = (),
    standalone: bool = False,
) -> dict[str, bytes]:
    """Return name below the folder for results -> content, of all that is made for the class; the page is last.

    Args:
        book: The class.
        made: What platforms are told.
        run: The run that writes it.
        links: Other pages in the folder, which the page of the class leads to.
        standalone: Whether the page holds its scripts, instead of sharing them with the reports.
    """
    files = {GRADEBOOK: render_gradebook(book).encode()}
    for export in made.values():
        files.update({name: text.encode() for name, text in export.files.items()})
    if not standalone:
        files.update({f"{ASSETS}/{name}": data for name, data in class_assets().items()})
    files[PAGE] = render_class(class_page(book, run, links), assets=None if standalone else ASSETS).encode()
    return files
