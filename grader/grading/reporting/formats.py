"""The formats of reports, one row each, and those of other packages; a renderer is imported at its first use."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from grader.grading.model import entry_points
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EnvironmentFault

if TYPE_CHECKING:
    from grader.grading.model.report import Report
    from grader.grading.reporting.audience import Readers
    from grader.grading.reporting.platforms.classroom50 import HandedIn


@dataclass(frozen=True, slots=True)
class PageLayout:
    """Width, colour and length of text; formats for programs ignore it."""

    width: int
    colour: bool
    verbose: bool = False  # whether to show everything, not only what a student acts on
    recordings: str = ""  # folder of the kept evidence, relative to the report; empty if none is kept


#: What a renderer may need besides the report, and the names of the arguments that it is then called with.
NEEDS: Mapping[str, tuple[str, ...]] = {
    "layout": ("width", "colour", "verbose"),  # of the page: columns, whether colours are shown, whether to show all
    "folder": ("folder",),  # the submission's folder in its repository; see `repository_folder`
    "recordings": ("recordings",),  # the folder of the kept evidence, relative to the report; empty if none is kept
    "handed_in": ("handed_in",),  # what Classroom 50 says of the submission
}


@dataclass(frozen=True, slots=True)
class Format:
    """A format of reports; a package registers one as an entry point of `rclpy_grader.formats`."""

    # The function that returns the text of a report, called with the `Report`, and with what it needs by name;
    # `module:function` to import it when it is first used
    renderer: str | Callable[..., str]
    suffix: str  # file name suffix of this format
    for_students: bool = False  # whether students read it unless an option says otherwise: a platform shows it to them
    needs: tuple[str, ...] = ()  # what the renderer is given besides the report: `layout`, `folder` or `recordings`
    # Whether the renderer itself hides what students must not see yet, because its platform shows it later: where
    # students read the report, it is then given the whole one and the `day`; else it gets what they may see
    withholds: bool = False
    illustrated: bool = False  # whether it shows figures, which take about as long to draw as judging takes
    # Whether its platform ends a run that takes too long, and then uses the file that exists
    written_early: bool = False

    def __post_init__(self) -> None:
        """Raise ValueError for what no format can need."""
        if not isinstance(self.needs, tuple) or not set(self.needs) <= set(NEEDS):
            raise ValueError(f"needs: expected a tuple of {', '.join(NEEDS)}, found {self.needs!r}")

    def __call__(self, report: Report, layout: PageLayout, **arguments: object) -> str:
        """Return the text of a report."""
        return self.load()(report, **_arguments(self.needs, report, layout), **arguments)

    def load(self) -> Callable[..., str]:
        """Return the rendering function, imported if it was named."""
        if not isinstance(self.renderer, str):
            return self.renderer
        module, _, function = self.renderer.partition(":")
        render: Callable[..., str] = getattr(import_module(module), function)
        return render


def _arguments(needs: tuple[str, ...], report: Report, layout: PageLayout) -> Mapping[str, object]:
    found: dict[str, object] = {}
    if "layout" in needs:
        found |= {"width": layout.width, "colour": layout.colour, "verbose": layout.verbose}
    if "recordings" in needs:
        found["recordings"] = layout.recordings
    if "folder" in needs:
        found["folder"] = repository_folder(report.path, os.environ)
    if "handed_in" in needs:
        found["handed_in"] = _handed_in()
    return found


def _handed_in() -> HandedIn:
    from grader.grading.reporting.platforms.classroom50 import handed_in  # noqa: PLC0415  only for this format

    return handed_in(os.environ)


#: What stands in place of a format in `-o evidence=FOLDER`, which keeps the recordings of a run.
EVIDENCE = "evidence"
_HERE = "grader.grading.reporting"
#: The formats that come with the grader, by name; `format_of` finds those of other packages as well.
FORMATS: dict[str, Format] = {
    "json": Format(f"{_HERE}.json_report:dumps", ".json"),
    "text": Format(f"{_HERE}.text:render_text", ".txt", needs=("layout",)),
    "html": Format(f"{_HERE}.html.render:render_html", ".html", illustrated=True, needs=("recordings",)),
    "markdown": Format(f"{_HERE}.markdown:render_markdown", ".md"),
    "junit": Format(f"{_HERE}.junit:render_junit", ".xml", needs=("folder",)),
    "github": Format(f"{_HERE}.platforms.github:render_github", ".txt", for_students=True, needs=("folder",)),
    "gradescope": Format(
        f"{_HERE}.platforms.gradescope:render_gradescope",
        ".json",
        for_students=True,
        withholds=True,
        written_early=True,
    ),
    "prairielearn": Format(f"{_HERE}.platforms.prairielearn:render_prairielearn", ".json", for_students=True),
    "classroom50": Format(
        f"{_HERE}.platforms.classroom50:render_classroom50", ".json", for_students=True, needs=("handed_in",)
    ),
    "classroom": Format(f"{_HERE}.platforms.classroom:render_classroom", ".json", for_students=True),
}


def added_formats() -> list[str]:
    """Return the names of the formats that other packages add; names of the grader's own formats stay its own."""
    return [name for name in entry_points.registered_names(entry_points.FORMATS) if name not in (*FORMATS, EVIDENCE)]


@cache
def format_of(name: str) -> Format | None:
    """Return the format of this name: one of `FORMATS`, or one of another package, then ready to render.

    Return None if there is none. Raises EnvironmentFault if the package that registers it cannot be used.
    """
    if name in FORMATS:
        return FORMATS[name]
    found = entry_points.load_registered(entry_points.FORMATS, name, Format, "a Format of grader.api")
    if found is None:
        return None
    added, where = found
    with entry_points.faults(f"{where}: {added.renderer} cannot be imported", "update the package, or uninstall it"):
        render = added.load()
    return replace(added, renderer=_guarded(render, where))


def _guarded(render: Callable[..., object], where: str) -> Callable[..., str]:
    """Return a renderer of another package that raises EnvironmentFault, whatever it does wrong."""
    from grader.grading.reporting.escape import valid_unicode  # noqa: PLC0415  only for formats of other packages

    def guarded(report: Report, **arguments: object) -> str:
        with entry_points.faults(f"{where} failed", _ANOTHER):
            text = render(report, **arguments)
        if not isinstance(text, str):
            raise EnvironmentFault(f"{where}: expected a text, found {type(text).__name__}", _ANOTHER)
        return valid_unicode(text)

    return guarded


#: What helps whoever needs the result now.
_ANOTHER = "ask for another format, and report this to the authors of the package"


def known(name: str) -> Format:
    """Return a format that `format_of` has found before, or that comes with the grader."""
    found = format_of(name)
    assert found is not None, name
    return found


def check_surroundings(name: str) -> None:
    """Raise GraderError if the environment lacks a value that a format needs."""
    if "handed_in" in known(name).needs:
        _handed_in()


def rendered(name: str, report: Report, layout: PageLayout, readers: Readers) -> str:
    """Return a report in the format of this name, limited to what its reader may see."""
    from grader.grading.model.exercise import Audience  # noqa: PLC0415  only after a run, not for --help
    from grader.grading.reporting.audience import for_student  # noqa: PLC0415  only after a run, not for --help

    format_ = known(name)
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
