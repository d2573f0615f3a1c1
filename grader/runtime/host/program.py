"""Runs the student's file from start to end, and reports its end to the grader."""

from __future__ import annotations

import atexit
import contextlib
import functools
import gc
import importlib
import os
import random
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from . import closures, entry, machine, originals
from .covered import measure_lines
from .faults import Describer
from .link import Link, Log
from .outside import install_alarms, install_events
from .protocol import Exited, FaultReport, FilesWritten, Go, LaunchReport, Ready, ThreadFault
from .quick_imports import import_without_needless
from .replaced import guard_methods, hide_frames, rename_functions, without_own_frames
from .shadows import ROS_PARTS, Around
from .threads import report_threads
from .unseen import IMPORTS
from .virtual import VirtualTime
from .watch import Watch
from .watchdog import Watchdog
from .written import WrittenFiles, flush_open_files

if TYPE_CHECKING:
    from types import TracebackType

    from .wall import WallTime

#: The number of a descriptor above `starter.PARENT` that stays open in a forked process, None if there is none.
KEPT = closures.KEPT
#: Files whose frames lead to the program's own: this package, and the importing of a module.
STARTING = (os.path.join(os.path.dirname(__file__), ""), importlib.__file__, "<frozen importlib.")


class Host:
    """What a process needs before it runs a file: the clock, and the connection to the grader, which is not open yet.

    Args:
        clock: `virtual` or `wall`.
    """

    def __init__(self, clock: str) -> None:
        self.link = Link()
        self.describer = Describer()
        self.time = make_time(clock, self.link, self.describer)
        self.has_ros = False

    def install_ros(self, *, hidden: bool = False) -> None:
        """Import rclpy and install the clock in it, once.

        Args:
            hidden: Whether a module of the submission hides another one, so that whatever is imported may fail.
        """
        if not self.has_ros:
            if not hidden:
                import_without_needless("rosidl_generator_py")
            self.time.install_ros()
            guard_methods(ROS_PARTS)
        self.has_ros = True


def run(request: dict[str, Any], host: Host | None = None) -> None:  # noqa: PLR0915 - the order of what it does counts
    """Run the file that a request names; never returns.

    Args:
        request: `fd` of the socket, `root` and `file` of the submission, `clock` and the share of the work that is
            `charged` to it, `seed` (hex), and whether it decides what runs first of all that is ready (`drawn_order`),
            whether its files lie `in_place`, `log_format`, `limits`, `steady_ns` of `VirtualTime.start`,
            `interfaces`, the folders of interface packages that are not installed, how its lines are `measured`,
            None if they are not, and where its `debugger` is, None
            for none.
        host: What the parent process has prepared, if this process is a fork of one; no module of the submission may
            hide one that it has imported.
    """
    prepared = host is not None
    machine.install(request["root"], in_place=request["in_place"])
    sys.path += request["interfaces"]  # installed packages come first
    host = host or Host(request["clock"])
    link, describer, time = host.link, host.describer, host.time
    link.open(request["fd"])
    describer.set_root(request["root"])
    die_with_parent()
    log = Log(request["log_format"])
    ready = Ready(log.token)

    # A fork has imported rclpy already; one whose submission hides a module of it is executed instead.
    hidden = not prepared and hides_modules(request)

    def install_ros() -> None:
        host.install_ros(hidden=hidden)
        log.open()

    if prepared:
        install_ros()
    elif not hidden:  # otherwise done when the program imports rclpy
        install_ros()
        preload(os.path.join(request["root"], request["file"]))
    # Before imports are hidden, because what these import is none of the program's.
    time.before_stop = write_lines = observe_own(request)
    # After the imports of the host: what they draw must not shift what the program draws.
    seed_randomness(request["seed"])
    # A child of the student's would answer on the same socket. On the wall clock it may live, but says nothing; in
    # virtual time nobody could step it.
    os.register_at_fork(after_in_child=link.cut if request["clock"] == "wall" else lambda: originals.exit_now(70))
    # From here on the worker decides when the program runs.
    start = link.ask(ready)
    # The token is known to the logging library and the worker alone; the program could find this value.
    del ready
    assert isinstance(start, Go)
    if isinstance(time, VirtualTime):
        if request["drawn_order"]:
            time.order.begin(request["seed"])
            time.order.step(start.order)
        time.start(start.now_ns, request["steady_ns"], charged=request["charged"])
    else:
        time.start(start.now_ns, request["steady_ns"])
    watchdog = None
    if isinstance(time, VirtualTime) and not request["debugger"]:  # a debugger waits, and starts what it needs
        watchdog = Watchdog(link, time, describer, request["limits"])
    if isinstance(time, VirtualTime) and watchdog is not None:
        watchdog.start()
        install_alarms(functools.partial(watchdog.give_up_outside, "alarm"))
        install_events(watchdog.give_up_outside)
        time.give_up_outside = watchdog.give_up_outside
        if not request["in_place"]:  # nobody deceives whoever tests a program of their own
            Watch(link, request["root"]).install()
    # Last: what is replaced after this would show names of the host in tracebacks.
    rename_functions()
    hide_frames()
    home = os.environ.get("HOME", "")
    kept = tuple(os.path.join(home, name) for name in ("log", ".cache", ".config"))
    # Where a program runs in place, whoever started it finds its files there, among as many others as there may be.
    written = WrittenFiles(() if request["in_place"] else (request["root"], os.getcwd(), home), kept)
    # Last: what the host imports after this would show up. Where a module of the submission hides another one, rclpy is
    # not imported yet.
    if hidden:
        IMPORTS.end()
    else:
        IMPORTS.hide()
    ending = play(request, describer, link, install_ros)
    write_lines()  # after exit handlers and before modules are freed, as coverage does
    try:
        ending = clean_up(ending, request["root"], time, watchdog)
    except Exception as error:  # no code of the student runs there that could raise
        ending = ending._replace(fault=ending.fault or describer.exception(error), code=1)
    # Before the report: the worker reads what was written until then as the program's last words.
    flush()
    with contextlib.suppress(Exception):
        if found := written.files():
            link.send(FilesWritten(found))
    link.send(ending)
    originals.exit_now(0)


