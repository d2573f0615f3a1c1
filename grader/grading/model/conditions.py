"""The names of the conditions that must not matter to a recording, as `grade verify --condition` takes them."""

from __future__ import annotations

from grader.runtime.model.checkup import NO_SANDBOX, TIERS

#: Names of the conditions, in the order in which they are tried: sandboxes stand for themselves, and `together` makes
#: several of the others at once.
AGAIN, ORDER, PROCESSORS, LOAD, EXECUTED = "again", "order", "processors", "load", "executed"
FOLDER, ZONE, HASHES, USER, TOGETHER = "folder", "zone", "hashes", "user", "together"
SANDBOXES = tuple(name for name in TIERS if name != NO_SANDBOX)
CONDITIONS = (AGAIN, ORDER, PROCESSORS, LOAD, EXECUTED, FOLDER, ZONE, HASHES, USER, *SANDBOXES, TOGETHER)
#: Those that are tried if none is named.
USUAL = CONDITIONS[:-1]
