"""Decides which texts of a process are position logs, and whether they are right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from grader.core.quantities import NS_PER_S
from grader.core.trace import ClockKind, LogRecord, OutputLine, Trace
from grader.judging.output import printed_lines, student_records
from grader.judging.positions.matching import Entry, Group, Text, blocks, grouped, matched, single_texts
from grader.judging.positions.track import STALE_NS, Track
from grader.judging.values import Same

#: Share of right texts from which on a template is taken for a position log.
_POSITION_SHARE = 0.5
#: Streams longer than this must be logged more than once or twice.
_LONG_STREAM_NS = 5 * NS_PER_S
_FEWEST_IN_LONG_STREAM = 3
#: A printed number shows positions over so many units of its last digit, with a margin.
_UNITS_SHOWN = 2
#: Up to so many wordings are those of a program that words its logs in one way or another, and not anew each time.
_FEW_WORDINGS = 3
#: Share of the right templates that chance may be expected to make right.
_LUCK = 0.3


@dataclass(frozen=True, slots=True)
class Analysis:
    """The position logs among the texts of one source.

    Attributes:
        groups: Every template with a number, matched.
        right: Texts that show a pose that was current, in order.
        wrong: Texts of the same templates that show none, in order.
        needed: How many instants with a right text it takes.
        by_chance: Whether positions stand in the texts only because so many numbers do; none of them is right then.
    """

    groups: tuple[Group, ...] = ()
    right: tuple[Entry, ...] = ()
    wrong: tuple[Entry, ...] = ()
    needed: int = 1
    by_chance: bool = False

    @property
    def times_ns(self) -> tuple[int, ...]:
        """The instants at which a position was logged, right or wrong, each once."""
        return tuple(sorted({e.t_ns for e in (*self.right, *self.wrong)}))

    @property
    def met(self) -> bool:
        """Whether every position log is right, and there are enough of them."""
        return not self.wrong and len({e.t_ns for e in self.right}) >= self.needed


def logged_positions(trace: Trace, process: str, track: Track) -> Analysis:
    """Return the positions that a process wrote through its logger."""
    key = (logged_positions, process, Same(track))
    return trace.once(key, lambda: _analysed(student_records(trace, process), track, trace.clock))


def printed_positions(trace: Trace, process: str, track: Track) -> Analysis:
    """Return the positions that a process printed."""
    return _analysed(printed_lines(trace, process), track, trace.clock)


def _analysed(outputs: Sequence[LogRecord | OutputLine], track: Track, clock: ClockKind) -> Analysis:
    """Return the best reading: text by text or block by block, with decimal points or decimal commas."""
    during = [o for o in outputs if o.t_ns >= track.times_ns[0]]
    best = Analysis(needed=_needed(track))
    singly, together = single_texts(during), blocks(during, clock)
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
    # a timer that fires while the first message is still on its way shows what the node started with
    wrong = tuple(e for e in entries if not e.right and e.t_ns > settled_ns)
    return Analysis(groups, right, wrong, _needed(track))


def _luck(group: Group, track: Track) -> float:
    """Return how many pairs of a template are expected to show positions by chance, all of its texts together."""
    if not group.pairs:
        return 0.0
    first, second = group.pair or group.pairs[0]
    steps = [(e.numbers[first].step, e.numbers[second].step) for e in group.entries]
    chance = min(1.0, _UNITS_SHOWN * max(x for x, _ in steps) / track.spans[0])
    chance *= min(1.0, _UNITS_SHOWN * max(y for _, y in steps) / track.spans[1])
    told = {(e.numbers[first].value, e.numbers[second].value) for e in group.entries}
    return float(len(group.pairs) * chance ** len(told))


def _needed(track: Track) -> int:
    return _FEWEST_IN_LONG_STREAM if track.stop_ns - track.start_ns > _LONG_STREAM_NS else 1