def observe_own(request: dict[str, Any]) -> Callable[[], None]:
    """Let a debugger and coverage see a program of whoever tests it; return what writes the lines that have run."""
    if request["debugger"]:
        from .debugging import let_stop  # with pdb, which no other program needs

        let_stop(request["debugger"], os.path.basename(request["file"]))
    return measure_lines(request["measured"]) if request["measured"] else lambda: None


def clean_up(ending: Exited, root: str, time: VirtualTime | WallTime, watchdog: Watchdog | None) -> Exited:
    """Do what the interpreter does after the end of a program, and return the last report with what it says of it.

    Args:
        ending: The last report so far.
        root: The submission's folder.
        time: The clock.
        watchdog: Stopped, because nothing can hang any more.
    """
    # In the order of the interpreter: open files are flushed, then modules are freed.
    time.finish()
    with contextlib.suppress(BaseException):
        flush_open_files()
    with contextlib.suppress(BaseException):
        forget_modules(root)
    if watchdog is not None:
        watchdog.stop()
    # After the modules: a `__del__` may still publish, and what it sends has to arrive.
    return ending._replace(left=time.end(), progress=time.progress())


def evaluate(request: dict[str, Any]) -> None:
    """Evaluate the launch file that a request names, and report what it describes; never returns.

    Args:
        request: As for `run`, with `launch`: its `arguments`, the `provided` files of the rubric, name and folder of
            the submission's `packages`, outermost first, and how much is described at `most`; see `describe`.
    """
    # Here, because processes that run nodes do without; before the submission's folders are searched for modules.
    from .launch.evaluation import describe

    IMPORTS.end()  # a launch file has modules of the grader in place of those that it imports
    machine.install(request["root"])
    link, describer = Link(), Describer()
    link.open(request["fd"])
    describer.set_root(request["root"])
    die_with_parent()
    link.ask(Ready())
    root, told = request["root"], request["launch"]
    own = os.path.join(os.environ.get("HOME") or tempfile.gettempdir(), "provided")
    installed = os.path.join(os.path.dirname(own), "installed")
    os.makedirs(own, exist_ok=True)
    for name, text in told["provided"]:
        with open(os.path.join(own, name), "w", encoding="utf-8") as file:
            file.write(text)
    here = own if request["file"] in dict(told["provided"]) else root
    try:
        path = os.path.join(here, request["file"])
        sys.argv = [path]
        # Reversed, so that of two packages with one name the outermost counts.
        packages = {name: os.path.join(root, folder).rstrip("/") for name, folder in reversed(told["packages"])}
        sys.path += [os.path.join(root, folder) for folder in request["imported"]]
        arguments = dict(told["arguments"])
        describer.hide(installed)
        folders = (root, own)
        found = describe(folders, path, packages, arguments, prefix=installed, **told["most"])
    except BaseException as error:  # whatever the launch file raises becomes a fault
        found = LaunchReport(fault=describer.exception(error))
    flush()
    link.send(found)
    originals.exit_now(0)


