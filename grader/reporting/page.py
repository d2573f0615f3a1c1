"""A page of text of a given width: wrapped paragraphs that hang under their first line, coloured or plain."""

from __future__ import annotations

from io import StringIO

from rich.cells import cell_len
from rich.console import Console
from rich.text import Text

from grader.reporting.escape import obeyed_by_none

#: Narrowest page; below it nothing can be laid out.
NARROWEST = 20
# A column narrower than this is harder to read than a new line.
_NARROWEST_COLUMN = 14


class Page:
    """Text written from top to bottom; nothing is cut, and no line is longer than the page is wide."""

    def __init__(self, *, width: int, colour: bool) -> None:
        """Begin an empty page; the environment has no say in how it comes out."""
        self.width = max(width, NARROWEST)
        self._out = StringIO()
        self._console = Console(
            file=self._out,
            width=self.width,
            force_terminal=colour,
            color_system="standard" if colour else None,
            force_jupyter=False,
            legacy_windows=False,
            highlight=False,
            markup=False,
            emoji=False,
            _environ={},
        )

    def text(self) -> str:
        """Return what was written so far, fit for the log of a GitHub job: a line break may have made a command."""
        return obeyed_by_none(self._out.getvalue())

    def blank(self) -> None:
        """Leave a line free, unless the page is empty."""
        if self._out.getvalue():
            self._out.write("\n")

    def put(self, body: Text | str, *, prefix: Text | str = "", style: str = "", indent: int = 4) -> None:
        """Write a paragraph.

        Args:
            body: Already safe to show.
            prefix: What stands before its first line; further lines hang under its end.
            style: Style of the body.
            indent: Where the body begins if it has too little room beside its prefix.
        """
        head, text = _text(prefix), _text(body, style)
        if head.plain.strip() and self._crowded(text, head.cell_len, indent):
            self._line(head)
            head = Text(" " * indent)
        lines = text.wrap(self._console, self.width - head.cell_len, overflow="fold")
        self._line(head + lines[0] if lines else head)
        for line in lines[1:]:
            self._line(Text(" " * head.cell_len) + line)

    def _crowded(self, text: Text, beside: int, indent: int) -> bool:
        """Whether the text reads better below its prefix: a word would break beside it that is whole below."""
        longest = max(map(cell_len, text.plain.split()), default=0)
        return beside > indent and self.width - beside < max(min(longest, self.width - indent), _NARROWEST_COLUMN)

    def _line(self, text: Text) -> None:
        text.rstrip()
        self._console.print(text, soft_wrap=True)


def _text(value: Text | str, style: str = "") -> Text:
    text = value.copy() if isinstance(value, Text) else Text(value)
    if style:
        text.stylize_before(style)
    return text
