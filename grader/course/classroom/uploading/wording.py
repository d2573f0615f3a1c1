"""Words an upload for people: what it would change, and what became of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from grader.course.classroom.uploading.marks import Change, Marks, Platform, PlatformComparison, Sent, same
from grader.grading.reporting.escape import shown

_NAME = 60


def render_comparison(marks: Marks, platform: Platform, found: PlatformComparison) -> str:
    """Describe what an upload would change, person by person; people whose mark is already there are counted."""
    needed = [change for change in found.changes if change.needed]
    points = "" if platform.max_score is None else f" ({platform.max_score:g} points)"
    lines = [f"to: {shown(platform.title, limit=200)}{points}"]
    if None not in (marks.max_score, platform.max_score) and not same(marks.max_score, platform.max_score):
        lines.append(f"note: the reports have {marks.max_score:g} points; scores are sent as they are")
    lines += [_change(change) for change in needed]
    lines.append(f"marks: {len(needed)} to send, {len(found.changes) - len(needed)} already there")
    lines += [*_listed("without a mark", marks.left_out), *_listed("not on the platform", found.unknown)]
    return "\n".join(lines) + "\n"


def _change(change: Change) -> str:
    score = f"{change.mark.score:g}"
    if change.before is not None and not same(change.before, change.mark.score):
        score = f"{change.before:g} -> {score}"
    parts = [score, "with feedback" if change.feedback else "", "found by name" if change.by_name else ""]
    return f"  {shown(change.mark.name, limit=_NAME)}: {', '.join(part for part in parts if part)}"


def render_sent(sent: Sent) -> str:
    """Describe what became of an upload."""
    lines = [f"sent: {sent.sent}", *_listed("refused", sent.refused), *_listed("not as sent", sent.wrong)]
    return "\n".join(lines) + "\n"


def _listed(title: str, lines: Sequence[str]) -> Iterator[str]:
    for line in lines:
        yield f"{title}: {shown(line, limit=300)}"