def make_time(clock: str, link: Link, describer: Describer) -> VirtualTime | WallTime:
    """Create the clock that a scenario runs on."""

    def report(fault: FaultReport) -> None:
        link.send(ThreadFault(fault))

    if clock == "virtual":
        time = VirtualTime(link)
        time.install(describer.exception, report)
        return time

    from .wall import WallTime

    report_threads(describer.exception, report)
    return WallTime(link)


def die_with_parent() -> None:
    """Make the kernel kill this process when its parent ends."""
    import ctypes

    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG, linux/prctl.h


def play(request: dict[str, Any], describer: Describer, link: Link, install_ros: Callable[[], None]) -> Exited:
    """Run the file and the interpreter's exit handlers; return how it ended."""
    ending = Exited(code=0)
    try:
        at_depth(lambda: entry.run_file(request, link.send, install_ros))
    except SystemExit as leaving:
        ending = Exited(code=exit_code(leaving))
    # Ctrl-C without a handler ends Python with 130, 128 and the number of the signal.
    except KeyboardInterrupt:
        ending = Exited(code=130)
    except BaseException as error:  # whatever the student's code raises becomes a fault
        ending = Exited(code=1, fault=describer.exception(error))
        # What the program prints about its own end is what it would print without the host.
        BaseException.with_traceback(error, of_program(error.__traceback__))
        without_own_frames(error)
        sys.last_type, sys.last_value, sys.last_traceback = type(error), error, error.__traceback__
        sys.excepthook(type(error), error, error.__traceback__)
    with contextlib.suppress(BaseException):
        # Threads before exit handlers, as Python waits for the first before it calls the second.
        finish_threads()
        atexit._run_exitfuncs()
    return ending


#: How many frames of Python are below `at_depth` in a fork, which has the most.
DEPTH = 6


def at_depth(run: Callable[[], None]) -> None:
    """Call a function at the depth of a fork, so that a program can recurse as deep however it was started."""
    depth, frame = 0, sys._getframe().f_back
    while frame is not None:
        depth, frame = depth + 1, frame.f_back
    if depth < DEPTH:
        at_depth(run)
    else:
        run()


def of_program(frames: TracebackType | None) -> TracebackType | None:
    """Return a traceback without the frames that started the program, as Python prints it for `python3 FILE`."""
    while frames is not None and frames.tb_frame.f_code.co_filename.startswith(STARTING):
        frames = frames.tb_next
    return frames


def forget_modules(root: str) -> None:
    """Free the student's modules, as the interpreter does when it exits: a `__del__` may publish.

    Imports fail at that stage, for instance those of rclpy's loggers.

    Args:
        root: The submission's folder. Only its modules are freed, because others may still be needed.
    """
    sys.last_type = sys.last_value = sys.last_traceback = None
    kept, finders = dict(sys.modules), sys.meta_path
    inside = os.path.join(root, "")
    for name, module in list(kept.items()):
        if name == "__main__" or str(getattr(module, "__file__", None)).startswith(inside):
            del kept[name]
    del module
    sys.modules.clear()
    sys.meta_path = None  # type: ignore[assignment]
    try:
        gc.collect()
    finally:
        sys.modules.update(kept)
        sys.meta_path = finders


def finish_threads() -> None:
    """Wait for all non-daemon threads, as the interpreter does when it exits."""
    # In reverse order, as the interpreter calls them: pools of threads end here, and are told before they are joined.
    for call in reversed(getattr(threading, "_threading_atexits", [])):
        call()
    while threads := [t for t in threading.enumerate() if t is not threading.current_thread() and not t.daemon]:
        for thread in threads:
            thread.join()


