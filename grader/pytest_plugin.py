"""The plugin for pytest: the fixture `ros`, with which a test runs real nodes in virtual time.

It is loaded wherever the package is installed, and imports nothing of ROS before a test asks for the fixture.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
from collections.abc import Generator, Iterator, Sequence
from dataclasses import replace
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType, TracebackType
from typing import TYPE_CHECKING, Any

import pytest

from grader import pytest_races

if TYPE_CHECKING:
    from grader.world.opening import Worlds
    from grader.world.world import World

#: What `@pytest.mark.ros` takes.
_OPTIONS = ("clock", "seed", "seeds", "delay", "lose", "between")
#: The clocks that a test may run on.
_CLOCKS = ("virtual", "wall")
#: Where the grader's own code lies, which the traceback of a failure leaves out.
_GRADER = Path(__file__).parent
_WORLD: pytest.StashKey[World] = pytest.StashKey()
_SHARED: pytest.StashKey[str] = pytest.StashKey()
_OF_WORKER = "ros_shared"
#: Names that packages of ROS have. Outside of a package, any other module is missing for reasons of its own.
_MAY_BE_OF_ROS = re.compile(r"_msgs$|_interfaces$|^tf2?_|^cv_bridge$|^message_filters$|^sensor_msgs_py$")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options of the command line."""
    group = parser.getgroup("ros", "nodes in virtual time")
    group.addoption(
        "--ros-clock",
        choices=_CLOCKS,
        default="virtual",
        help="the clock of tests whose marker does not name one: virtual time, or the wall clock, on which they take "
        "as long as they say and no order is drawn",
    )
    group.addoption(
        "--ros-seed",
        type=int,
        metavar="N",
        help="draw from this seed the order of programs and callbacks that are ready at one instant, and the faults",
    )
    group.addoption(
        "--ros-no-shrink",
        action="store_true",
        help="do not run a test that has failed with a seed again to find out which of its draws it needs",
    )
    group.addoption(
        "--ros-update",
        action="store_true",
        help="write the recordings with which ros.record compares, in place of comparing",
    )
    group.addoption(
        "--ros-debug",
        action="store_true",
        help="let breakpoint() in a program that a test starts open the debugger on this terminal; virtual time waits",
    )
    group.addoption(
        "--ros-debug-port",
        type=int,
        metavar="PORT",
        help="let breakpoint() in such a program wait until a debugger has attached itself at this port, as that of "
        "VS Code; the next programs take the ports after it",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Describe the marker."""
    config.addinivalue_line(
        "markers",
        "ros(clock='virtual' or 'wall', seed=N, seeds=COUNT, delay={topic: (least, most)}, lose={topic: share}, "
        "between={topic or program: faults}): options of the fixture `ros`: the clock, the seed of everything drawn, "
        "the number of seeds to run the test with, seconds that messages of the test are on their way, the share of "
        "them that is lost, and the same between programs, which can also be paused and killed",
    )
    config.addinivalue_line(
        "markers",
        "points(N, hint=TEXT, needs=ID): what the test is worth where a rubric names its file; it does nothing here",
    )

    config.pluginmanager.register(pytest_races)
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(pytest_races.KeepsSeeds(config))
    finder = _Finder(config.rootpath)
    sys.meta_path.append(finder)
    sys.meta_path.insert(0, _BeforeFolders(finder))


def pytest_unconfigure() -> None:
    """Find no more packages that are not installed."""
    sys.meta_path[:] = [finder for finder in sys.meta_path if not isinstance(finder, (_Finder, _BeforeFolders))]


@pytest.hookimpl(tryfirst=True)
def pytest_make_collect_report(collector: pytest.Collector) -> None:
    """Look for packages beside the file that is about to be imported."""
    if isinstance(collector, pytest.Module):
        _look_beside(collector.path)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Look for packages beside the file of the test that is about to run."""
    _look_beside(item.path)


def _look_beside(file: Path) -> None:
    for finder in sys.meta_path:
        if isinstance(finder, _Finder):
            finder.folder = file.parent


class _Finder(MetaPathFinder):
    """Finds packages of ROS that are not installed; what it needs for that is imported when such a module is missing.

    Args:
        folder: Where to look first.

    Attributes:
        folder: In the workspace, if there is one.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._is_looking = False

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the place of a package, if it is one; raises ImportError if it cannot be built."""
        if path is not None or not (_MAY_BE_OF_ROS.search(fullname) or self._is_in_package()):
            return None
        return self.find(fullname, target)

    def find(self, fullname: str, target: ModuleType | None) -> ModuleSpec | None:
        """Return the place of what may be a package of ROS; raises ImportError if it cannot be built."""
        if self._is_looking:
            return None
        self._is_looking = True  # a build looks whether other modules have these names
        try:
            from grader.world.interfaces import find_package  # noqa: PLC0415 - most tests miss no such module

            return find_package(self.folder, fullname, target)
        finally:
            self._is_looking = False

    def _is_in_package(self) -> bool:
        return any((up / "package.xml").is_file() for up in (self.folder, *self.folder.parents))


class _BeforeFolders(MetaPathFinder):
    """Finds a package of ROS whose own folder Python would take for a package of Python without `__init__.py`.

    It is the folder in which its definitions lie, beside a test for instance: nothing can be imported from it.
    """

    def __init__(self, finder: _Finder) -> None:
        self._finder = finder

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the place of such a package; None for any other name."""
        if path is not None:
            return None
        found = PathFinder.find_spec(fullname)
        if found is None or (found.loader is not None and found.origin is not None):
            return None
        folders = [Path(folder) for folder in found.submodule_search_locations or ()]
        if not any((folder / "package.xml").is_file() for folder in folders):
            return None
        return self._finder.find(fullname, target)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a test that is marked with `seeds` once for each of them."""
    if "_ros_seed" not in metafunc.fixturenames:
        return
    options = _options(metafunc.definition)
    seeds = options.get("seeds")
    chosen = metafunc.config.getoption("--ros-seed")
    # on the wall clock one run stands for all: there is no order that a seed could draw
    if seeds is not None and chosen is None and _clock(metafunc.config, options) == "virtual":
        numbers = pytest_races.seeds_in_order(metafunc.config, metafunc.definition.nodeid, seeds)
        metafunc.parametrize("_ros_seed", numbers, ids=[f"seed{number}" for number in numbers])


@pytest.fixture(scope="session")
def ros_session(pytestconfig: pytest.Config) -> Iterator[Worlds]:
    """What the programs of all tests run in; it starts with the first test that needs it.

    For a fixture of a wider scope than a test: `with ros_session.open() as ros: ...`.
    """
    from grader.runtime.model.errors import EnvironmentFault  # noqa: PLC0415 - no other test waits for it
    from grader.world.measuring import measured_lines  # noqa: PLC0415 - the same
    from grader.world.opening import open_worlds  # noqa: PLC0415 - the same

    has_cov = pytestconfig.pluginmanager.hasplugin("_cov")
    measured = measured_lines(pytestconfig.invocation_params.dir, combines=has_cov)
    with contextlib.ExitStack() as stack:
        try:
            debugger = _debugger(pytestconfig)
            # where a debugger that attaches itself is, which is outside of a network of the programs' own
            shared = pytestconfig.getoption("--ros-debug-port") is not None
            options: dict[str, Any] = {"measured": measured, "debugger": debugger, "own_network": not shared}
            worlds = stack.enter_context(open_worlds(pytestconfig.rootpath, **options))
        except EnvironmentFault as fault:
            pytest.fail(f"{fault.message}\nhint: {fault.hint}" if fault.hint else fault.message, pytrace=False)
        worlds = replace(worlds, updates_recordings=pytestconfig.getoption("--ros-update"))
        pytestconfig.stash[_SHARED] = worlds.shared
        if hasattr(pytestconfig, "workeroutput"):  # a process of pytest-xdist, which prints nothing itself
            pytestconfig.workeroutput[_OF_WORKER] = worlds.shared
        yield worlds


def _debugger(config: pytest.Config) -> str:
    """Return where a debugger of programs is; empty if nobody asks for one."""
    port, at_terminal = config.getoption("--ros-debug-port"), config.getoption("--ros-debug")
    if port is None and not at_terminal:
        return ""
    from grader.world.debuggers import debugger_at  # noqa: PLC0415 - few tests are debugged

    terminal = _terminal(config)
    if at_terminal and not terminal:
        beside = " in a process of pytest-xdist: add -n0" if hasattr(config, "workeroutput") else ""
        pytest.fail(f"--ros-debug: expected a terminal, found none{beside}", pytrace=False)
    try:
        return debugger_at(terminal, port)
    except ImportError as error:
        pytest.fail(f"--ros-debug-port: {error}: pip install debugpy", pytrace=False)


def _terminal(config: pytest.Config) -> str:
    """Return the device of the terminal that pytest was started at, which is captured meanwhile; empty for none."""
    capture: Any = config.pluginmanager.getplugin("capturemanager")
    with contextlib.ExitStack() as stack:
        if capture is not None:
            capture.suspend(in_=True)
            stack.callback(capture.resume)
        for descriptor in range(3):
            with contextlib.suppress(OSError):
                return os.ttyname(descriptor)
    return ""


@pytest.fixture
def _ros_seed(request: pytest.FixtureRequest) -> int | None:
    """The seed of a test; None for the order in which the programs were started, without chance."""
    chosen: int | None = request.config.getoption("--ros-seed")
    seed: int | None = _options(request.node).get("seed")
    return seed if chosen is None else chosen


@pytest.fixture
def ros(
    request: pytest.FixtureRequest,
    ros_session: Worlds,
    _ros_seed: int | None,
    tmp_path: Path,
) -> Iterator[World]:
    """A world of its own for a test: real nodes, real messages, virtual time."""
    from grader.world.faults import ALL  # noqa: PLC0415 - no other test waits for it

    del tmp_path  # what a failing test leaves lies there
    options = _options(request.node)
    drawn = request.node.stash.get(pytest_races.DRAWN, None) or ALL
    opened = ros_session.open(
        request.path.parent,
        clock=_clock(request.config, options),
        seed=_ros_seed if drawn.seed is None else drawn.seed,
        name=request.node.name,
        delay=options.get("delay"),
        lose=options.get("lose"),
        between=options.get("between"),
        swarm=options.get("seeds") is not None,
        only=drawn,
    )
    with opened as world:
        request.node.stash[_WORLD] = world
        yield world
    if _WORLD not in request.node.stash:
        return  # the test has failed, and everything is told with it
    for text in world.remarks:
        request.node.warn(pytest.PytestWarning(text))
    if world.problem:
        pytest.fail(world.problem, pytrace=False)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Keep the recording of a test that has failed, and the page that plays it, and name them in the failure."""
    uses_worlds = "ros_session" in getattr(item, "fixturenames", ())
    if uses_worlds and call.excinfo is not None and not item.config.getoption("fulltrace"):
        call.excinfo = pytest.ExceptionInfo.from_exception(_of_test(call.excinfo.value, item.path))
    report = yield
    world = item.stash.get(_WORLD, None)
    if world is not None and call.when == "call" and world.is_drawn and world.repeats:
        vars(report)[pytest_races.SEED] = world.seed
        item.stash[pytest_races.ATTEMPT] = pytest_races.rerun_of(item, world, failed=report.failed)
    if item.stash.get(pytest_races.TRIAL, False):
        if world is not None and call.when == "call" and report.failed:
            del item.stash[_WORLD]
        return report
    if world is not None and call.when == "call" and report.failed and call.excinfo is not None:
        del item.stash[_WORLD]  # the fixture has nothing to add
        repeating = "repeat it with" if world.repeats else "the same delays and losses are drawn with"
        drawn = [f"seed {world.seed}: {repeating} --ros-seed {world.seed}"] if world.is_drawn else []
        kept = list(_kept(item, world, call.excinfo))  # closes the world, which then has all of its remarks
        told = [*world.remarks, *_undebugged(world, item.config)]
        lines = [*item.stash.get(pytest_races.TOLD, []), *drawn, *told, *kept]
        report.sections.append(("ros", "\n".join(lines)))
        item.user_properties += [("ros", line) for line in lines]  # which files for JUnit hold
    return report


def _of_test(error: BaseException, path: Path) -> BaseException:
    """Return an error whose traceback leaves out the grader's frames, if it has any of the test's file."""
    entries: list[TracebackType] = []
    entry = error.__traceback__
    while entry is not None:
        file = entry.tb_frame.f_code.co_filename
        if file != contextlib.__file__ and not Path(file).is_relative_to(_GRADER):
            entries.append(entry)
        entry = entry.tb_next
    if not any(entry.tb_frame.f_code.co_filename == str(path) for entry in entries):
        return error
    found: TracebackType | None = None
    for entry in reversed(entries):
        found = TracebackType(found, entry.tb_frame, entry.tb_lasti, entry.tb_lineno)
    return error.with_traceback(found)


def _undebugged(world: World, config: pytest.Config) -> Iterator[str]:
    """Yield how to debug the programs that have met a breakpoint without a debugger."""
    if config.getoption("--ros-debug") or config.getoption("--ros-debug-port") is not None:
        return  # whoever quits a debugger ends the program in the same way
    for program in world.programs:
        if program.fault is not None and program.fault.exception == "bdb.BdbQuit":
            yield f"{program.name}: there is no debugger at its breakpoint; pytest --ros-debug opens one"


def _seed_options(world: World) -> list[str]:
    """Return the options of pytest with which a run of a world is repeated."""
    return ["--ros-seed", str(world.seed)] if world.is_drawn else []


def _kept(item: Any, world: World, failure: pytest.ExceptionInfo[BaseException]) -> Iterator[str]:
    """Close the world of a failed test, and yield what is kept of it."""
    from grader.world.keeping import keep_failure  # noqa: PLC0415 - takes long, and most tests pass

    why, folder = failure.exconly(tryshort=True).splitlines()[0], item.funcargs["tmp_path"]
    crash = failure.getrepr(style="short").reprcrash
    try:
        situation = world.situation()
        world.close()
        place = None if crash is None else (crash.path, crash.lineno)
        kept = world.keep(folder, why, place)
        facts = {
            "test": item.nodeid,
            "error": {"type": failure.typename, "message": str(failure.value)},
            "place": {"file": "" if crash is None else crash.path, "line": 0 if crash is None else crash.lineno},
            "race": item.stash.get(pytest_races.TOLD, []),
            "remarks": world.remarks,
            **situation,
            "repeat": ["pytest", item.nodeid.partition("[seed")[0], *_seed_options(world)],
            "files": list(map(str, kept)),
        }
        yield from map(str, [*kept, keep_failure(folder, facts)])
    except Exception as error:  # the failure of the test is what counts
        yield f"the recording was not kept: {type(error).__name__}: {error}"


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Note whether the programs of a process of pytest-xdist had a network of their own."""
    if shared := getattr(node, "workeroutput", {}).get(_OF_WORKER, ""):
        node.config.stash[_SHARED] = shared


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Say so if the programs had no network of their own."""
    if shared := config.stash.get(_SHARED, ""):
        terminalreporter.write_line(f"ros: the nodes shared the network of this machine ({shared})")


def _options(item: Any) -> dict[str, Any]:
    """Return the options of the marker that is nearest to a test."""
    options: dict[str, Any] = {}
    for marker in reversed(list(item.iter_markers("ros"))):
        options |= marker.kwargs
        unknown = [name for name in marker.kwargs if name not in _OPTIONS]
        if unknown or marker.args:
            found = unknown[0] if unknown else repr(marker.args[0])
            raise pytest.UsageError(f"@pytest.mark.ros: expected {', '.join(_OPTIONS)} by name, found {found}")
    if (clock := options.get("clock", "virtual")) not in _CLOCKS:
        raise pytest.UsageError(f"@pytest.mark.ros: clock: expected {' or '.join(_CLOCKS)}, found {clock!r}")
    if clock == "wall" and "seeds" in options:
        text = "seeds draws the order of what is ready, which the wall clock leaves to chance"
        raise pytest.UsageError(f"@pytest.mark.ros: {text}: write seed=N to draw delays and losses, or clock='virtual'")
    return options


def _clock(config: pytest.Config, options: dict[str, Any]) -> str:
    """Return the clock of a test: that of its marker, or else that of the command line."""
    clock: str = options.get("clock") or config.getoption("--ros-clock")
    return clock
