"""The formats of reports, one row each; a renderer is imported at its first use."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import import_module
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from grader.core.dataclass import dataclass

if TYPE_CHECKING:
    from grader.core.report import Report
    from grader.reporting.audience import Readers
    from grader.reporting.platforms.classroom50 import HandedIn


@dataclass(frozen=True, slots=True)
class PageLayout:
    """Width, colour and length of text; formats for programs ignore it."""

    width: int
    colour: bool
    verbose: bool = False  # whether to show everything, not only what a student acts on
    recordings: str = ""  # folder of the kept evidence, relative to the report; empty if none is kept


@dataclass(frozen=True, slots=True)
class Format:
    """A format of reports."""

    renderer: str  # the rendering function: `module:function` in `grader.reporting`
    suffix: str  # file name suffix of this format
    for_students: bool = False  # whether students read it unless an option says otherwise: a platform shows it to them
    needs: str = ""  # what its renderer is given besides the report: `layout`, `folder`, `handed_in` or `recordings`
    # Whether the renderer itself hides what students must not see yet, because its platform shows it later
    withholds: bool = False
    illustrated: bool = False  # whether it shows figures, which take about as long to draw as judging takes
    # Whether its platform ends a run that takes too long, and then uses the file that exists
    written_early: bool = False

    def __call__(self, report: Report, layout: PageLayout, **arguments: object) -> str:
        """Return the text of a report."""
        text: str = self.load()(report, **_arguments(self.needs, report, layout), **arguments)
        return text

    def load(self) -> Callable[..., str]:
        """Import the rendering function and return it."""
        module, _, function = self.renderer.partition(":")
        render: Callable[..., str] = getattr(import_module(f"grader.reporting.{module}"), function)
        return render


def _arguments(needs: str, report: Report, layout: PageLayout) -> Mapping[str, object]:
    if needs == "layout":
        return {"width": layout.width, "colour": layout.colour, "verbose": layout.verbose}
    if needs == "recordings":
        return {"recordings": layout.recordings}
    if needs == "folder":
        return {"folder": repository_folder(report.path, os.environ)}
    return {"handed_in": _handed_in()} if needs else {}


def _handed_in() -> HandedIn:
    from grader.reporting.platforms.classroom50 import handed_in  # noqa: PLC0415  only for this format

    return handed_in(os.environ)


#: Every format of reports, by name.
FORMATS: dict[str, Format] = {
    "json": Format("json_report:dumps", ".json"),
    "text": Format("text:render_text", ".txt", needs="layout"),
    "html": Format("html.render:render_html", ".html", illustrated=True, needs="recordings"),
    "markdown": Format("markdown:render_markdown", ".md"),
    "junit": Format("junit:render_junit", ".xml", needs="folder"),
    "github": Format("platforms.github:render_github", ".txt", for_students=True, needs="folder"),
    "gradescope": Format(
        "platforms.gradescope:render_gradescope", ".json", for_students=True, withholds=True, written_early=True
    ),
    "prairielearn": Format("platforms.prairielearn:render_prairielearn", ".json", for_students=True),
    "classroom50": Format("platforms.classroom50:render_classroom50", ".json", for_students=True, needs="handed_in"),
    "classroom": Format("platforms.classroom:render_classroom", ".json", for_students=True),
}


def check_surroundings(name: str) -> None:
    """Raise GraderError if the environment lacks a value that a format needs."""
    if FORMATS[name].needs == "handed_in":
        _handed_in()


def rendered(name: str, report: Report, layout: PageLayout, readers: Readers) -> str:
    """Return a report in one of `FORMATS`, limited to what its reader may see."""
    from grader.core.exercise import Audience  # noqa: PLC0415  only after a run, not for --help
    from grader.reporting.audience import for_student  # noqa: PLC0415  only after a run, not for --help

    format_ = FORMATS[name]
    if readers.of(Audience.STUDENT if format_.for_students else Audience.INSTRUCTOR) is Audience.INSTRUCTOR:
        return format_(report, layout)
    report = replace(report, audience=Audience.STUDENT)
    if format_.withholds:
        return format_(report, layout, day=readers.day)
    return format_(for_student(report, readers.day), replace(layout, recordings=""))


def repository_folder(path: str, environment: Mapping[str, str]) -> str | None:
    """Return a submission's folder in its repository, POSIX form, empty for the root; None outside of one.

    The repository is the workspace of a GitHub job, else the nearest parent folder with a `.git`, else this folder.
    """
    source = Path(os.path.realpath(path))
    folder = source if source.is_dir() else source.parent
    if not source.is_dir() and source.suffix != ".py":
        return None  # files inside an archive are not in the repository
    workspace = environment.get("GITHUB_WORKSPACE")
    checkouts = (parent for parent in (folder, *folder.parents) if (parent / ".git").exists())
    root = Path(os.path.realpath(workspace)) if workspace else next(checkouts, Path(os.path.realpath(".")))
    if not folder.is_relative_to(root):
        return None
    relative = PurePosixPath(folder.relative_to(root)).as_posix()
    return "" if relative == "." else relative
