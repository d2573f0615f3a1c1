"""Tables of programs: what is recorded in virtual time is recorded beside each other, once, for all rows of a run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pytest

from grader.runtime.model.trace import Trace
from grader.runtime.plan import Plan
from grader.runtime.session import VIRTUAL, RecordingSession
from grader.runtime.supervisor.supervisor import Job

Test = TypeVar("Test", bound=Callable[..., None])


def rows_of(plan: Callable[..., Plan], *, session: str = "session") -> Callable[[Test], Test]:
    """Mark a table of tests for the fixture `trace`, which gives each test the trace of its row.

    Args:
        plan: Returns the plan of a row, from an empty folder and the parameters of the test.
        session: The fixture that the table is recorded with.
    """

    def mark(test: Test) -> Test:
        marked: Test = pytest.mark.recorded(plan, session)(test)
        # The rows of a tier are in a group already.
        return pytest.mark.xdist_group(test.__module__)(marked) if session == "session" else marked

    return mark


class Tables:
    """The traces of rows that no test has asked for yet.

    Args:
        new_folder: Makes an empty folder that every user can enter.
    """

    def __init__(self, new_folder: Callable[[], Path]) -> None:
        self._new_folder = new_folder
        self._traces: dict[str, Trace] = {}

    def trace(self, request: pytest.FixtureRequest) -> Trace:
        """Return the trace of a test's row.

        The first row in virtual time is recorded beside all others of its module that are selected in this run. Rows on
        the wall clock would delay each other: each is recorded when its test runs.
        """
        from hostile import recorded

        item = request.node
        session: RecordingSession = request.getfixturevalue(_session_of(item))
        if item.nodeid not in self._traces:
            plan = self._plan(item)
            if plan.clock != VIRTUAL:
                return recorded(session, plan)
            mates = {each.nodeid: self._plan(each) for each in request.session.items if _beside(each, item)}
            plans = {name: mate for name, mate in mates.items() if mate.clock == VIRTUAL}
            traces = session.recorder.record([Job(name, one) for name, one in plans.items()], lambda step: None)
            self._traces.update(zip(plans, traces, strict=True))
        return self._traces.pop(item.nodeid)

    def _plan(self, item: pytest.Item) -> Plan:
        marker = item.get_closest_marker("recorded")
        assert marker is not None, f"{item.nodeid} asks for a trace and has no plan: see rows_of"
        row = {name: value for name, value in _parameters(item).items() if name != marker.args[1]}
        plan: Plan = marker.args[0](self._new_folder(), **row)
        return plan


def _parameters(item: pytest.Item) -> dict[str, object]:
    callspec = getattr(item, "callspec", None)
    found: dict[str, object] = {} if callspec is None else callspec.params
    return found


def _session_of(item: pytest.Item) -> str:
    marker = item.get_closest_marker("recorded")
    return "" if marker is None else str(marker.args[1])


def _beside(one: pytest.Item, other: pytest.Item) -> bool:
    """Return whether two tests have rows in one module, for one session in one tier."""
    if one.path != other.path or _session_of(one) != _session_of(other):
        return False
    session = _session_of(other)
    return _parameters(one).get(session) == _parameters(other).get(session)
