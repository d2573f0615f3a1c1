"""Matches texts to poses: groups texts by template and finds the two numbers that follow the pose."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from grader.core.quantities import NS_PER_MS
from grader.core.trace import ClockKind, LogRecord, OutputLine
from grader.judging.positions.labels import Layout, Pair, candidate_pairs, template_of
from grader.judging.positions.numbers import SLACK_M, Printed, clean, printed_numbers, with_decimal_points
from grader.judging.positions.track import Pose, Track

#: Output written within this time is one block; in virtual time one instant is exact.
_BLOCK_NS = {ClockKind.VIRTUAL: 0, ClockKind.WALL: 10 * NS_PER_MS}

Wanted = Callable[[Pose], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Text:
    """A text that a process wrote at one instant."""

    t_ns: int
    text: str


@dataclass(frozen=True, slots=True)
class Entry:
    """One text of a group, read; `right` if its pair shows a current pose."""

    t_ns: int
    text: str
    numbers: tuple[Printed, ...]
    right: bool = False


@dataclass(frozen=True, slots=True)
class Group:
    """All texts of one template, and the index pair that shows a current pose most often.

    `pair` is None where the texts hold fewer than two numbers.
    """

    template: str
    pairs: tuple[Pair, ...]
    entries: tuple[Entry, ...]
    pair: Pair | None = None

    @property
    def right(self) -> int:
        """How many texts show a current pose."""
        return sum(e.right for e in self.entries)

    @property
    def share(self) -> float:
        """Share of the texts that show a current pose."""
        return self.right / len(self.entries)


def position(pose: Pose) -> tuple[float, float]:
    """Return what is wanted: x and y."""
    return pose.x, pose.y


def single_texts(outputs: Iterable[LogRecord | OutputLine]) -> list[Text]:
    """Return each record or line as a text of its own."""
    return [Text(o.t_ns, clean(o.text)) for o in outputs]


def blocks(outputs: Iterable[LogRecord | OutputLine], clock: ClockKind) -> list[Text]:
    """Return what was written at one instant as one text: three lines a message count as one."""
    joined: list[tuple[int, list[str]]] = []
    for output in outputs:
        if joined and output.t_ns - joined[-1][0] <= _BLOCK_NS[clock]:
            joined[-1][1].append(output.text)
        else:
            joined.append((output.t_ns, [output.text]))
    return [Text(t_ns, clean("\n".join(texts))) for t_ns, texts in joined]


def grouped(texts: Iterable[Text], *, decimal_comma: bool = False) -> list[Group]:
    """Return texts that hold a number, grouped by template in order of appearance."""
    layouts: dict[str, Layout] = {}
    members: dict[str, list[Entry]] = {}
    for text in texts:
        body = (with_decimal_points(text.text) or text.text) if decimal_comma else text.text
        numbers = printed_numbers(body)
        if not numbers:
            continue
        template = template_of(body, numbers)
        if template not in layouts:
            layouts[template] = Layout(template, numbers, candidate_pairs(body, numbers))
        members.setdefault(template, []).append(Entry(text.t_ns, text.text, numbers))
    return [Group(template, layouts[template].pairs, tuple(entries)) for template, entries in members.items()]


def matched(group: Group, track: Track, wanted: Wanted = position) -> Group:
    """Return the group with its best pair chosen and every text judged by it."""
    if not group.pairs:
        return group
    hits = [_hits(entry, group.pairs, track, wanted) for entry in group.entries]
    counts = {pair: sum(pair in h for h in hits) for pair in group.pairs}
    best = max(group.pairs, key=lambda pair: counts[pair])
    entries = tuple(Entry(e.t_ns, e.text, e.numbers, right=best in h) for e, h in zip(group.entries, hits, strict=True))
    return Group(group.template, group.pairs, entries, best)


def _hits(entry: Entry, pairs: Sequence[Pair], track: Track, wanted: Wanted) -> set[Pair]:
    """Return the pairs that show a current pose: both numbers of one and the same."""
    current = track.current(entry.t_ns)
    newest = _among(entry, pairs, [wanted(track.pose(current[-1]))])
    # nearly every log shows the newest pose, and to look for a dozen older ones takes long
    return newest if len(newest) == len(pairs) else _among(entry, pairs, [wanted(track.pose(k)) for k in current])


def _among(entry: Entry, pairs: Sequence[Pair], targets: Sequence[tuple[float, float]]) -> set[Pair]:
    wanted_first, wanted_second = [a for a, _ in targets], [b for _, b in targets]
    firsts = {i: _shown_by(entry.numbers[i], wanted_first) for i in {i for i, _ in pairs}}
    seconds = {j: _shown_by(entry.numbers[j], wanted_second) for j in {j for i, j in pairs if firsts[i]}}
    return {(i, j) for i, j in pairs if firsts[i] and firsts[i] & seconds[j]}


def _shown_by(number: Printed, values: Sequence[float]) -> int:
    """Return as a bit set which of the values the number shows."""
    far = number.step + SLACK_M
    if number.value < min(values) - far or number.value > max(values) + far:
        return 0
    bits = 0
    for place, value in enumerate(values):
        if number.shows(value):
            bits |= 1 << place
    return bits
