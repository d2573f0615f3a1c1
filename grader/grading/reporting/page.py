"""Lays out text for a given width: wrapped paragraphs with a hanging indent, coloured or plain."""

from __future__ import annotations

from io import StringIO

from rich.cells import cell_len
from rich.console import Console
from rich.text import Text

from grader.grading.reporting.escape import without_workflow_commands

#: Narrowest page that can be laid out, in columns.
NARROWEST = 20
# A column narrower than this is harder to read than a new line.
_NARROWEST_COLUMN = 14


class Page:
    """Text written from top to bottom; nothing is cut, and no line is wider than the page."""

    def __init__(self, *, width: int, colour: bool) -> None:
        """Start an empty page; environment variables do not affect it."""
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
        """Return the text so far; no line of it is a GitHub workflow command, even after wrapping."""
        return without_workflow_commands(self._out.getvalue())

    def blank(self) -> None:
        """Write an empty line, unless the page is empty."""
        if self._out.getvalue():
            self._out.write("\n")

    def put(self, body: Text | str, *, prefix: Text | str = "", style: str = "", indent: int = 4) -> None:
        """Write a paragraph that is already safe to show.

        Further lines are indented to the end of the prefix; where the body does not fit beside it, to `indent`.
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
        """Return whether the text reads better below its prefix, because a word would break beside it."""
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
