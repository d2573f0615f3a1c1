"""Finds numbers in logged texts, and decides which of them are an x and a y."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from itertools import combinations

from grader.core.dataclass import dataclass

#: Longest text that is read, in characters; a printed odometry message has about 3,000.
LONGEST_TEXT = 8_000
#: Maximum number of numbers read from one text.
MOST_NUMBERS = 160
#: Relative difference that single precision explains, but printing does not.
SLACK_M = 2e-6
_ANSI = re.compile(r"\x1b\[[0-9;?]*[ -/]*[@-~]")
_MINUS = dict.fromkeys((0x2212, 0x2010, 0x2011, 0x2012, 0x2013, 0xFE63, 0xFF0D), "-")
_NUMBER = re.compile(
    r"(?P<hex>0[xX][0-9a-fA-F]+)"
    r"|(?:(?<![0-9.])(?P<sign>[+-]))?"
    r"(?:(?P<whole>[0-9]+)(?:\.(?P<part>[0-9]*))?|\.(?P<only>[0-9]+))(?:[eE](?P<power>[+-]?[0-9]{1,3})(?![0-9]))?"
    r"|(?<![A-Za-z0-9_])[+-]?(?P<odd>nan|inf|infinity)(?![A-Za-z0-9_])",
    re.IGNORECASE,
)
_DECIMAL_COMMA = re.compile(r"(?<![0-9.,])([0-9]+),([0-9]+)(?![0-9]*[.,][0-9])")
_NAME_BEFORE = re.compile(r"[A-Za-z_À-ɏ]+$")
#: Characters before most numbers that cannot end a name, so the text before them needs no further check.
_NO_NAME = frozenset(" =:,([")
_UNIT_AFTER = re.compile(r"\s?(cm|mm)(?![A-Za-z0-9])")
_PER_METRE = {"cm": 0.01, "mm": 0.001}


@dataclass(frozen=True, slots=True)
class Printed:
    """A printed number.

    Attributes:
        value: The number; not finite for a printed nan or inf.
        step: Value of one unit of its last digit.
    """

    value: float
    step: float
    start: int
    stop: int

    def shows(self, value: float) -> bool:
        """Return whether `value` prints as this number: rounded, truncated or rounded down to its last digit."""
        excess = value - self.value
        below = self.step if value <= 0 and self.value <= 0 else self.step / 2
        return -below - SLACK_M <= excess <= self.step + SLACK_M


def clean(text: str) -> str:
    """Return a text with one kind of minus sign and digits, and without terminal colours."""
    text = text[:LONGEST_TEXT]
    if "\x1b" in text:
        text = _ANSI.sub("", text)
    return text if text.isascii() else unicodedata.normalize("NFKC", text.translate(_MINUS)).translate(_MINUS)


def with_decimal_points(text: str) -> str | None:
    """Return the text with `1,25` read as `1.25`, or None if it has no such number."""
    if "," not in text:
        return None
    changed = _DECIMAL_COMMA.sub(r"\1.\2", text)
    return changed if changed != text else None


def printed_numbers(text: str) -> tuple[Printed, ...]:
    """Return the numbers of a cleaned text in order; digits in a name such as `odom1` are not numbers."""
    found: list[Printed] = []
    for match in _NUMBER.finditer(text):
        number = _read(text, match)
        if number is not None:
            found.append(number)
        if len(found) == MOST_NUMBERS:
            break
    return tuple(found)


def _read(text: str, match: re.Match[str]) -> Printed | None:
    hexadecimal, sign, _, part, only, power, odd = match.groups()
    if hexadecimal:
        return None
    if odd:
        return Printed(float(match[0]), 0.0, match.start(), match.end())
    if not sign and _belongs_to_name(text, match):
        return None
    decimals = len(part or only or "")
    # 0e9 must not match every number
    step = 10.0 ** min(0, int(power or 0) - decimals)
    scale = 1.0
    unit = _UNIT_AFTER.match(text, match.end())
    if unit:
        scale = _PER_METRE[unit[1]]
    return Printed(float(match[0]) * scale, step * scale, match.start(), match.end())


def _belongs_to_name(text: str, match: re.Match[str]) -> bool:
    if text[match.start() - 1 : match.start()] in _NO_NAME:
        return False
    before = _NAME_BEFORE.search(text, max(0, match.start() - 40), match.start())
    if before is None:
        return False
    if "." in match[0].rstrip("."):
        return False  # names contain no decimal fractions
    label = before[0].lower() in ("x", "y", "z")
    return not label or re.match(r"\s*[:=]", text[match.end() : match.end() + 4]) is not None


#: Maximum number of numbers among which unlabelled pairs are searched.
_MOST_UNLABELLED = 20
_MOST_LABELLED_PAIRS = 60
#: Number of numbers after a list of labels that the list may refer to.
_MOST_AFTER_LIST = 6
_WORD = re.compile(r"[A-Z]+(?![a-zà-ɏ])|[A-ZÀ-ɏ]?[a-zà-ɏ]+|[A-Z]")
_LABELS = {
    **dict.fromkeys(("x", "px", "posx", "xpos", "coordx", "xcoord", "xx"), "x"),
    **dict.fromkeys(("y", "py", "posy", "ypos", "coordy", "ycoord", "yy"), "y"),
    **dict.fromkeys(("z", "pz", "posz", "zpos", "coordz", "zcoord"), "z"),
    "xy": "xy",
    "xyz": "xyz",
}
#: Words that may appear inside a list of labels such as `pos_x and pos_y (m)`.
_FILLERS = frozenset({"and", "e", "et", "und", "i", "ed", "pos", "position", "coord", "coordinate", "coords", "p"})
_FILLERS |= {"odom", "robot", "pose", "m", "meter", "meters", "metre", "metres", "msg", "axis", "eje", "axe"}
_FILLERS |= {"current", "the"}
Pair = tuple[int, int]
Assignment = list[str]


def template_of(text: str, numbers: Sequence[Printed]) -> str:
    """Return the text with every number replaced by `#` and without white space."""
    parts = _segments(text, numbers)
    return "#".join("".join(part.split()) for part in parts)


def candidate_pairs(text: str, numbers: Sequence[Printed]) -> tuple[Pair, ...]:
    """Return the index pairs that are (x, y) by their labels; without labels, all in order of appearance."""
    parts = _segments(text, numbers)
    nearest = [(_labels_in(part) or [""])[-1] for part in parts[:-1]]
    ways = [_by_run(parts), nearest, _by_suffix(parts)]
    complete = [w for w in ways if "x" in w and "y" in w]
    plain = range(min(len(numbers), _MOST_UNLABELLED))
    if not complete:
        return tuple(combinations(plain, 2))
    pairs = [*(pair for way in complete for pair in _labelled_pairs(way)), *_listed_pairs(parts)]
    pairs = pairs[:_MOST_LABELLED_PAIRS]
    bare = [i for i in plain if not any(way[i] for way in complete)]
    return tuple(dict.fromkeys([*pairs, *combinations(bare, 2)]))


def _segments(text: str, numbers: Sequence[Printed]) -> list[str]:
    """Return the text before, between and after the numbers: one segment more than there are numbers."""
    starts = [0] + [n.stop for n in numbers]
    stops = [n.start for n in numbers] + [len(text)]
    return [text[a:b] for a, b in zip(starts, stops, strict=True)]


def _labels_in(segment: str) -> list[str]:
    return [label for word in _WORD.findall(segment) for label in _LABELS.get(word.lower(), "")]


def _last_run(segment: str) -> list[str]:
    """Return the last list of labels in a segment: `the x of (x, y) = ` gives x and y."""
    run: list[str] = []
    unbroken = False
    for word in _WORD.findall(segment):
        labels = list(_LABELS.get(word.lower(), ""))
        if labels:
            again = any(label in run[:-1] for label in labels)
            run = [*run, *labels] if unbroken and not again else labels
            unbroken = True
        elif word.lower() not in _FILLERS:
            unbroken = False
    return [label for i, label in enumerate(run) if i == 0 or run[i - 1] != label]


def _by_run(parts: list[str]) -> Assignment:
    """Assign each list of labels to the numbers that follow it, in order."""
    waiting: list[str] = []
    given: Assignment = []
    for part in parts[:-1]:
        waiting = _last_run(part) or waiting
        given.append(waiting[0] if waiting else "")
        waiting = waiting[1:]
    return given


def _listed_pairs(parts: list[str]) -> list[Pair]:
    """Return pairs in the order of a list of labels apart from its numbers: `(x, y) at 12 s: 1, 2`."""
    pairs: list[Pair] = []
    for here, part in enumerate(parts[:-1]):
        run = _last_run(part)
        if "x" not in run or "y" not in run:
            continue
        labelled = (k for k in range(here + 1, len(parts) - 1) if _labels_in(parts[k]))
        span = range(here, min(next(labelled, len(parts) - 1), here + _MOST_AFTER_LIST))
        forward = run.index("x") < run.index("y")
        pairs += [(i, j) if forward else (j, i) for i, j in combinations(span, 2)]
    return pairs


def _by_suffix(parts: list[str]) -> Assignment:
    """Assign to each number the first label after it, if there is no label before the first number."""
    if not parts or _labels_in(parts[0]) or not _labels_in(parts[-1]):
        return [""] * (len(parts) - 1)
    return [(_labels_in(part) or [""])[0] for part in parts[1:]]


def _labelled_pairs(given: Assignment) -> list[Pair]:
    pairs: list[Pair] = []
    xs = [i for i, label in enumerate(given) if label == "x"]
    ys = [i for i, label in enumerate(given) if label == "y"]
    for here, following in zip(xs, [*xs[1:], len(given)], strict=True):
        after = next((j for j in ys if here < j < following), None)
        before = next((j for j in reversed(ys) if j < here), None)
        partner = after if after is not None else before
        if partner is not None:
            pairs.append((here, partner))
    return pairs
