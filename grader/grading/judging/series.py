"""Finds what a series of numbers follows: a formula, another one instead, or chance."""

from __future__ import annotations

import ast
import math
import operator
import statistics
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from itertools import pairwise
from types import MappingProxyType

from grader.grading.model.wording import number
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import counted, within

#: Variables of a formula: the number of a message from 0, and its time in seconds.
VARIABLES = ("n", "t")
#: A longer formula is not one that a reader of the rubric could follow.
_MOST_CHARACTERS = 200
_CONSTANTS = MappingProxyType({"pi": math.pi})
_FUNCTIONS: Mapping[str, Callable[[float], float]] = MappingProxyType(
    {
        "sin": math.sin,
        "cos": math.cos,
        "tan": math.tan,
        "exp": math.exp,
        "sqrt": math.sqrt,
        "abs": abs,
        "floor": math.floor,
    }
)
_BINARY: Mapping[type[ast.operator], Callable[[float, float], float]] = MappingProxyType(
    {
        ast.Add: operator.add,
        ast.Sub: operator.sub,
        ast.Mult: operator.mul,
        ast.Div: operator.truediv,
        ast.Pow: math.pow,
        ast.Mod: operator.mod,
    }
)
_UNARY: Mapping[type[ast.unaryop], Callable[[float], float]] = MappingProxyType(
    {ast.UAdd: operator.pos, ast.USub: operator.neg}
)
#: Functions that are often confused.
_MISTAKEN = MappingProxyType({"sin": "cos", "cos": "sin"})


class FormulaError(ValueError):
    """A text is not a formula; the message explains why."""


@dataclass(frozen=True, slots=True)
class Curve:
    """A formula as written in the rubric, and its whitelisted syntax tree."""

    text: str
    tree: ast.expr

    def at(self, n: float, t: float = 0.0) -> float:
        """Return the value at `n` and `t`; NaN if undefined, as for a root of -1."""
        return self.of({"n": n, "t": t})

    def of(self, known: Mapping[str, float]) -> float:
        """Return the value for a number of each name; NaN if undefined."""
        try:
            return _value(self.tree, known)
        except (ArithmeticError, ValueError):
            return math.nan

    @property
    def names(self) -> tuple[str, ...]:
        """The variables, or the paths of fields, in order."""
        return tuple(dict.fromkeys(name for name in _names(self.tree) if name not in _CONSTANTS))

    @property
    def mistaken(self) -> Curve | None:
        """The formula with sine and cosine exchanged, or None if it has neither."""
        tree = ast.parse(self.text, mode="eval").body
        found = [node for node in ast.walk(tree) if isinstance(node, ast.Name) and node.id in _MISTAKEN]
        for node in found:
            node.id = _MISTAKEN[node.id]
        return Curve(ast.unparse(tree), tree) if found else None


@lru_cache(maxsize=64)
def curve(text: str, *, of_fields: bool = False) -> Curve:
    """Return the formula in a text, of `n` and `t` or of the fields of a message such as `pose.x`.

    Raises:
        FormulaError: It is not a valid formula.
    """
    if len(text) > _MOST_CHARACTERS:
        raise FormulaError(f"at most {_MOST_CHARACTERS} characters")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise FormulaError("a formula such as sin(0.1 * n)") from None
    _check(tree, of_fields=of_fields)
    return Curve(text.strip(), tree)


def _is_path(node: ast.expr) -> bool:
    if isinstance(node, ast.Subscript):
        return isinstance(node.slice, ast.Constant) and type(node.slice.value) is int and _is_path(node.value)
    return isinstance(node, ast.Name) or (isinstance(node, ast.Attribute) and _is_path(node.value))


def _names(node: ast.expr) -> Iterator[str]:
    if _is_path(node):
        yield ast.unparse(node)
    else:
        inside = node.args if isinstance(node, ast.Call) else ast.iter_child_nodes(node)
        yield from (name for child in inside if isinstance(child, ast.expr) for name in _names(child))


