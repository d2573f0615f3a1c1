"""Finds what wrong position logs show instead: swapped numbers, only one, the twist, an old pose, and so on."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

from grader.core.dataclass import dataclass
from grader.core.quantities import counted
from grader.judging.position_logs import STALE_NS, Analysis, Entry, Group, Pose, Track, Wanted, X, Y, matched
from grader.judging.texts import Pair, Printed
from grader.judging.wording import moment, number, quote, span

#: Minimum share of a template's texts that must show the same mistake for it to be reported.
_SURE = 0.8
#: Maximum number of a template's texts that are examined for a cause.
_SAMPLE = 40
#: Maximum number of a template's pairs that are compared with older poses.
_MOST_PAIRS = 12
_TWIST = "twist.twist.linear"
_TURN = "twist.twist.angular.z"
_TURNED = "pose.pose.orientation"
_POSITION_HINT = "the position is msg.pose.pose.position: log its x and its y"
_SWAP_HINT = "log msg.pose.pose.position.x as x and msg.pose.pose.position.y as y"


@dataclass(frozen=True, slots=True)
class Cause:
    """What the logs show instead of the position: a word for evidence, and a clause to follow a place and a colon."""

    name: str
    sentence: str
    hint: str = ""


@dataclass(frozen=True, slots=True)
class _Variant:
    name: str
    first: str
    second: str
    sentence: str
    hint: str = _POSITION_HINT
    signs: tuple[int, int] = (1, 1)
    absolute: bool = False

    def wanted(self) -> Wanted:
        def numbers_of(pose: Pose) -> tuple[float, float]:
            first, second = self.signs[0] * pose.at(self.first), self.signs[1] * pose.at(self.second)
            return (abs(first), abs(second)) if self.absolute else (first, second)

        return numbers_of


_SIGN_HINT = "log the position as it is, without a change of sign"
_VARIANTS = (
    _Variant("swapped", Y, X, "x and y are swapped", _SWAP_HINT),
    _Variant("sign", X, Y, "the sign of x is the wrong way round", _SIGN_HINT, (-1, 1)),
    _Variant("sign", X, Y, "the sign of y is the wrong way round", _SIGN_HINT, (1, -1)),
    _Variant("sign", X, Y, "the signs of x and y are the wrong way round", _SIGN_HINT, (-1, -1)),
    _Variant("sign", X, Y, "x and y have lost their signs", _SIGN_HINT, absolute=True),
    _Variant("twist", f"{_TWIST}.x", f"{_TWIST}.y", "the logged values are the linear velocity (twist), not the pose"),
    _Variant("twist", f"{_TWIST}.x", _TURN, "the logged values are the velocities (twist), not the pose"),
    _Variant("orientation", f"{_TURNED}.x", f"{_TURNED}.y", "the logged values are x and y of the orientation"),
    _Variant("orientation", f"{_TURNED}.z", f"{_TURNED}.w", "the logged values are z and w of the orientation"),
    _Variant("no_y", X, "pose.pose.position.z", "the second value is z of the position, not y", _SWAP_HINT),
    _Variant("no_x", Y, "pose.pose.position.z", "the values are y and z of the position, not x and y", _SWAP_HINT),
)
_SINGLES = (
    ("only_x", X, "only x is logged, y is missing", "log y too: msg.pose.pose.position.y"),
    ("only_y", Y, "only y is logged, x is missing", "log x too: msg.pose.pose.position.x"),
)


def cause_of(analysis: Analysis, track: Track) -> Cause:
    """Return the cause that explains what the texts show, or at least where they first differ."""
    if analysis.by_chance:
        return _chance(analysis)
    sampled = [_sample(g) for g in analysis.groups]
    if analysis.right and analysis.wrong:  # a position log most of the time, so it shows nothing else
        return _first_difference(analysis, track)
    likely = _few(analysis) or _constant(sampled, track)
    if likely is None:
        likely = _variant(sampled, track) or _single(sampled, track) or _stale(sampled, track)
    return likely or _first_difference(analysis, track)


def _chance(analysis: Analysis) -> Cause:
    numbers = sum(len(e.numbers) for g in analysis.groups for e in g.entries)
    text = f"{counted(numbers, 'number')} in {counted(len(analysis.groups), 'sentence')} of different wording, "
    return Cause("chance", f"{text}some of which show the position by chance", _POSITION_HINT)


def _sample(group: Group) -> Group:
    step = max(1, len(group.entries) // _SAMPLE)
    return Group(group.pairs, group.entries[::step], group.pair)


def _few(analysis: Analysis) -> Cause | None:
    times = {e.t_ns for e in analysis.right}
    if not times or analysis.wrong:
        return None
    first = moment(min(times))
    found = f"the position is logged once only, at {first}" if len(times) == 1 else f"only {len(times)} position logs"
    hint = "log again and again: from a timer or a throttled callback"
    return Cause("few", f"{found}, expected one every second", hint)


def _variant(groups: Sequence[Group], track: Track) -> Cause | None:
    for variant in _VARIANTS:
        wanted = variant.wanted()
        sure = next((g for g in groups if g.pairs and _sure(matched(g, track, wanted))), None)
        if sure is not None:
            first = next((e for e in sure.entries if e.t_ns > track.times_ns[0] + STALE_NS), sure.entries[0])
            return Cause(variant.name, f"{variant.sentence}: {_difference(first, track)}", variant.hint)
    return None


def _sure(group: Group) -> bool:
    return group.right >= 2 and group.share >= _SURE


def _single(groups: Sequence[Group], track: Track) -> Cause | None:
    """Return a cause if only x or only y is logged, in groups whose numbers never show the other."""
    for name, path, sentence, hint in _SINGLES:
        for group in groups:
            places = range(min(len(e.numbers) for e in group.entries))
            if len(group.entries) >= 2 and any(_follows(group, place, path, track) for place in places):
                return Cause(name, sentence, hint)
    return None


def _follows(group: Group, place: int, path: str, track: Track) -> bool:
    """Return whether the number at an index nearly always shows a changing value of the current pose."""
    shown = [any(e.numbers[place].shows(track.pose(k).at(path)) for k in track.current(e.t_ns)) for e in group.entries]
    changes = len({e.numbers[place].value for e in group.entries}) > 1
    return changes and sum(shown) >= _SURE * len(shown)


def _constant(groups: Sequence[Group], track: Track) -> Cause | None:
    """Return a cause if the same pair is logged all the time although the robot moved."""
    if not track.moves:
        return None
    for group in groups:
        for pair in group.pairs[:1] if group.pair is None else (group.pair,):
            shown = [_shown(e, pair) for e in group.entries]
            if len(shown) >= 3 and len(set(shown)) == 1 and max(n.step for n in _pair(group.entries[0], pair)) < 1:
                return _constant_cause(group.entries[0], pair, track)
    return None


def _constant_cause(entry: Entry, pair: Pair, track: Track) -> Cause:
    first, second = _pair(entry, pair)
    start = track.pose(0)
    text = f"the logged values never change: ({number(first.value)}, {number(second.value)})"
    if first.shows(start.at(X)) and second.shows(start.at(Y)):
        hint = "store the newest message in the callback, each time"
        return Cause("first_value", f"{text}, the position of the first message", hint)
    if first.value == 0.0 and second.value == 0.0:
        return Cause("constant", text, "assign msg.pose.pose.position.x and .y to what you log, in the callback")
    return Cause("constant", text, "log the position of the newest message")


def _stale(groups: Sequence[Group], track: Track) -> Cause | None:
    """Return by how much the logged poses lag, if each of them was current at some time."""
    for group in groups:
        for pair in group.pairs[:_MOST_PAIRS]:
            lags = [_lag_ns(e, pair, track) for e in group.entries]
            known = [lag for lag in lags if lag is not None]
            fine = all(n.step <= 0.1 for e in group.entries for n in _pair(e, pair))
            if fine and len(known) >= max(3, _SURE * len(lags)) and statistics.median(known) > STALE_NS:
                late = span(round(statistics.median(known)))
                hint = "process messages as they arrive: a slow loop or a long queue delays them"
                return Cause("stale", f"the logged positions are {late} old", hint)
    return None


def _lag_ns(entry: Entry, pair: Pair, track: Track) -> int | None:
    first, second = _pair(entry, pair)
    for k in reversed(range(track.current(entry.t_ns).stop)):
        pose = track.pose(k)
        if first.shows(pose.at(X)) and second.shows(pose.at(Y)):
            return entry.t_ns - pose.t_ns
    return None


def _first_difference(analysis: Analysis, track: Track) -> Cause:
    if analysis.wrong:
        total = len(analysis.wrong) + len(analysis.right)
        return Cause("wrong", f"{_difference(analysis.wrong[0], track)}; {len(analysis.wrong)} of {total} are wrong")
    paired = max((g for g in analysis.groups if g.pairs), key=lambda g: len(g.entries), default=None)
    if paired is not None:
        return Cause("wrong", _difference(paired.entries[0], track), _POSITION_HINT)
    hint = "log both numbers in one record: f'x={x:.2f}, y={y:.2f}'"
    return Cause("no_pair", "no log holds two numbers" if analysis.groups else "no log holds a number", hint)


def _difference(entry: Entry, track: Track) -> str:
    pose = track.pose(track.current(entry.t_ns).stop - 1)
    there = f"({pose.at(X):.3f}, {pose.at(Y):.3f}) m"
    return f"at {moment(entry.t_ns)} the log says '{quote(entry.text, 80)}', the position was {there}"


def _pair(entry: Entry, pair: Pair) -> tuple[Printed, Printed]:
    return entry.numbers[pair[0]], entry.numbers[pair[1]]


def _shown(entry: Entry, pair: Pair) -> tuple[float, float]:
    first, second = _pair(entry, pair)
    return first.value, second.value
