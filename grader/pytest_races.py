"""What the plugin for pytest does about races: keeps the seeds that failed, tries them first, and shrinks a failure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
from _pytest.runner import runtestprotocol

# What worlds need is imported when a test has used one: this module is loaded with pytest.
if TYPE_CHECKING:
    from grader.world.faults import RunDraws
    from grader.world.races import Rerun
    from grader.world.world import World

#: What is drawn in the run of a test that comes next, or is under way; None for everything.
DRAWN: pytest.StashKey[RunDraws | None] = pytest.StashKey()
#: Whether a run is only made to shrink a failure, so that nothing is kept of it.
TRIAL: pytest.StashKey[bool] = pytest.StashKey()
#: How the latest run of a test went; None if it drew nothing.
ATTEMPT: pytest.StashKey[Rerun | None] = pytest.StashKey()
#: What is told below the failure of a test.
TOLD: pytest.StashKey[list[str]] = pytest.StashKey()
#: How many seeds are tried at most for one that passes where a test fails without any draw.
OTHER_SEEDS = 6
#: The attribute of a report that holds the seed of its run; it passes from a worker of xdist to the controller.
SEED = "ros_seed"
_SHRUNK: pytest.StashKey[set[str]] = pytest.StashKey()
_KEPT: pytest.StashKey[dict[str, list[int]]] = pytest.StashKey()
#: Where the seeds that failed are kept in the cache of pytest, by test; and under which name workers of xdist get them.
_CACHED, _OF_WORKER = "ros/seeds", "ros_seeds"


def id_without_seed(nodeid: str) -> str:
    """Return what the seeds of a test are kept under: its id without what it is parametrized with."""
    return nodeid.partition("[")[0]


def kept_seeds(config: pytest.Config) -> dict[str, list[int]]:
    """Return the seeds that have failed and not passed since, by test, the latest first."""
    if _KEPT not in config.stash:
        found: Any = None
        if hasattr(config, "workerinput"):
            found = config.workerinput.get(_OF_WORKER)
        elif (cache := getattr(config, "cache", None)) is not None:
            found = cache.get(_CACHED, None)
        entries = found.items() if isinstance(found, dict) else ()
        config.stash[_KEPT] = {
            key: [seed for seed in seeds if type(seed) is int] for key, seeds in entries if isinstance(seeds, list)
        }
    return config.stash[_KEPT]


def seeds_in_order(config: pytest.Config, nodeid: str, seeds: int) -> list[int]:
    """Return the seeds of a test in the order in which they run: those that have failed come first."""
    failed = kept_seeds(config).get(id_without_seed(nodeid), [])
    return [*dict.fromkeys([*failed, *range(seeds)])]


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Give a worker of xdist the seeds, as all workers have to collect the same tests."""
    node.workerinput[_OF_WORKER] = kept_seeds(node.config)


class KeepsSeeds:
    """Keeps the seeds that fail in the cache of pytest, and forgets those that pass.

    Args:
        config: Of the session; not that of a worker of xdist, whose reports come here as well.
    """

    def __init__(self, config: pytest.Config) -> None:
        self._config = config

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note whether the seed of a test has failed."""
        seed, cache = vars(report).get(SEED), getattr(self._config, "cache", None)
        if report.when != "call" or seed is None or cache is None:
            return
        kept = kept_seeds(self._config)
        key = id_without_seed(report.nodeid)
        before = kept.get(key, [])
        seeds = [one for one in before if one != seed]
        kept[key] = [seed, *seeds] if report.failed else seeds
        if not kept[key]:
            del kept[key]
        if kept.get(key, []) != before:
            cache.set(_CACHED, kept)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
    """Run a test that uses worlds; if what a seed has drawn makes it fail, shrink that, and report the shrunk run."""
    if "ros" not in getattr(item, "fixturenames", ()):
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    reports = _run(item, nextitem, None)
    first, failure = item.stash.get(ATTEMPT, None), _failure(reports)
    shrunk = item.config.stash.setdefault(_SHRUNK, set())
    asked = map(item.config.getoption, ("--ros-no-shrink", "usepdb", "--ros-debug", "--ros-debug-port"))
    wanted = not any(asked)  # a debugger would open in each run
    if first is not None and failure is not None and wanted and id_without_seed(item.nodeid) not in shrunk:
        shrunk.add(id_without_seed(item.nodeid))
        reports = _shrunk(item, nextitem, first, reports)
    for report in reports:
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


def _run(item: pytest.Item, nextitem: pytest.Item | None, drawn: RunDraws | None, *, trial: bool = False) -> list[Any]:
    """Run a test with its fixtures, report nothing, and return the reports."""
    item.stash[DRAWN], item.stash[TRIAL], item.stash[ATTEMPT] = drawn, trial, None
    return runtestprotocol(item, log=False, nextitem=nextitem)


def rerun_of(item: pytest.Item, world: World, *, failed: bool) -> Rerun | None:
    """Return how a run in a world went, before the world is closed; None if that is not asked for, or not known."""
    from grader.world.faults import RunDraws  # noqa: PLC0415 - see above
    from grader.world.races import Rerun  # noqa: PLC0415

    if not (failed or item.stash.get(TRIAL, False)):
        return None
    try:
        return Rerun(RunDraws(world.faults, None), failed, world.steps())
    except Exception:  # the worker is gone: the failure of the test is what counts
        return None


def _failure(reports: Sequence[Any]) -> tuple[str, int] | None:
    """Return how the call of a test has failed: the type of the error, and the line; None if it has not."""
    for report in reports:
        if report.when == "call" and report.failed:
            crash = getattr(report.longrepr, "reprcrash", None)
            return ("", 0) if crash is None else (crash.message.partition(":")[0], crash.lineno)
    return None


def _shrunk(item: pytest.Item, nextitem: pytest.Item | None, first: Rerun, reports: list[Any]) -> list[Any]:
    """Return the reports of the shrunk run, or those of the first one if that cannot be repeated."""
    from grader.world.races import Rerun, Shrunk, shrink, told_of_race  # noqa: PLC0415 - see above

    failure, properties = _failure(reports), [*item.user_properties]

    def again(drawn: RunDraws, *, trial: bool) -> tuple[list[Any], Rerun | None]:
        item.user_properties.clear()
        item._report_sections.clear()  # noqa: SLF001 - what an earlier run has written is not that of this one
        # the collector stands for the next test: fixtures of a wider scope stay
        following: Any = item.parent if trial else nextitem
        found = _run(item, following, drawn, trial=trial)
        attempt = item.stash.get(ATTEMPT, None)
        failed = _failure(found) == failure
        if attempt is None:
            return found, None
        return found, Rerun(replace(drawn, faults=attempt.drawn.faults), failed, attempt.steps)

    search = shrink(first, range(OTHER_SEEDS))
    try:
        drawn = next(search)
        while True:
            _, attempt = again(drawn, trial=True)
            drawn = search.send(attempt or Rerun(drawn, failed=False, steps=()))
    except StopIteration as end:
        found: Shrunk = end.value
    item.stash[TOLD] = told_of_race(first, found)
    last, attempt = again(found.failing.drawn, trial=False)
    del item.stash[TOLD]
    if attempt is not None and attempt.failed:
        return last
    item.user_properties[:] = properties
    text = "the same seed passed when it was tried again: the test depends on something that no seed draws"
    for report in reports:
        if report.when == "call":
            report.sections.append(("ros", text))
    return reports
