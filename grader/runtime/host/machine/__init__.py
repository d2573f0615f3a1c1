"""What a student's program sees of the machine: fixed answers in place of the machine's own.

The table in docs/reference/machine.md describes each of them. This file imports only the standard library, because a
bare process, which holds nothing else of the grader, runs it as well (`sitecustomize.py`).
"""

from __future__ import annotations

import builtins
import contextlib
import functools
import importlib.machinery
import importlib.util
import io
import os
import platform
import pwd
import signal
import socket
import sys
from collections.abc import Callable, Iterator, Mapping
from types import ModuleType
from typing import Any

#: Processors of the machine that every program sees: as many as a small laptop has. rclpy's MultiThreadedExecutor
#: starts so many threads; with a single one, correct programs that call a service in a callback wait forever.
PROCESSORS = 4
#: The user that every program runs as, with its group.
USER, USER_ID, SHELL = "student", 1000, "/bin/bash"
HOST_NAME, ADDRESS, ADDRESS_6 = "student", "127.0.0.1", "::1"
LOCAL_NAMES = frozenset({"localhost", HOST_NAME})
#: The kernel of Ubuntu 24.04, the system of ROS 2 Jazzy.
RELEASE, VERSION = "6.8.0-generic", "#1 SMP"
#: The hardware address of the network card, in the range for local use.
NODE = 0x02_00_00_00_00_01
UMASK = 0o022
#: The variable that chooses matplotlib's backend, and its value. Its own choice would be a backend without windows.
BACKEND = {"MPLBACKEND": "module://matplotlib.backends.backend_tkagg"}
#: The variable that chooses the ROS domain of nodes that choose none themselves.
DOMAIN_VARIABLE = "ROS_DOMAIN_ID"
#: The variables that change the format, the colours and the stream of logs.
LOG_VARIABLES = ("RCUTILS_CONSOLE_OUTPUT_FORMAT", "RCUTILS_COLORIZED_OUTPUT", "RCUTILS_LOGGING_USE_STDOUT")
#: The folder for temporary files that programs name themselves.
TEMPORARY = "/tmp"  # noqa: S108 - no file is created there
#: Functions of `os` whose first arguments are paths, and how many of them.
_WITH_PATHS = {
    **dict.fromkeys(("open", "stat", "lstat", "access", "listdir", "scandir", "chdir", "mkdir", "rmdir"), 1),
    **dict.fromkeys(("remove", "unlink", "chmod", "utime", "truncate", "readlink", "mkfifo", "statvfs"), 1),
    **dict.fromkeys(("getxattr", "listxattr", "setxattr", "removexattr"), 1),
    **dict.fromkeys(("rename", "replace", "link", "symlink"), 2),
}
#: Those of them that the sandboxes without a view of files of their own forbid, also for the program's own files.
_FORBIDDEN = frozenset({"chmod", "utime"})
#: The names of these arguments, in `os`, `open` and `sqlite3.connect`.
_PATH_ARGUMENTS = frozenset({"path", "src", "dst", "file", "database"})
_FOLDER = os.path.dirname(os.path.abspath(__file__))
#: What `backend_NAME.py` begins with for those that open windows.
_TOOLKITS = ("gtk", "macosx", "qt", "tk", "wx")
#: What OpenCV does with windows and returns nothing.
_WINDOW_FUNCTIONS = (
    *("imshow", "namedWindow", "destroyWindow", "destroyAllWindows", "moveWindow", "resizeWindow", "setWindowTitle"),
    *("setWindowProperty", "createTrackbar", "setTrackbarPos", "setTrackbarMin", "setTrackbarMax", "setMouseCallback"),
)
#: Signals that Python ignores in every process.
_IGNORED_BY_PYTHON = frozenset({signal.SIGPIPE, signal.SIGXFSZ})