def _check(node: ast.expr, *, of_fields: bool) -> None:
    """Raise FormulaError unless every part is allowed."""
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        _check(node.left, of_fields=of_fields)
        _check(node.right, of_fields=of_fields)
    elif isinstance(node, ast.UnaryOp) and type(node.op) in _UNARY:
        _check(node.operand, of_fields=of_fields)
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _FUNCTIONS:
        if len(node.args) != 1 or node.keywords or isinstance(node.args[0], ast.Starred):
            raise FormulaError(f"one number in the brackets of {node.func.id}")
        _check(node.args[0], of_fields=of_fields)
    elif of_fields and _is_path(node):
        pass
    elif isinstance(node, ast.Name):
        if node.id not in VARIABLES and node.id not in _CONSTANTS:
            raise FormulaError(f"n, t, pi or one of {', '.join(_FUNCTIONS)} with its brackets, found {node.id[:40]}")
    elif not (isinstance(node, ast.Constant) and type(node.value) in (int, float)):
        variables = "fields" if of_fields else "n, t"
        raise FormulaError(f"numbers, {variables}, pi, + - * / % ** and {', '.join(_FUNCTIONS)}")


def _value(node: ast.expr, known: Mapping[str, float]) -> float:
    if isinstance(node, ast.BinOp):
        return _BINARY[type(node.op)](_value(node.left, known), _value(node.right, known))
    if isinstance(node, ast.UnaryOp):
        return _UNARY[type(node.op)](_value(node.operand, known))
    if isinstance(node, ast.Call):
        assert isinstance(node.func, ast.Name)
        return float(_FUNCTIONS[node.func.id](_value(node.args[0], known)))
    if _is_path(node):
        name = ast.unparse(node)
        return known[name] if name in known else _CONSTANTS[name]
    assert isinstance(node, ast.Constant)
    return float(node.value)  # type: ignore[arg-type]  # the check above allows only numbers


#: Minimum share of the values that another formula must give for it to be reported.
_SURE = 0.97
#: Fewer values than this may follow something by chance.
_FEWEST = 5
#: Counters may start at most this far from 0.
_FURTHEST_START = 20
_DEGREES = 180 / math.pi
#: Factors by which a counter may have been multiplied or divided by mistake.
_PACES = (10.0, 2.0, 5.0, 100.0, 20.0, 4.0, 3.0, 50.0, 1.1, 1.5)
_REPEATS = (2, 3, 5, 10)
_MOST_DECIMALS = 5
_COUNT_HINT = "count the messages: n grows by 1 with each"
_FIRST_HINT = "publish first and count afterwards: the first message is n = 0"
_PACE_HINT = "compare the factor of n with the one in the task"
_RADIAN_HINT = "sine and cosine take radians: do not convert the angle"


@dataclass(frozen=True, slots=True)
class Sample:
    """One message: its number from 0, its time since the first one, and what its field holds."""

    n: int
    t_s: float
    value: float


@dataclass(frozen=True, slots=True)
class Instead:
    """What the values follow, as a clause, and a hint; both may be empty. `start` is set if only that differs."""

    said: str = ""
    hint: str = ""
    start: int | None = None


_Wanted = Callable[[Sample], float]


def followed_instead(wanted: Curve, samples: Sequence[Sample], tolerance: float) -> Instead:
    """Find what a series follows instead of a formula, if that is clear."""
    if len(samples) < _FEWEST or not all(math.isfinite(s.value) for s in samples):
        return Instead()
    if len({s.value for s in samples}) == 1:
        return Instead(f"it is {number(samples[0].value)} in every message", _COUNT_HINT)
    ways = (way for way, other in _ways(wanted) if _follow(samples, other, tolerance))
    return _scaled(wanted, samples, tolerance) or next(ways, Instead())


