"""Which processes only compute, and what counts of the time that they wait for a processor."""

from __future__ import annotations

import pytest
from quiet_kernel import QuietKernel

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.usage import Activity
from grader.runtime.worker.computing import ComputingProcesses

COMPUTES = Activity(runs=True, slept=3, exchanged=5)


def looks(*activities: Activity) -> list[tuple[bool, int]]:
    """Return whether a process was found to compute, and how many seconds of waiting count, second by second."""
    kernel = QuietKernel()
    processes, found = ComputingProcesses(kernel), []
    for second, activity in enumerate(activities):
        kernel.activities[7] = activity
        kernel.starved_ns = {"7": second * NS_PER_S}
        computing, waited_ns = processes.look([7], second * NS_PER_S)
        found.append((7 in computing, sum(waited_ns) // NS_PER_S))
    return found


def test_the_wait_of_a_process_that_computes_does_not_grow() -> None:
    """It has told nobody anything since."""
    assert looks(COMPUTES, COMPUTES, COMPUTES) == [(False, 0), (True, 0), (True, 0)]


@pytest.mark.parametrize(
    "other",
    [
        Activity(runs=True, slept=4, exchanged=5),
        Activity(runs=True, slept=3, exchanged=6),
        Activity(runs=True, slept=3, exchanged=None),
        Activity(runs=False, slept=3, exchanged=5),
    ],
    ids=["slept", "read or wrote", "shares memory", "sleeps"],
)
def test_what_it_has_waited_before_it_told_something_counts(other: Activity) -> None:
    """Somebody may have waited for that."""
    assert looks(COMPUTES, COMPUTES, other, other)[2] == (False, 2)
    assert looks(other, COMPUTES, COMPUTES)[1:] == [(False, 1), (True, 1)]


@pytest.mark.parametrize("other", [Activity(runs=True, slept=3, exchanged=None), Activity(slept=3, exchanged=5)])
def test_a_process_that_may_be_told_something_never_only_computes(other: Activity) -> None:
    """It shares memory, or it waits for something."""
    assert looks(other, other, other) == [(False, 0), (False, 1), (False, 2)]


def test_a_process_that_computes_for_a_moment_is_no_computing_one() -> None:
    """Two looks may follow each other at once."""
    kernel = QuietKernel()
    kernel.activities[7] = COMPUTES
    processes = ComputingProcesses(kernel)
    processes.look([7], 0)
    assert processes.look([7], NS_PER_S - 1).computing == set()
    assert processes.look([7], NS_PER_S).computing == {7}
