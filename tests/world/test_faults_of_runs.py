"""The faults of a run follow from its seed and what a test gives."""

from collections.abc import Mapping

import pytest

from grader.runtime.plan import PlannedConnection, derive
from grader.world.faults import RunDraws, faults_of_run

BETWEEN: Mapping[str, Mapping[str, object]] = {"/odom": {"lose": 0.5}, "base.py": {"kill": (1, 2)}}


def test_a_topic_may_be_named_without_its_slash() -> None:
    """Delay and loss of one topic meet in one connection."""
    found = faults_of_run(7, delay={"in": (0.1, 0.25)}, lose={"/in": 0.5, "out": 1})
    assert found.names == ("delay /in", "lose /in", "lose /out")
    assert found.connections == (
        PlannedConnection("/in", (100_000_000, 250_000_000), 0.5, derive(7, "connection", "/in")),
        PlannedConnection("/out", (0, 0), 1, derive(7, "connection", "/out")),
    )


@pytest.mark.parametrize(
    ("on", "connections", "injected"),
    [
        (("delay /in",), [("/in", (0, 10**9), 0.0)], []),
        (("lose /in", "kill base.py"), [("/in", (0, 0), 0.5)], ["kill base.py"]),
        ((), [], []),
        (None, [("/in", (0, 10**9), 0.5)], ["lose /odom", "kill base.py"]),
    ],
)
def test_only_what_is_asked_for_is_on(
    on: tuple[str, ...] | None, connections: list[tuple[str, tuple[int, int], float]], injected: list[str]
) -> None:
    """A failing run is shrunk to some of its faults; the others leave no connection behind."""
    found = faults_of_run(7, delay={"/in": (0, 1)}, lose={"/in": 0.5}, between=BETWEEN, only=RunDraws(on))
    assert [(one.topic, one.delay_ns, one.lose) for one in found.connections] == connections
    assert [one.name for one in found.injected] == injected
    if on is not None:
        assert found.names == on


def test_a_swarm_turns_on_some_of_them() -> None:
    """Each seed its own ones; which these are does not depend on what else is drawn."""
    every = faults_of_run(0, lose={"/in": 0.5}, between=BETWEEN).names
    drawn = [faults_of_run(seed, lose={"/in": 0.5}, between=BETWEEN, swarm=True).names for seed in range(32)]
    assert {*drawn} > {(), every}
    assert all({*names} <= {*every} for names in drawn)


def test_a_fault_that_cannot_be_is_told_although_it_is_off() -> None:
    """Whether a test is right does not depend on its seed."""
    with pytest.raises(ValueError, match=r"^lose: /in: expected a share from 0 to 1, found 2$"):
        faults_of_run(0, lose={"in": 2}, only=RunDraws(()))


def test_a_test_has_no_node_for_a_tilde() -> None:
    """Its messages go to no topic of a node of its own."""
    with pytest.raises(ValueError, match=r"^~/in: expected a full name, such as /NODE/in"):
        faults_of_run(0, delay={"~/in": (0, 1)})