def exit_code(leaving: SystemExit) -> int:
    """Return Python's exit code for a SystemExit, and print its message as Python does."""
    if leaving.code is None:
        return 0
    if isinstance(leaving.code, int):
        # The kernel keeps eight bits of an exit code.
        return leaving.code & 0xFF
    print(leaving.code, file=sys.stderr)  # noqa: T201 - this is what the interpreter does
    return 1


def seed_randomness(seed: str) -> None:
    """Make every source of randomness in this process repeatable for the same seed."""
    source, original_getrandom = random.Random(seed), os.getrandom  # noqa: S311 - it has to repeat

    def urandom(*arguments: Any, **named: Any) -> bytes:
        return source.randbytes(len(originals.urandom(*arguments, **named)))  # which raises for what it does not take

    def getrandom(*arguments: Any, **named: Any) -> bytes:
        return source.randbytes(len(original_getrandom(*arguments, **named)))

    seed_generator = random.Random.seed

    @functools.wraps(seed_generator)
    def seed_from_source(self: random.Random, a: Any = None, version: int = 2) -> None:
        seed_generator(self, int.from_bytes(urandom(32), "big") if a is None else a, version)

    # All of `secrets`, `uuid4` and unseeded generators draw from these.
    os.urandom, os.getrandom = urandom, getrandom
    random._urandom = urandom  # type: ignore[attr-defined]
    random.Random.seed = seed_from_source  # type: ignore[method-assign]
    random.seed = random._inst.seed
    random.seed(seed + "/random")
    by_seed = int(seed[:8], 16)

    @contextlib.contextmanager
    def apart() -> Iterator[None]:
        """Let the import of numpy's randomness draw nothing from the source that the program draws from."""
        state = source.getstate()
        yield
        module = sys.modules["numpy.random"]
        if hasattr(module, "mtrand"):  # otherwise it is a module of the student's
            source.setstate(state)
            module.seed(by_seed)

    if "numpy.random" in sys.modules:  # as in each fork
        sys.modules["numpy.random"].seed(by_seed)
    else:
        sys.meta_path.insert(0, Around("numpy.random", apart))


#: The common interface packages, and those whose interfaces they use.
INTERFACES = {
    "geometry_msgs.msg": ("std_msgs.msg",),
    "nav_msgs.msg": ("geometry_msgs.msg", "std_msgs.msg"),
    "sensor_msgs.msg": ("geometry_msgs.msg", "std_msgs.msg"),
    "std_msgs.msg": (),
    "std_srvs.srv": (),
}

#: The interface packages of the services that every node has.
OF_EVERY_NODE = ("rcl_interfaces.msg", "rcl_interfaces.srv", "type_description_interfaces.srv")


def preload(path: str) -> None:
    """Import the common interface packages that a file names, before time starts.

    Others are not imported: most of them import numpy, which takes as long as all of rclpy.

    Args:
        path: The file; if it cannot be read, running it reports the error.
    """
    for name in _named(path):
        importlib.import_module(name)


def _named(path: str) -> list[str]:
    text = b""
    with contextlib.suppress(OSError), open(path, "rb") as source:
        text = source.read()
    return [name for name in INTERFACES if name.partition(".")[0].encode() in text]


def warm_up() -> None:
    """Import what all forks of this process need: interface packages, type supports, numpy's randomness."""
    importlib.import_module("numpy.random")  # seeded in each fork
    importlib.import_module("uuid")
    for name in (*INTERFACES, *OF_EVERY_NODE):
        for interface in list(vars(importlib.import_module(name)).values()):
            if hasattr(interface, "__import_type_support__"):
                interface.__import_type_support__()


def keep_interfaces(request: dict[str, Any]) -> None:
    """Forget the interface packages that `preload` would not have imported: a program has to import them itself."""
    named = _named(os.path.join(request["root"], request["file"]))
    # Not only what it names: an interface package imports those whose messages it holds.
    kept = {*named, *(other for name in named for other in INTERFACES[name])}
    forgotten = {name.partition(".")[0] for name in INTERFACES if name not in kept}
    for name in [name for name in sys.modules if name.partition(".")[0] in forgotten]:
        del sys.modules[name]


def hides_modules(request: dict[str, Any]) -> bool:
    """Return whether a module of the submission hides one that this process has imported already."""
    return bool(entry.shadows_of(request).files)


def flush() -> None:
    """Flush Python's standard streams."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(Exception):
            stream.flush()
