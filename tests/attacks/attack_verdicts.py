"""What attacks may earn: outcomes by criterion, and what a node has to say about its own attempts."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

MET, NOT_MET = frozenset({"met"}), frozenset({"not_met", "blocked"})
ANYTHING = frozenset({"met", "partly", "not_met", "blocked"})
#: A node that does what is asked gains nothing if the machine is too busy to see it; for all others that is a way out.
MET_IF_SEEN = MET | {"undecided"}
#: By a word of the table: the outcomes allowed to each criterion.
EARNS: Mapping[str, Mapping[str, frozenset[str]]] = {
    # Beside its attack the node does what is asked, and gets what that is worth.
    "honest": {"topic": MET_IF_SEEN, "rate": MET_IF_SEEN, "speed": MET_IF_SEEN, "log": MET_IF_SEEN},
    # It publishes at a quarter of the rate; the attack must not make up for that.
    "slow": {"topic": MET, "rate": NOT_MET, "speed": ANYTHING, "log": MET},
    # A message class that checks its fields may refuse the number, which stops the node.
    "wrong_speed": {"topic": ANYTHING, "rate": ANYTHING, "speed": NOT_MET, "log": MET},
    # It dies or falls silent half-way: what it earned before is its own, the full rate is not.
    "stops": {"topic": MET, "rate": NOT_MET, "speed": ANYTHING, "log": MET},
    "nothing": {"topic": NOT_MET, "rate": NOT_MET, "speed": NOT_MET, "log": ANYTHING},
    # As slow, but its attack may hold up its own recording until its time is over.
    "slow_or_stopped": {"topic": ANYTHING, "rate": NOT_MET, "speed": ANYTHING, "log": ANYTHING},
    # Being stopped at a limit is right, and so is going on within it.
    "whatever": {"topic": ANYTHING, "rate": ANYTHING, "speed": ANYTHING, "log": ANYTHING},
    "guesses": {"on": NOT_MET, "off": NOT_MET, "log": MET},
    "never_on": {"on": NOT_MET, "off": ANYTHING, "log": MET},
}
#: Kinds of node that say nothing about attempts: they are gone, or are stopped before they can.
SILENT = ("nothing", "whatever", "slow_or_stopped")
_SAID = re.compile(r"([0-9]+) attempts, escaped: (.*)")


def criteria_of(report: Mapping[str, Any], name: str) -> dict[str, Mapping[str, Any]]:
    """Return the criteria of one node by their short names."""
    found = [c for exercise in report.get("exercises", []) for c in exercise["criteria"]]
    return {c["id"].partition("__")[2]: c for c in found if c["id"].partition("__")[0] == name}


def objections(report: Mapping[str, Any], name: str, earns: str) -> Iterator[str]:
    """Yield what is wrong with the part of a report that is about one node."""
    criteria = criteria_of(report, name)
    if not criteria:
        yield "it was not judged"
        return
    for what, allowed in EARNS[earns].items():
        if criteria[what]["outcome"] not in allowed:
            yield f"{what} is {criteria[what]['outcome']}: {criteria[what]['reason']}"
    unseen = criteria["log"]["outcome"] == "undecided"
    yield from _attempts(criteria["log"], must_speak=earns not in SILENT and not unseen)


def _attempts(log: Mapping[str, Any], *, must_speak: bool) -> Iterator[str]:
    said = _SAID.match(str(log["evidence"].get("first", "")))
    if said is None and must_speak:
        yield f"it does not tell what it tried: {log['reason']}"
    elif said is not None and said[2] != "none":
        yield f"escaped: {said[2]}"
