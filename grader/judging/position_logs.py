"""Compares logged positions with the odometry that was played."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field

from grader.core.dataclass import dataclass
from grader.core.quantities import NS_PER_MS, NS_PER_S
from grader.core.trace import ClockKind, Delivery, LogRecord, OutputLine, Trace
from grader.judging.logs.matching import AS_SENT, chance
from grader.judging.logs.outputs import printed_lines, student_records
from grader.judging.texts import (
    SLACK_M,
    Pair,
    Printed,
    candidate_pairs,
    clean,
    printed_numbers,
    template_of,
    with_decimal_points,
)
from grader.judging.values import JITTER_NS, delivered, number_at, per_trace

#: How long a pose stays acceptable after the next one arrived: a slow loop may read from a queue.
STALE_NS = 500 * NS_PER_MS
X = "pose.pose.position.x"
Y = "pose.pose.position.y"
_NAN = float("nan")


@dataclass(frozen=True, slots=True)
class Pose:
    """One odometry message: when it was delivered, its position, and all its fields."""

    t_ns: int
    x: float
    y: float
    fields: Mapping[str, object]

    @classmethod
    def of(cls, delivery: Delivery) -> Pose:
        """Return the pose in a message."""
        fields = delivery.value
        try:
            position = fields["pose"]["pose"]["position"]
            x, y = position["x"], position["y"]
        except (KeyError, TypeError):
            x = y = None
        if type(x) is float and type(y) is float:  # the common case, and there are many
            return cls(delivery.t_ns, x, y, fields)
        return cls(delivery.t_ns, _number(fields, X), _number(fields, Y), fields)

    def at(self, path: str) -> float:
        """Return a number of the message; NaN, which matches nothing, if the path does not exist."""
        if path == X:
            return self.x
        return self.y if path == Y else _number(self.fields, path)


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """The odometry played on a topic, in order, and the start and end of the stream; compared by identity."""

    deliveries: tuple[Delivery, ...]
    times_ns: tuple[int, ...]
    start_ns: int
    stop_ns: int
    jitter_ns: int
    _spans: list[tuple[float, float]] = field(default_factory=list, init=False, repr=False)
    _made: dict[int, Pose] = field(default_factory=dict, init=False, repr=False)

    def current(self, t_ns: int) -> range:
        """Return the indices of the poses that a log written at `t_ns` may show; empty before the first."""
        stop = bisect_right(self.times_ns, t_ns + self.jitter_ns)
        start = bisect_left(self.times_ns, t_ns - STALE_NS) - 1
        return range(max(0, min(start, stop - 1)), stop)

    def pose(self, index: int) -> Pose:
        """Return a pose; poses are created on first use, because half of them are never needed."""
        pose = self._made.get(index)
        if pose is None:
            pose = self._made[index] = Pose.of(self.deliveries[index])
        return pose

    @property
    def poses(self) -> tuple[Pose, ...]:
        """All poses."""
        return tuple(map(self.pose, range(len(self.deliveries))))

    @property
    def moves(self) -> bool:
        """Whether the poses differ by more than a centimetre."""
        return bool(self.times_ns) and max(self.spans) > 0.01

    @property
    def spans(self) -> tuple[float, float]:
        """Extent of the poses in x and y, metres; at least a centimetre each, to avoid division by zero."""
        if not self._spans:
            xs, ys = [p.x for p in self.poses], [p.y for p in self.poses]
            self._spans.append((max(max(xs) - min(xs), 0.01), max(max(ys) - min(ys), 0.01)))
        return self._spans[0]


@per_trace
def track_of(trace: Trace, topic: str) -> Track | None:
    """Return the odometry played on a topic, or None if there was none."""
    played = delivered(trace, topic)
    if not played:
        return None
    times = tuple(d.t_ns for d in played)
    starts, stops = trace.marks("stream_starts", topic), trace.marks("stream_stops", topic)
    start_ns = min(starts[0].t_ns, times[0]) if starts else times[0]
    stop_ns = stops[-1].t_ns if stops else times[-1] + (times[-1] - times[0]) // max(1, len(times) - 1)
    return Track(played, times, start_ns, min(stop_ns, trace.stop_ns), JITTER_NS[trace.clock])


def _number(fields: Mapping[str, object], path: str) -> float:
    found = number_at(fields, path)
    return _NAN if found is None else found


#: Output written within this time is one block; in virtual time, output of exactly one instant.
_BLOCK_NS = {ClockKind.VIRTUAL: 0, ClockKind.WALL: 10 * NS_PER_MS}
Wanted = Callable[[Pose], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Text:
    """A text that a process wrote at one instant."""

    t_ns: int
    text: str


@dataclass(frozen=True, slots=True)
class Entry:
    """One parsed text of a group; `right` if its pair shows a current pose."""

    t_ns: int
    text: str
    numbers: tuple[Printed, ...]
    right: bool = False


@dataclass(frozen=True, slots=True)
class Group:
    """All texts of one template, and the index pair that shows a current pose most often.

    `pair` is None if the texts hold fewer than two numbers.
    """

    pairs: tuple[Pair, ...]
    entries: tuple[Entry, ...]
    pair: Pair | None = None

    @property
    def right(self) -> int:
        """Number of texts that show a current pose."""
        return sum(e.right for e in self.entries)

    @property
    def share(self) -> float:
        """Share of the texts that show a current pose."""
        return self.right / len(self.entries)


def position(pose: Pose) -> tuple[float, float]:
    """Return the expected numbers: x and y."""
    return pose.x, pose.y


def blocks(outputs: Iterable[LogRecord | OutputLine], clock: ClockKind) -> list[Text]:
    """Return the output of each instant as one text: three lines per message count as one."""
    joined: list[tuple[int, list[str]]] = []
    for output in outputs:
        if joined and output.t_ns - joined[-1][0] <= _BLOCK_NS[clock]:
            joined[-1][1].append(output.text)
        else:
            joined.append((output.t_ns, [output.text]))
    return [Text(t_ns, clean("\n".join(texts))) for t_ns, texts in joined]


def grouped(texts: Iterable[Text], *, decimal_comma: bool = False) -> list[Group]:
    """Return texts that hold a number, grouped by template in order of appearance."""
    pairs: dict[str, tuple[Pair, ...]] = {}
    members: dict[str, list[Entry]] = {}
    for text in texts:
        body = (with_decimal_points(text.text) or text.text) if decimal_comma else text.text
        numbers = printed_numbers(body)
        if not numbers:
            continue
        template = template_of(body, numbers)
        if template not in pairs:
            pairs[template] = candidate_pairs(body, numbers)
        members.setdefault(template, []).append(Entry(text.t_ns, text.text, numbers))
    return [Group(pairs[template], tuple(entries)) for template, entries in members.items()]


def matched(group: Group, track: Track, wanted: Wanted = position) -> Group:
    """Return the group with its best pair chosen and every text judged by that pair."""
    if not group.pairs:
        return group
    hits = [_hits(entry, group.pairs, track, wanted) for entry in group.entries]
    counts = {pair: sum(pair in h for h in hits) for pair in group.pairs}
    best = max(group.pairs, key=lambda pair: counts[pair])
    entries = tuple(Entry(e.t_ns, e.text, e.numbers, right=best in h) for e, h in zip(group.entries, hits, strict=True))
    return Group(group.pairs, entries, best)


def _hits(entry: Entry, pairs: Sequence[Pair], track: Track, wanted: Wanted) -> set[Pair]:
    """Return the pairs that show a current pose; both numbers must belong to the same pose."""
    current = track.current(entry.t_ns)
    newest = _among(entry, pairs, [wanted(track.pose(current[-1]))])
    # nearly every log shows the newest pose, and comparing with a dozen older ones takes long
    return newest if len(newest) == len(pairs) else _among(entry, pairs, [wanted(track.pose(k)) for k in current])


def _among(entry: Entry, pairs: Sequence[Pair], targets: Sequence[tuple[float, float]]) -> set[Pair]:
    wanted_first, wanted_second = [a for a, _ in targets], [b for _, b in targets]
    firsts = {i: _shown_by(entry.numbers[i], wanted_first) for i in {i for i, _ in pairs}}
    seconds = {j: _shown_by(entry.numbers[j], wanted_second) for j in {j for i, j in pairs if firsts[i]}}
    return {(i, j) for i, j in pairs if firsts[i] and firsts[i] & seconds[j]}


def _shown_by(number: Printed, values: Sequence[float]) -> int:
    """Return a bit set of the values that the number shows."""
    far = number.step + SLACK_M
    if number.value < min(values) - far or number.value > max(values) + far:
        return 0
    bits = 0
    for place, value in enumerate(values):
        if number.shows(value):
            bits |= 1 << place
    return bits


#: Minimum share of right texts for a template to count as a position log.
_POSITION_SHARE = 0.5
#: Streams longer than this need more than one or two logs.
_LONG_STREAM_NS = 5 * NS_PER_S
_FEWEST_IN_LONG_STREAM = 3
#: Up to this many templates are normal for a program with several wordings; more suggest that it varies its text.
_FEW_WORDINGS = 3
#: Maximum share of right templates that chance may explain.
_LUCK = 0.3


@dataclass(frozen=True, slots=True)
class Analysis:
    """The position logs among the texts of one source.

    Attributes:
        groups: Every template with a number, matched.
        right: Texts that show a pose that was current, in order.
        wrong: Texts of the same templates that show none, in order.
        needed: Number of instants that need a right text.
        by_chance: Whether positions appear only because the texts hold so many numbers; then none counts as right.
    """

    groups: tuple[Group, ...] = ()
    right: tuple[Entry, ...] = ()
    wrong: tuple[Entry, ...] = ()
    needed: int = 1
    by_chance: bool = False

    @property
    def times_ns(self) -> tuple[int, ...]:
        """The instants at which a position was logged, right or wrong, without duplicates."""
        return tuple(sorted({e.t_ns for e in (*self.right, *self.wrong)}))

    @property
    def met(self) -> bool:
        """Whether every position log is right, and there are enough of them."""
        return not self.wrong and len({e.t_ns for e in self.right}) >= self.needed


@per_trace
def logged_positions(trace: Trace, process: str, track: Track) -> Analysis:
    """Return the positions that a process wrote through its logger."""
    return _analysed(student_records(trace, process), track, trace.clock)


def printed_positions(trace: Trace, process: str, track: Track) -> Analysis:
    """Return the positions that a process printed."""
    return _analysed(printed_lines(trace, process), track, trace.clock)


def _analysed(outputs: Sequence[LogRecord | OutputLine], track: Track, clock: ClockKind) -> Analysis:
    """Return the best interpretation: text by text or block by block, with decimal points or decimal commas."""
    during = [o for o in outputs if o.t_ns >= track.times_ns[0]]
    best = Analysis(needed=_needed(track))
    singly, together = [Text(o.t_ns, clean(o.text)) for o in during], blocks(during, clock)
    for texts in (singly, together) if len(together) < len(singly) else (singly,):
        for decimal_comma in (False, True):
            found = _judged(texts, track, decimal_comma=decimal_comma)
            if found.met:
                return found
            if (len(found.right), len(found.groups)) > (len(best.right), len(best.groups)) or not best.groups:
                best = found
            if not any("," in t.text for t in texts):
                break
    return best


def _judged(texts: Sequence[Text], track: Track, *, decimal_comma: bool) -> Analysis:
    groups = tuple(matched(g, track) for g in grouped(texts, decimal_comma=decimal_comma))
    chosen = [g for g in groups if g.right and g.share >= _POSITION_SHARE]
    if (
        chosen
        and track.moves
        and len(groups) > _FEW_WORDINGS
        and sum(_luck(g, track) for g in groups) > _LUCK * len(chosen)
    ):
        return Analysis(groups, needed=_needed(track), by_chance=True)
    entries = sorted((e for g in chosen for e in g.entries), key=lambda e: e.t_ns)
    settled_ns = track.times_ns[0] + STALE_NS
    right = tuple(e for e in entries if e.right)
    # a timer that fires before the first message arrives shows the node's initial values
    wrong = tuple(e for e in entries if not e.right and e.t_ns > settled_ns)
    return Analysis(groups, right, wrong, _needed(track))


def _luck(group: Group, track: Track) -> float:
    """Return how many pairs of a template are expected to show positions by chance, over all of its texts."""
    if not group.pairs:
        return 0.0
    first, second = group.pair or group.pairs[0]
    steps = [(e.numbers[first].step, e.numbers[second].step) for e in group.entries]
    both = chance(max(x for x, _ in steps), track.spans[0], AS_SENT)
    both *= chance(max(y for _, y in steps), track.spans[1], AS_SENT)
    told = {(e.numbers[first].value, e.numbers[second].value) for e in group.entries}
    return float(len(group.pairs) * both ** len(told))


def _needed(track: Track) -> int:
    return _FEWEST_IN_LONG_STREAM if track.stop_ns - track.start_ns > _LONG_STREAM_NS else 1