def _follow(samples: Sequence[Sample], other: _Wanted, tolerance: float) -> bool:
    fitting = sum(within(s.value, other(s), max(tolerance, 1e-6)) for s in samples)
    return fitting >= _SURE * len(samples)


def _at(wanted: Curve, sample: Sample, *, start: int = 0, pace: float = 1.0, repeats: int = 1) -> float:
    return wanted.at(pace * (sample.n // repeats + start), pace * sample.t_s)


def _rounded(wanted: Curve, sample: Sample, *, decimals: int) -> float:
    value = wanted.at(sample.n, sample.t_s)
    return round(value, decimals) if math.isfinite(value) else value


def _ways(wanted: Curve) -> Iterator[tuple[Instead, _Wanted]]:
    """Yield common mistakes, the most frequent first."""
    for start in (s for near in range(1, _FURTHEST_START + 1) for s in (near, -near)):
        clause = f"the values are right for a count that starts at {start}"
        yield Instead(clause, _FIRST_HINT if start == 1 else "", start), partial(_at, wanted, start=start)
    for degrees in (_DEGREES, 1 / _DEGREES):
        clause = "the angle is converted between degrees and radians before the formula"
        yield Instead(clause, _RADIAN_HINT), partial(_at, wanted, pace=degrees)
    for factor in _PACES:
        fast, slow = (f"the values go through {wanted.text} {number(factor)} times too {w}" for w in ("fast", "slowly"))
        yield Instead(fast, _PACE_HINT), partial(_at, wanted, pace=factor)
        yield Instead(slow, _PACE_HINT), partial(_at, wanted, pace=1 / factor)
    for repeats in _REPEATS:
        yield Instead(f"each value is published {repeats} times", _COUNT_HINT), partial(_at, wanted, repeats=repeats)
    if wanted.mistaken is not None:
        hint = "sine and cosine are swapped"
        yield Instead(f"the values follow {wanted.mistaken.text}", hint), partial(_at, wanted.mistaken)
    for decimals in range(_MOST_DECIMALS + 1):
        clause = f"the values are rounded to {counted(decimals, 'decimal')}"
        yield Instead(clause, "publish the value as it is"), partial(_rounded, wanted, decimals=decimals)


def _scaled(wanted: Curve, samples: Sequence[Sample], tolerance: float) -> Instead | None:
    pairs = [(s.value, wanted.at(s.n, s.t_s)) for s in samples]
    ratios = [got / want for got, want in pairs if abs(want) > 1e-3 and math.isfinite(got)]
    factor = statistics.median(ratios) if ratios else 1.0
    if math.isclose(factor, 1.0, rel_tol=1e-6) or abs(factor) < 1e-9:
        return None
    unscaled = [replace(s, value=s.value / factor) for s in samples]
    if not _follow(unscaled, partial(_at, wanted), tolerance):
        return None
    clause = f"each value is {number(factor)} times the one expected"
    if math.isclose(factor, -1.0, rel_tol=1e-6):
        return Instead(clause, "the sign is inverted")
    if any(math.isclose(factor, f, rel_tol=1e-3) for f in (_DEGREES, 1 / _DEGREES)):
        return Instead(clause, "that is the factor between degrees and radians: publish the value unconverted")
    return Instead(clause)


#: For fewer values than this, only whether they differ is checked.
FEW = 10
#: A pattern is evidence only if chance produces it less often than exp(-14), about one in a million.
_EVIDENCE = 14.0
#: Fewest steps for patterns that a short random series may have by chance.
_ENOUGH = 16
#: Largest share of the steps' variance that the two previous steps may leave unexplained in a smooth curve.
_REST = 0.05
#: The same for few steps, where a fit may be good by chance.
_REST_OF_FEW = 0.001
_MANY = 40


def pattern_of(values: Sequence[float]) -> str | None:
    """Return how the values follow from each other, as a phrase; None if they may be random.

    Every generator is accepted: uniform, whole or rounded numbers, a clipped normal distribution, a choice of a few
    values, a random walk. With fewer than `FEW` values, only whether they differ is checked.
    """
    if len(values) > 1 and len(set(values)) == 1:
        return "constant"
    if len(values) < FEW:
        return None
    period = _cycle(values)
    return _pattern(values) if period is None else f"the same {period} values over and over"


def _pattern(values: Sequence[float]) -> str | None:
    steps = [b - a for a, b in pairwise(values)]
    if _one_way(steps):
        return "a ramp: it only rises" if values[-1] > values[0] else "a ramp: it only falls"
    if _sawtooth(values, steps):
        return "a sawtooth"
    if _few_turns(steps) or _predictable(steps):
        return "a smooth curve"
    return None


def _cycle(values: Sequence[float]) -> int | None:
    """Return the period of a repeating series, unless chance explains it."""
    shares = Counter(values)
    log_chance = -math.log(sum((n / len(values)) ** 2 for n in shares.values()))
    for period in range(2, len(values) // 2 + 1):
        compared = len(values) - period
        if compared * log_chance < _EVIDENCE:
            return None
        if all(math.isclose(a, b, abs_tol=1e-6) for a, b in zip(values, values[period:], strict=False)):
            return period
    return None


def _one_way(steps: Sequence[float]) -> bool:
    rising, falling = all(s >= 0 for s in steps), all(s <= 0 for s in steps)
    moving = sum(s != 0 for s in steps)
    even = all(math.isclose(s, steps[0], rel_tol=1e-3, abs_tol=1e-6) for s in steps)
    return (rising or falling) and (moving >= _ENOUGH or (even and moving > FEW))


def _sawtooth(values: Sequence[float], steps: Sequence[float]) -> bool:
    """Return whether there is one small step and one jump back, which comes exactly when the step would go too far."""
    kinds = Counter(round(s, 4) for s in steps).most_common(2)
    if len(steps) < _ENOUGH or len(kinds) < 2 or sum(n for _, n in kinds) < len(steps) - 1:
        return False
    usual, jump = kinds[0][0], kinds[1][0]
    if usual * jump >= 0 or math.isclose(usual, -jump, rel_tol=0.05):
        return False
    before_usual = [v for v, s in zip(values, steps, strict=False) if s * usual > 0]
    before_jump = [v for v, s in zip(values, steps, strict=False) if s * jump > 0]
    if usual > 0:
        return max(before_usual) < min(before_jump) + 1e-6
    return min(before_usual) > max(before_jump) - 1e-6


def _few_turns(steps: Sequence[float]) -> bool:
    """Return whether the series turns much less often than with independent steps: by five deviations."""
    signs = [s > 0 for s in steps if s != 0]
    turns = sum(a != b for a, b in pairwise(signs))
    pairs = len(signs) - 1
    return pairs >= _ENOUGH and turns < pairs / 2 - 2.5 * math.sqrt(pairs)


def _predictable(steps: Sequence[float]) -> bool:
    """Return whether each step is a fixed combination of the two previous ones, as in any sampled sine."""
    if len(steps) < _ENOUGH:
        return False
    mean = sum(steps) / len(steps)
    d = [s - mean for s in steps]
    rows = list(zip(d[2:], d[1:], d, strict=False))
    total = sum(y * y for y, _, _ in rows)
    aa, bb = sum(a * a for _, a, _ in rows), sum(b * b for _, _, b in rows)
    ab = sum(a * b for _, a, b in rows)
    ya, yb = sum(y * a for y, a, _ in rows), sum(y * b for y, _, b in rows)
    det = aa * bb - ab * ab
    if total <= 0.0 or det <= 1e-9 * aa * bb:
        return False
    p, q = (ya * bb - yb * ab) / det, (yb * aa - ya * ab) / det
    rest = sum((y - p * a - q * b) ** 2 for y, a, b in rows)
    return rest <= (_REST if len(steps) >= _MANY else _REST_OF_FEW) * total