def install(root: str = "", *, bare: bool = False, in_place: bool = False) -> None:
    """Replace the functions of the standard library through which a program asks about the machine.

    Args:
        root: The folder of the submission; without one, it is where the program is.
        bare: Whether nothing else of the grader is in this process, which then reads how logs look by itself.
        in_place: Whether the program sees and changes the same files as whoever started it.
    """
    # A bare process has this module, by which Python has found this file; all others have one like it.
    sys.modules["sitecustomize"] = ModuleType("sitecustomize")
    even_inherited()
    _install_processors()
    _install_user()
    _install_host()
    _install_names()
    _install_folders()
    own_domain = functools.partial(_with_own_domain, given=os.environ.get(DOMAIN_VARIABLE, ""))
    if "rclpy.context" in sys.modules:  # a fork of a process that has imported it
        own_domain(sys.modules["rclpy.context"])
    changes: dict[str, Callable[[Any], None]] = {"cv2": _without_windows, "rclpy.context": own_domain}
    if bare:
        changes["rclpy.impl.implementation_singleton"] = _with_usual_logs
    temporary = os.environ.get("TMPDIR", TEMPORARY)
    if temporary != TEMPORARY and not in_place:
        changes["sqlite3"] = _install_temporary_folder(temporary, root)
    sys.meta_path.insert(0, Changes(changes))


def even_inherited() -> None:
    """Undo what a process inherits from the shell of whoever grades: its umask, and ignored or blocked signals."""
    os.umask(UMASK)
    for number in signal.valid_signals():
        if signal.getsignal(number) is signal.SIG_IGN and number not in _IGNORED_BY_PYTHON:
            signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, ())


def _install_processors() -> None:
    chosen = frozenset(range(PROCESSORS))
    affinity = {0: chosen}
    get, choose = os.sched_getaffinity, os.sched_setaffinity

    def sched_getaffinity(pid: int, /) -> set[int]:
        return set(affinity[0]) if pid in (0, os.getpid()) else get(pid)

    def sched_setaffinity(pid: int, mask: Any, /) -> None:
        if pid not in (0, os.getpid()):
            choose(pid, mask)
            return
        wanted = chosen & frozenset(mask)
        if not wanted:
            raise OSError(22, os.strerror(22))
        affinity[0] = wanted

    os.sched_getaffinity, os.sched_setaffinity = sched_getaffinity, sched_setaffinity
    os.cpu_count = lambda: PROCESSORS
    if hasattr(os, "process_cpu_count"):  # Python 3.13
        os.process_cpu_count = lambda: len(affinity[0])


def _install_user() -> None:
    for name in ("getuid", "geteuid", "getgid", "getegid"):
        setattr(os, name, lambda: USER_ID)
    os.getresuid = os.getresgid = lambda: (USER_ID, USER_ID, USER_ID)
    os.getgroups = lambda: [USER_ID]
    os.getlogin = lambda: USER  # without a terminal, the system knows of no login
    get = pwd.getpwuid

    @functools.wraps(get)
    def getpwuid(wanted: Any, /) -> pwd.struct_passwd:
        if wanted != USER_ID:
            return get(wanted)
        return pwd.struct_passwd((USER, "x", USER_ID, USER_ID, USER, os.environ.get("HOME") or "/", SHELL))

    pwd.getpwuid = getpwuid


def _install_host() -> None:
    uname = os.uname
    os.uname = lambda: os.uname_result(("Linux", HOST_NAME, RELEASE, VERSION, uname().machine))
    platform._uname_cache = None  # type: ignore[attr-defined]
    platform._platform_cache.clear()  # type: ignore[attr-defined]
    socket.gethostname = lambda: HOST_NAME
    socket.gethostbyname, socket.getaddrinfo = map(_resolving, (socket.gethostbyname, socket.getaddrinfo))


def _resolving(original: Any) -> Any:
    """Return a function of `socket` that knows this host's names without reading any file of the machine."""

    @functools.wraps(original)
    def resolve(host: Any = None, *arguments: Any, **named: Any) -> Any:
        plain = host.decode("ascii", "replace") if isinstance(host, (bytes, bytearray)) else host
        if plain in LOCAL_NAMES:
            family = named.get("family", arguments[1] if len(arguments) > 1 else 0)
            host = ADDRESS_6 if family == socket.AF_INET6 else ADDRESS
        return original(host, *arguments, **named)

    return resolve


