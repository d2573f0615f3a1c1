"""The check on transforms between frames, as tf2 publishes them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from grader.core.exercise import Finding
from grader.core.quantities import Hertz, seconds, within
from grader.core.trace import Message, Trace
from grader.judging.findings import met, not_met
from grader.judging.paths import number_at, text_at
from grader.judging.silence import explain_no_message, fault_hint, first_fault
from grader.judging.values import published
from grader.judging.wording import counted, fault_sentence, listed, moment, number, numbers, quote

_AXES = ("x", "y", "z")
_QUATERNION = ("x", "y", "z", "w")


@dataclass(frozen=True, slots=True)
class _Found:
    """One transform of a message."""

    t_ns: int
    value: Mapping[str, Any]

    @property
    def frames(self) -> tuple[str, str]:
        parent, child = text_at(self.value, "header.frame_id"), text_at(self.value, "child_frame_id")
        return (parent or "").lstrip("/"), (child or "").lstrip("/")

    def numbers(self, part: str, names: tuple[str, ...]) -> list[float]:
        found = [number_at(self.value, f"transform.{part}.{name}") for name in names]
        return [math.nan if f is None else f for f in found]


@dataclass(frozen=True, slots=True)
class Transform:
    """The transform from a parent frame to a child frame is published, with the translation and rotation named.

    Every one that is published has to be right. A quaternion and its negative are the same rotation.

    Attributes:
        parent: Frame that the transform is given in, e.g. `odom`.
        child: Frame whose place it tells, e.g. `base_link`.
        static: Whether it must be on `/tf_static`, or on `/tf`; either if left out.
        translation: Metres along `x`, `y` and `z` expected; those left out are free.
        rotation: Quaternion expected, `x`, `y`, `z` and `w`; those left out are 0. Free if there is none.
        tolerance: Largest difference of each number.
        rate: Rate expected; free if left out.
        rate_tolerance: Largest difference of the rate.
    """

    parent: str
    child: str
    static: bool | None = None
    translation: Mapping[str, float] | None = None
    rotation: Mapping[str, float] | None = None
    tolerance: float = 1e-3
    rate: Hertz | None = None
    rate_tolerance: Hertz = 1.0

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        rate = "" if self.rate is None else f" at {number(self.rate)} ± {number(self.rate_tolerance)} Hz"
        return f"the transform {self.parent} → {self.child} on {' or '.join(self._topics)}{rate}"

    @property
    def _topics(self) -> tuple[str, ...]:
        return {True: ("/tf_static",), False: ("/tf",), None: ("/tf", "/tf_static")}[self.static]

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if it is there and always right; the reason names the first that is not."""
        found = [_Found(m.t_ns, t) for topic in self._topics for m in published(trace, topic) for t in _transforms(m)]
        wanted = (self.parent.lstrip("/"), self.child.lstrip("/"))
        mine = sorted((f for f in found if f.frames == wanted), key=lambda f: f.t_ns)
        if not mine:
            return self._absent(trace, found)
        evidence = {"transforms": len(mine), "first_s": seconds(mine[0].t_ns), "last_s": seconds(mine[-1].t_ns)}
        for one in mine:
            flaw = self._flaw(one)
            if flaw:
                reason = f"{moment(one.t_ns)}, {self.parent} → {self.child}: {flaw}"
                return not_met(reason, evidence | {"first_wrong_s": seconds(one.t_ns)})
        pace = self._pace_flaw(mine)
        said = f"{self.parent} → {self.child}: {counted(len(mine), 'transform')}"
        if not pace:
            return met(said, evidence)
        fault = first_fault(trace)
        if fault is not None:
            return not_met(f"{said}, {pace}; {fault_sentence(fault)}", evidence, hint=fault_hint(fault), fault=fault)
        return not_met(f"{said}, {pace}", evidence)

    def _flaw(self, one: _Found) -> str:
        got = one.numbers("translation", _AXES)
        for name, value in zip(_AXES, got, strict=True):
            wanted = (self.translation or {}).get(name)
            if wanted is not None and not within(value, wanted, self.tolerance):
                return f"translation {name} is {number(value)} m, expected {number(wanted)} m"
        if self.rotation is None:
            return ""
        asked = [self.rotation.get(name, 0.0) for name in _QUATERNION]
        turned = one.numbers("rotation", _QUATERNION)
        same = any(all(within(g, s * w, self.tolerance) for g, w in zip(turned, asked, strict=True)) for s in (1, -1))
        return "" if same else f"rotation is ({numbers(turned)}), expected ({numbers(asked)}) as x, y, z, w"

    def _pace_flaw(self, mine: list[_Found]) -> str:
        if self.rate is None:
            return ""
        length = seconds(mine[-1].t_ns - mine[0].t_ns)
        rate = (len(mine) - 1) / length if length else 0.0
        if within(rate, self.rate, self.rate_tolerance):
            return ""
        return f"{rate:.3f} Hz, expected {number(self.rate)} ± {number(self.rate_tolerance)} Hz"

    def _absent(self, trace: Trace, found: list[_Found]) -> Finding:
        if not found:
            other = {"/tf": "/tf_static", "/tf_static": "/tf"}.get(self._topics[0]) if self.static is not None else None
            if other and published(trace, other):
                reason = f"{self._topics[0]}: no transform; there are some on {other}"
                return not_met(reason, hint=f"publish it on {self._topics[0]}")
            return explain_no_message(trace, self._topics[0])
        pairs = list(dict.fromkeys(f"{quote(p, 30)} → {quote(c, 30)}" for p, c in (f.frames for f in found)))
        reason = f"no transform {self.parent} → {self.child}; found {listed(pairs)}"
        swapped = any(f.frames == (self.child.lstrip("/"), self.parent.lstrip("/")) for f in found)
        hint = f"header.frame_id is the parent, {self.parent}, and child_frame_id is {self.child}" if swapped else ""
        return not_met(reason, {"found": pairs[:20]}, hint=hint)


def _transforms(message: Message) -> list[Mapping[str, Any]]:
    found = message.value.get("transforms")
    return [t for t in found if isinstance(t, Mapping)] if isinstance(found, (list, tuple)) else []
