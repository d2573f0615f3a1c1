"""The formats that a report can be delivered in; each is imported when it is first used."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

from grader.model.feedback import Audience
from grader.model.report import Report
from grader.reports.readers import ANYBODY, Readers


@dataclass(frozen=True, slots=True)
class Layout:
    """How a text is laid out; formats for programs do not care."""

    width: int
    colour: bool


def _json(report: Report, layout: Layout) -> str:
    from grader.reports.json_report import dumps  # noqa: PLC0415  only after a run, not for --help

    del layout
    return dumps(report)


def _text(report: Report, layout: Layout) -> str:
    from grader.reports.text import render_text  # noqa: PLC0415  rich costs more than all the rest of the start

    return render_text(report, width=layout.width, colour=layout.colour)


def _markdown(report: Report, layout: Layout) -> str:
    from grader.reports.markdown import render_markdown  # noqa: PLC0415  as above

    del layout
    return render_markdown(report)


def _html(report: Report, layout: Layout) -> str:
    from grader.reports.html.render import render_html  # noqa: PLC0415  as above

    del layout
    return render_html(report)


def _junit(report: Report, layout: Layout) -> str:
    from grader.reports.junit import render_junit  # noqa: PLC0415  as above

    del layout
    return render_junit(report, folder=_folder(report))


def _github(report: Report, layout: Layout) -> str:
    from grader.reports.github import render_github  # noqa: PLC0415  as above

    del layout
    return render_github(report, folder=_folder(report))


def _gradescope(report: Report, layout: Layout) -> str:
    from grader.reports.gradescope import render_gradescope  # noqa: PLC0415  as above

    del layout
    return render_gradescope(report)


def _prairielearn(report: Report, layout: Layout) -> str:
    from grader.reports.prairielearn import render_prairielearn  # noqa: PLC0415  as above

    del layout
    return render_prairielearn(report)


def _classroom50(report: Report, layout: Layout) -> str:
    from grader.reports.classroom50 import render_classroom50  # noqa: PLC0415  as above
    from grader.reports.surroundings import handed_in  # noqa: PLC0415  as above

    del layout
    return render_classroom50(report, handed_in(os.environ))


def _classroom(report: Report, layout: Layout) -> str:
    from grader.reports.classroom import render_classroom  # noqa: PLC0415  as above

    del layout
    return render_classroom(report)


def _folder(report: Report) -> str | None:
    from grader.reports.surroundings import repository_folder  # noqa: PLC0415  as above

    return repository_folder(report.path, os.environ)


def check_surroundings(format_: str) -> None:
    """Make sure that the environment tells what a format needs and a report does not know.

    Raises:
        GraderError: It does not.
    """
    if format_ == "classroom50":
        from grader.reports.surroundings import handed_in  # noqa: PLC0415  as above

        handed_in(os.environ)


#: Every format that a report can be delivered in.
FORMATS: dict[str, Callable[[Report, Layout], str]] = {
    "json": _json,
    "text": _text,
    "html": _html,
    "markdown": _markdown,
    "junit": _junit,
    "github": _github,
    "gradescope": _gradescope,
    "prairielearn": _prairielearn,
    "classroom50": _classroom50,
    "classroom": _classroom,
}


def rendered(format_: str, report: Report, layout: Layout, readers: Readers = ANYBODY) -> str:
    """Return a report in a format, with what its reader may see of it.

    Args:
        format_: One of `FORMATS`.
        report: The whole of it.
        layout: How a text is laid out.
        readers: Who reads it, and when.
    """
    if readers.of(format_) is Audience.INSTRUCTOR:
        return FORMATS[format_](report, layout)
    if format_ == "gradescope":  # the platform itself hides tests, and shows some of them later
        from grader.reports.gradescope import render_gradescope  # noqa: PLC0415  as above

        return render_gradescope(report, day=readers.day)
    from grader.reports.audience import for_student  # noqa: PLC0415  as above

    return FORMATS[format_](for_student(report, readers.day), layout)


#: Formats that show pictures, which take about as long to draw as judging takes.
ILLUSTRATED = frozenset({"html"})
#: Formats whose platform ends a run that takes too long, and then takes what is there.
WRITTEN_EARLY = frozenset({"gradescope"})
