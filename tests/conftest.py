"""What holds for all tests: a busy machine makes no test fail, and neither does a shell that ignores Ctrl-C."""

import logging
import signal

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("unhurried", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("unhurried")

# What a shell runs in the background ignores interrupts, and so would every program that is interrupted here.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


class _Fail(logging.Handler):
    """Fails where the grader logs a mistake of its own that it gets over."""

    def emit(self, record):
        raise AssertionError(record.getMessage())


@pytest.fixture(autouse=True)
def strict_log(request):
    """Let a test fail that logs a mistake, unless it asks for caplog."""
    if "caplog" in request.fixturenames:
        yield
        return
    handler = _Fail(logging.ERROR)
    logging.getLogger("grader").addHandler(handler)
    yield
    logging.getLogger("grader").removeHandler(handler)


def pytest_addoption(parser):
    """Add the option of the nightly run."""
    parser.addoption("--everything", action="store_true", help="run the tests that are left to the nightly run as well")


def pytest_collection_modifyitems(config, items):
    """Leave out what is marked for the nightly run, unless everything is asked for."""
    left_out = [] if config.getoption("--everything") else [i for i in items if i.get_closest_marker("nightly")]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not item.get_closest_marker("nightly")]
