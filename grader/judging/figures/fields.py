"""Draws the numbers in a topic's messages against those expected."""

from __future__ import annotations

from grader.core.chart import Chart, Level, Look, Panel, Point, Tone
from grader.core.quantities import seconds, within
from grader.core.trace import Message, Trace
from grader.judging.checks.topics import FieldValues
from grader.judging.figures.drawing import happenings, series
from grader.judging.values import field, published
from grader.judging.wording import counted, number

_TONES = (Tone.MAIN, Tone.SECOND, Tone.THIRD)
_UNITS = {"linear": "m/s", "angular": "rad/s"}
_NAN = float("nan")


def field_chart(check: FieldValues, trace: Trace) -> Chart | None:
    """Return the picture of the fields that a check names, or None without messages."""
    messages = published(trace, check.topic)
    if not messages:
        return None
    group = next(iter(check.values)).partition(".")[0]
    title = "Commanded velocities" if group in _UNITS else "Values"
    return Chart(
        id=f"fields {check.topic}",
        title=f"{title} on {check.topic}",
        about=_about(check, messages),
        criteria=(),
        x_title="time",
        x_unit="s",
        panels=(_panel(check, messages, group),),
        moments=happenings(trace),
    )


def _panel(check: FieldValues, messages: tuple[Message, ...], group: str) -> Panel:
    lines = []
    for place, path in enumerate(check.values):
        points: list[Point] = []
        for message in messages:
            got = field(message.value, path)
            points.append((seconds(message.t_ns), _NAN if got is None else got))
        look = Look.LINE if len(points) > 1 else Look.DOTS
        lines.append(series(path, points, look=look, tone=_TONES[place % len(_TONES)]))
    wanted = {w: [p for p, v in check.values.items() if v == w] for w in dict.fromkeys(check.values.values())}
    levels = tuple(Level(w, f"{', '.join(paths)} = {number(w)} expected") for w, paths in wanted.items())
    same = all("." in path and path.startswith(f"{group}.") for path in check.values)
    return Panel(group if same else "value", _UNITS.get(group, "") if same else "", tuple(lines), levels=levels)


def _about(check: FieldValues, messages: tuple[Message, ...]) -> str:
    parts = []
    for path, want in check.values.items():
        got = [g for g in (field(m.value, path) for m in messages) if g is not None]
        right = sum(within(g, want, check.tolerance) for g in got)
        spread = f", from {number(min(got))} to {number(max(got))}" if got and right < len(messages) else ""
        parts.append(f"{path} is {number(want)} in {right} of {counted(len(messages), 'message')}{spread}")
    return "; ".join(parts) + "."
