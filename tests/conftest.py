"""What holds for all tests: a busy machine makes no test fail, and neither does a shell that ignores Ctrl-C."""

from __future__ import annotations

import logging
import os
import signal
import sys
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, settings
from process_table import processor_time_s
from tiers import spread

from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.ros_installation import RosInstallation, find_ros

#: Fixtures that tests in several folders use.
pytest_plugins = ["browser_fixtures", "common_fixtures"]

BEGAN_S = pytest.StashKey[float]()
#: The markers of tests that `-m fast` leaves out.
NOT_FAST = ("ros", "browser", "sandbox", "slow", "long", "nightly")

settings.register_profile(
    "default", deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large], max_examples=15
)
settings.register_profile("long", settings.get_profile("default"), max_examples=30)
settings.register_profile("nightly", settings.get_profile("default"), max_examples=200)

# Rewriting the assertions of all tests takes twelve seconds of a processor: it is kept, also where Python should keep
# nothing, as in many containers.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# What a shell runs in the background ignores interrupts, and so would every program that is interrupted here.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


class _Fail(logging.Handler):
    """Fails where the grader logs a mistake of its own that it gets over."""

    def emit(self, record: logging.LogRecord) -> None:
        raise AssertionError(record.getMessage())


@pytest.fixture(autouse=True)
def strict_log(request: pytest.FixtureRequest) -> Iterator[None]:
    """Let a test fail that logs a mistake, unless it asks for caplog."""
    if "caplog" in request.fixturenames:
        yield
        return
    handler = _Fail(logging.ERROR)
    logging.getLogger("grader").addHandler(handler)
    yield
    logging.getLogger("grader").removeHandler(handler)


@pytest.fixture(scope="session")
def ros() -> RosInstallation:
    """The ROS of this machine."""
    try:
        return find_ros()
    except EnvironmentFault as fault:
        pytest.skip(fault.message)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options for the tests that the default run leaves out."""
    parser.addoption("--long", action="store_true", help="run the tests marked long as well")
    parser.addoption("--everything", action="store_true", help="run the tests marked long or nightly as well")


def pytest_configure(config: pytest.Config) -> None:
    """Try more examples of each property with the long tests, and most in the nightly run."""
    everything, long = config.getoption("--everything"), config.getoption("--long")
    settings.load_profile("nightly" if everything else "long" if long else "default")


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Note the processor time that had passed when a test begins."""
    item.stash[BEGAN_S] = _processor_time_s(item)
    return (yield)


def _processor_time_s(item: pytest.Item) -> float:
    if not item.config.getoption("xmlpath"):
        return 0.0
    return processor_time_s(cheaply=item.get_closest_marker("fast") is not None)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Add to the results of `--junitxml` what a test cost, for `tests/durations.py`."""
    if call.when == "teardown" and item.config.getoption("xmlpath"):
        item.user_properties += [
            ("file", item.nodeid.partition("::")[0]),
            ("markers", " ".join(sorted({marker.name for marker in item.iter_markers()}))),
            ("processor_s", f"{_processor_time_s(item) - item.stash[BEGAN_S]:.3f}"),
        ]
    return (yield)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the fast tests, leave out the long and nightly ones unless asked for, and put those with nodes first.

    Real nodes wait more than they compute: beside each other they leave the processor to each other. The tests that
    compute come last and fill what is left.
    """
    for item in items:
        tier = item.callspec.params.get("session_in_tier") if hasattr(item, "callspec") else None
        if tier:
            item.add_marker(pytest.mark.xdist_group(f"tier {tier}"))  # one process opens it, once
        if not any(item.get_closest_marker(kind) for kind in NOT_FAST):
            item.add_marker("fast")
    spread(items)
    everything, long = config.getoption("--everything"), config.getoption("--long")
    left_out = {name for name, asked in (("nightly", everything), ("long", everything or long)) if not asked}
    unwanted = {item for item in items if any(item.get_closest_marker(name) for name in left_out)}
    config.hook.pytest_deselected(items=[item for item in items if item in unwanted])
    items[:] = [item for item in items if item not in unwanted]
    items.sort(key=lambda item: item.get_closest_marker("ros") is None)