def _install_names() -> None:
    """Let `uuid.uuid1` use the clock and the randomness of this process, and a fixed hardware address."""
    import uuid

    fixed: Any = uuid
    fixed._node = NODE  # what getnode() keeps of its first call
    fixed._generate_time_safe = fixed._UuidCreate = None
    if hasattr(uuid, "_load_system_functions"):
        uuid._load_system_functions = lambda: None


class _Sorted:
    """What `os.scandir` returns, in the order of the names.

    Args:
        entries: The iterator of the system.
    """

    def __init__(self, entries: Any) -> None:
        self._entries = entries
        self._sorted: Iterator[Any] | None = None

    def __iter__(self) -> _Sorted:
        return self

    def __next__(self) -> Any:
        if self._sorted is None:
            self._sorted = iter(sorted(self._entries, key=lambda entry: entry.name))
        return next(self._sorted)

    def __enter__(self) -> _Sorted:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the folder."""
        self._entries.close()
        self._sorted = iter(())


def _install_folders() -> None:
    """List folders in the order of names; file systems keep entries in an order of their own."""
    listdir, scandir = os.listdir, os.scandir

    @functools.wraps(listdir)
    def sorted_listdir(path: Any = None) -> Any:
        return sorted(listdir(path))

    @functools.wraps(scandir)
    def sorted_scandir(path: Any = None) -> Any:
        return _Sorted(scandir(path))

    os.listdir, os.scandir = sorted_listdir, sorted_scandir
    os.supports_fd.update((sorted_listdir, sorted_scandir))


def _install_temporary_folder(folder: str, root: str) -> Callable[[Any], None]:
    """Let /tmp be another folder for Python's functions, and return what makes it so for the module `sqlite3`.

    Where a process has no view of files of its own, it may write to that folder only. Python, ROS and the submission,
    in the folder `root`, stay where they are.
    """

    def moved(path: Any) -> Any:
        plain = os.fspath(path) if hasattr(path, "__fspath__") else path
        if isinstance(plain, bytes):
            return os.fsencode(moved(os.fsdecode(plain)))
        if isinstance(plain, str) and ".." in plain:
            plain = os.path.normpath(plain)
        if not isinstance(plain, str) or not (plain + "/").startswith(TEMPORARY + "/"):
            return path
        within = plain[len(TEMPORARY) :].lstrip("/")
        first = os.path.join(TEMPORARY, within.partition("/")[0], "")
        installed = (folder, root, sys.prefix, sys.base_prefix, *sys.path, *sys.argv[:1])
        is_installed = any(os.path.join(place, "").startswith(first) for place in installed if type(place) is str)
        return path if within and is_installed else os.path.join(folder, within)

    def with_moved(function: Any, paths: int) -> Any:
        @functools.wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:
            first = [moved(argument) for argument in arguments[:paths]]
            named = {name: moved(value) if name in _PATH_ARGUMENTS else value for name, value in named.items()}
            return function(*first, *arguments[paths:], **named)

        return call

    def tolerant(function: Any) -> Any:
        @functools.wraps(function)
        def call(path: Any, *arguments: Any, **named: Any) -> None:
            try:
                function(path, *arguments, **named)
            except PermissionError:
                if type(path) is int or not os.path.realpath(os.fsdecode(path)).startswith(folder):
                    raise
                stat(path)

        return call

    stat = os.stat
    for name, paths in _WITH_PATHS.items():
        original = getattr(os, name)
        replaced = with_moved(tolerant(original) if name in _FORBIDDEN else original, paths)
        setattr(os, name, replaced)
        for kind in (os.supports_dir_fd, os.supports_fd, os.supports_follow_symlinks, os.supports_effective_ids):
            if original in kind:
                kind.add(replaced)
    builtins.open = io.open = with_moved(open, 1)

    def move_databases(sqlite3: Any) -> None:
        sqlite3.connect = with_moved(sqlite3.connect, 1)

    return move_databases


class Changes:
    """Finds the modules that ask for the screen, fonts, /tmp or the ROS domain of the machine, and changes them.

    Args:
        changes: What is done to modules after their import, by their name.
    """

    def __init__(self, changes: Mapping[str, Callable[[Any], None]]) -> None:
        self._changes = changes

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Any:
        """Return the spec of one of these modules; None for any other."""
        if name in self._changes:
            return self._changed(name, path, target, self._changes[name])
        if not name.startswith("matplotlib."):
            return None
        if name == "matplotlib.font_manager":
            return self._changed(name, path, target, None)
        package, _, last = name.rpartition(".backend_")
        if package != "matplotlib.backends" or not last.startswith(_TOOLKITS) or last.endswith("cairo"):
            return None
        return importlib.util.spec_from_file_location(name, os.path.join(_FOLDER, "windows.py"))

    def _changed(self, name: str, path: Any, target: Any, change: Callable[[Any], None] | None) -> Any:
        """Return the spec of a module as others find it, whose import changes something."""
        others = (finder for finder in sys.meta_path if finder is not self and hasattr(finder, "find_spec"))
        spec = next((found for other in others if (found := other.find_spec(name, path, target)) is not None), None)
        if spec is None or spec.loader is None:
            return spec
        execute = spec.loader.exec_module

        def exec_module(module: ModuleType) -> None:
            if change is None:
                _with_own_fonts(lambda: execute(module))
                return
            execute(module)
            change(sys.modules.get(name, module))

        with contextlib.suppress(AttributeError):
            spec.loader.exec_module = exec_module  # type: ignore[method-assign]
        return spec


def _with_own_domain(module: Any, given: str) -> None:
    """Let rclpy's contexts take ROS domain 0, in which nodes are on a machine where nobody chose one, for a given one.

    Args:
        module: `rclpy.context`, or a module of the program in its place.
        given: The domain that the grader chose for this process.
    """
    context: Any = getattr(module, "Context", None)
    if not given.isdecimal() or not hasattr(context, "init"):
        return
    init = context.init

    @functools.wraps(init)
    def init_in_domain(*arguments: Any, **named: Any) -> Any:
        chosen = named.get("domain_id")
        # ROS itself says what is wrong with a value that is not a number.
        if chosen == 0 or (chosen is None and os.environ.get(DOMAIN_VARIABLE, "") in ("", "0")):
            named["domain_id"] = int(given)
        return init(*arguments, **named)

    context.init = init_in_domain


def _with_usual_logs(module: Any) -> None:
    """Let the library that writes logs read its variables now, without those by which a program changes how logs look.

    What it logs could not be told from what it prints otherwise. C code sees these variables again afterwards.

    Args:
        module: The module that holds rclpy's functions in C++.
    """
    chosen = {name: os.environ[name] for name in LOG_VARIABLES if name in os.environ}
    for name in chosen:
        os.unsetenv(name)
    try:
        module.rclpy_implementation.rclpy_logging_initialize()
    finally:
        for name, value in chosen.items():
            os.putenv(name, value)


def _with_own_fonts(work: Callable[[], None]) -> None:
    """Import matplotlib's list of fonts without those of this system, which are others on each machine."""
    import subprocess

    started, walked = subprocess.check_output, os.walk

    def check_output(*arguments: Any, **named: Any) -> Any:
        raise FileNotFoundError(2, os.strerror(2), "fc-list")

    def walk(top: Any, *arguments: Any, **named: Any) -> Any:
        return walked(top, *arguments, **named) if "mpl-data" in str(top) else iter(())

    subprocess.check_output, os.walk = check_output, walk
    try:
        work()
    finally:
        subprocess.check_output, os.walk = started, walked


def _without_windows(cv2: Any) -> None:
    """Let OpenCV open windows that nobody sees, in which nobody types: its build for servers has none, and raises.

    Its clock becomes that of `time.monotonic`.
    """
    import time

    def wait_key(delay: int = 0) -> int:
        while delay <= 0:
            time.sleep(0.1)
        time.sleep(delay / 1000)
        return -1

    def ticks() -> int:
        return time.monotonic_ns()

    def nothing(*arguments: Any, **named: Any) -> None:
        pass

    for name in _WINDOW_FUNCTIONS:
        setattr(cv2, name, nothing)
    cv2.waitKey = cv2.waitKeyEx = wait_key
    cv2.pollKey = lambda: -1
    cv2.getTickCount, cv2.getTickFrequency = ticks, lambda: 1e9
    cv2.startWindowThread = cv2.getTrackbarPos = lambda *arguments: 0
    cv2.getWindowProperty = lambda *arguments: 1.0
