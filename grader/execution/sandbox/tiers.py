"""The tiers of isolation by their names."""

from __future__ import annotations

import os

from grader.core.checkup import TIERS
from grader.core.errors import EnvironmentFault
from grader.execution.sandbox import bubblewrap, flat, landlock, plain
from grader.execution.sandbox.bubblewrap import Bubblewrap
from grader.execution.sandbox.flat import FlatBubblewrap
from grader.execution.sandbox.landlock import Landlock
from grader.execution.sandbox.plain import Plain
from grader.execution.sandbox.protocol import Isolation

#: What contains anything, strongest first.
WALLED = (bubblewrap.ROOT_NAME, bubblewrap.USER_NAME, flat.NAME, landlock.NAME)


def isolation_from_name(name: str) -> Isolation:
    """Return a tier, without trying whether it holds.

    Raises:
        EnvironmentFault: There is no such tier, it is for another user, or something it is made of is missing.
    """
    if name not in TIERS:
        raise EnvironmentFault(f"isolation: expected one of {', '.join(TIERS)}, found {name}")
    if name == landlock.NAME:
        return Landlock.here()
    if name == flat.NAME:
        return FlatBubblewrap.here()
    if name == plain.NAME:
        return Plain()
    if is_for_others(name):
        wanted, mend = ("root", "run it with sudo") if name == bubblewrap.ROOT_NAME else ("an ordinary user", "")
        raise EnvironmentFault(f"isolation {name}: expected {wanted}, found user {os.geteuid()}", mend)
    return Bubblewrap.here()


def is_for_others(name: str) -> bool:
    """Return whether a tier is root's and this is not root, or the other way round."""
    as_root = os.geteuid() == 0
    return name == (bubblewrap.USER_NAME if as_root else bubblewrap.ROOT_NAME)
