"""Finds the names in a syntax tree that reach into the internals of the process; it looks at each node a few times.

What is inside of an expression is found by going up from what is looked for, once for each, and never by searching
every expression.
"""

from __future__ import annotations

import ast
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence

from grader.grading.judging.source import Source, chain
from grader.grading.submissions.revealing import orders, read_attributes, shown_functions


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


#: Modules that show or change the internals of a process, or start others.
_MODULES = _words(
    "gc ctypes cffi inspect dis marshal types tracemalloc faulthandler resource psutil time_machine "
    "freezegun subprocess multiprocessing pty fcntl mmap _thread _socket _ctypes _posixsubprocess pickle code codeop "
    "runpy imp weakref builtins __main__ site sysconfig importlib pkgutil zipimport cProfile profile pdb bdb select "
    "selectors forbiddenfruit wrapt mock platform pydoc doctest trace linecache reprlib pprint zipfile py_compile "
    "compileall copyreg"
)
#: Names in modules that ordinary programs use: full dotted names.
_NAMES = _words(
    "sys._getframe sys._current_frames sys._current_exceptions sys.modules sys.settrace sys.setprofile sys.gettrace "
    "sys.getprofile sys.addaudithook sys.meta_path sys.path_hooks sys.flags sys.orig_argv sys.getrefcount "
    "sys._clear_type_cache sys.excepthook sys.setswitchinterval sys.getswitchinterval sys.__stdout__ sys.__stderr__ "
    "os.times os.stat os.lstat os.fstat os.scandir os.walk os.system os.popen os.fork os.forkpty os.posix_spawn "
    "os.posix_spawnp os.getppid os.getpid os.read os.write os.dup os.dup2 os.pipe os.fdopen os.readlink os.kill "
    "os.register_at_fork os.sched_yield os.getloadavg os.nice os.path.getmtime os.path.getctime os.path.getatime "
    "os.urandom os.getrandom time.process_time time.process_time_ns time.thread_time time.thread_time_ns "
    "time.clock_gettime time.clock_gettime_ns time.get_clock_info time.pthread_getcpuclockid threading.enumerate "
    "threading.active_count threading._active threading.main_thread threading.settrace threading.setprofile "
    "threading.get_native_id threading.get_ident threading._start_new_thread socket.socket socket.fromfd "
    "socket.create_connection socket.socketpair socket.SOCK_STREAM asyncio.create_subprocess_exec "
    "asyncio.create_subprocess_shell atexit._run_exitfuncs atexit._clear signal.setitimer signal.set_wakeup_fd "
    "rclpy.impl rclpy.impl.implementation_singleton rclpy._rclpy_pybind11 traceback.extract_stack traceback.walk_stack "
    "traceback.format_stack traceback.print_stack traceback.walk_tb traceback.extract_tb traceback.StackSummary "
    "traceback.FrameSummary traceback.TracebackException numpy.datetime64 uuid.uuid1 unittest.mock logging.config "
    "operator.attrgetter operator.methodcaller string.Formatter sys.path_importer_cache sys.displayhook sys.hash_info "
    "concurrent.futures.ProcessPoolExecutor numpy.memmap numpy.ctypeslib"
)
#: Modules that others of the standard library have as attributes, such as `logging.sys`, under these names.
_PASSED_ON = _MODULES | _words("sys os _sys _os")
#: Attributes that reach internals, whatever object they are read from.
_ATTRIBUTES = _words(
    "__closure__ __globals__ __code__ __wrapped__ __builtins__ __subclasses__ __mro__ __bases__ __getattribute__ "
    "__loader__ __spec__ __self__ __func__ __defaults__ __kwdefaults__ __qualname__ __module__ __dict__ cell_contents "
    "f_back f_globals f_locals f_code f_builtins tb_frame gi_frame cr_frame ag_frame co_filename co_names co_consts "
    "st_mtime st_mtime_ns st_ctime st_ctime_ns st_atime st_atime_ns st_ino exec_module load_module reload "
    "import_module getrusage CLOCK_PROCESS_CPUTIME_ID CLOCK_THREAD_CPUTIME_ID CLOCK_BOOTTIME CLOCK_MONOTONIC_RAW "
    "CLOCK_REALTIME CLOCK_MONOTONIC handle implementation_singleton rclpy_implementation tm_year tm_mon tm_mday "
    "tm_yday year month day toordinal fromordinal "
    "__traceback__ tb_next relativeCreated __array_interface__"
)
#: Built-in functions that run code or look up names at run time.
_BUILTINS = _words("exec eval compile __import__ globals locals vars dir memoryview breakpoint id hash")
#: Functions that classify an object; applied to a module's function, they reveal that it was replaced.
_ASKING = _words("type repr str isinstance issubclass hasattr getattr setattr delattr callable format")
#: Parts of string literals that name paths or settings of the process.
_TEXTS = (
    *("/proc", "/sys/", "/dev/shm", "/dev/fd", "/submission", "_grader", "grader_host"),  # noqa: S108 - looked for
    *("RCUTILS_", "FASTRTPS", "FASTDDS", "PYTHONHASHSEED", "LD_PRELOAD", "_ROS_WHEELS", "GRADER_"),
    *("_rclpy", "__class__", "__code__", "__wrapped__", "__globals__"),
)
#: The first folder of such a path where a program joins its parts: `Path("/", "proc", "self")`.
_FOLDERS = ("proc", "shm")
#: Functions that read the time, by the clock they use: a program with two may compare them.
_CLOCKS = {
    "time.time": "system",
    "time.time_ns": "system",
    "datetime.datetime.now": "system",
    "datetime.datetime.utcnow": "system",
    "datetime.datetime.today": "system",
    "time.monotonic": "steady",
    "time.monotonic_ns": "steady",
    "time.perf_counter": "steady",
    "time.perf_counter_ns": "steady",
}
#: Functions that return the date or the time of day; comparing the result, or a part of it, is more than printing.
_CALENDARS = _words(
    "time.strftime time.ctime time.asctime time.localtime time.gmtime email.utils.formatdate datetime.date.today"
)
_TOLD = _words("strftime isoformat isocalendar isoweekday weekday timetuple ctime")
#: Clock differences that programs do not act on, in seconds and in nanoseconds.
_TINY_S, _TINY_NS = 1e-3, 1_000_000
#: What reads a clock or a time in nanoseconds, by the last part of its name.
_IN_NS = _words("time_ns monotonic_ns perf_counter_ns nanoseconds")
#: A number between these, in seconds or nanoseconds since 1970, is a date that a program compares with.
_DATES = ((1.5e9, 2.5e9), (1.5e18, 2.5e18))


def reaching(source: Source) -> tuple[str, ...]:
    """Return the names by which a file reaches into its process, in order without duplicates; usually none."""
    shown = (*shown_functions(source), *orders(source))
    return tuple(dict.fromkeys((*_imports(source), *_named(source), *_computed(source), *_timing(source), *shown)))


#: The most parts of a name in `_NAMES`, and the names without the modules that they are in.
_MOST_PARTS = max(name.count(".") + 1 for name in _NAMES)
_LAST_PARTS = frozenset(name.rpartition(".")[2] for name in _NAMES)


def _is_known(name: str) -> bool:
    """Return whether a dotted name is one of the names, or in one of them."""
    parts = name.split(".", _MOST_PARTS)[:_MOST_PARTS]
    return any(".".join(parts[:count]) in _NAMES for count in range(1, len(parts) + 1))


def _imports(source: Source) -> Iterator[str]:
    for node in source.nodes:
        if isinstance(node, ast.Import):
            names = [name.name for name in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names = [f"{node.module}.{name.name}" for name in node.names]
            if str(node.module).partition(".")[0] in sys.stdlib_module_names:
                yield from (f"{node.module}.{name.name}" for name in node.names if name.name in _PASSED_ON)
        else:
            continue
        for name in names:
            if name.partition(".")[0] in _MODULES or _is_known(name):
                yield name
            yield from (part for part in _TEXTS if part in name)


def _named(source: Source) -> Iterator[str]:
    yield from (name for name in read_attributes(source) if name in _ATTRIBUTES or name.startswith("_"))
    for node in source.nodes:
        if isinstance(node, ast.Attribute):
            name = source.resolved(node)
            # However a module is reached: `logging.sys.modules` is `sys.modules`.
            if node.attr in _ATTRIBUTES or name in _NAMES or ".".join(name.split(".")[-2:]) in _NAMES:
                yield node.attr if node.attr in _ATTRIBUTES else name
            elif node.attr == "__doc__" or (_is_private(node.attr) and chain(node.value) in source.aliases):
                yield name
        elif isinstance(node, ast.Name) and node.id in (_BUILTINS | _ATTRIBUTES):
            yield node.id
        elif isinstance(node, ast.Constant) and isinstance(node.value, (str, bytes)):
            value = node.value if isinstance(node.value, str) else node.value.decode("latin-1")
            yield from (part for part in _TEXTS if part in value)
            yield from (f"/{part}" for part in _FOLDERS if value.strip("/").partition("/")[0] == part)
        elif isinstance(node, ast.keyword) and node.arg in ("stack_info", "stacklevel"):
            yield node.arg
        elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
            if any(low <= node.value <= high for low, high in _DATES):
                yield "a date"


def _is_private(name: str) -> bool:
    return name.startswith("_") and not name.endswith("__")


def _computed(source: Source) -> Iterator[str]:
    """Yield names looked up by computed text, and functions whose type is asked for."""
    spelt = _loops_over_texts(source)
    for call in source.all(ast.Call):
        name = chain(call.func)
        if name in ("getattr", "setattr", "delattr") and not _shows_attribute(call, spelt):
            yield f"{name} of a name that is worked out"
        elif name in ("getattr", "setattr", "delattr", "hasattr") and _named_by_text(call, source):
            yield f"{name} of {_named_by_text(call, source)}"
        elif name in _ASKING and any(_of_module(argument, source) for argument in call.args):
            yield f"{name} of a function"
        elif name.endswith("environ.items") or (name in ("dict", "list", "sorted", "len") and _takes_environ(call)):
            yield "os.environ"


def _loops_over_texts(source: Source) -> frozenset[str]:
    """Return the loop variables that only take string literals of the file."""
    inner = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
    loops: list[ast.For | ast.comprehension] = [*source.all(ast.For)]
    loops += [loop for node in source.nodes if isinstance(node, inner) for loop in node.generators]
    named = [
        loop.target.id
        for loop in loops
        if isinstance(loop.target, ast.Name)
        and isinstance(loop.iter, (ast.Tuple, ast.List, ast.Set))
        and not any(_may_name_internals(text) for text in loop.iter.elts)
    ]
    given = Counter(name.id for name in source.all(ast.Name) if isinstance(name.ctx, ast.Store))
    return frozenset(name for name, count in Counter(named).items() if given[name] == count)


def _may_name_internals(node: ast.expr) -> bool:
    """Return whether an expression may be anything but a text that names nothing internal."""
    if not isinstance(node, ast.Constant) or not isinstance(node.value, str):
        return True
    return node.value in _ATTRIBUTES or node.value in _LAST_PARTS


def _shows_attribute(call: ast.Call, spelt: frozenset[str]) -> bool:
    """Return whether the text shows which attribute a call uses, or the call sets one in `self`."""
    if len(call.args) > 1 and (isinstance(call.args[1], ast.Constant) or chain(call.args[1]) in spelt):
        return True
    return chain(call.func) == "setattr" and bool(call.args) and chain(call.args[0]) == "self"


def _named_by_text(call: ast.Call, source: Source) -> str:
    """Return the name that a call looks up by its text, if it is a suspicious one; empty otherwise."""
    if len(call.args) < 2 or not isinstance(call.args[1], ast.Constant) or not isinstance(call.args[1].value, str):
        return ""
    name = f"{source.resolved(call.args[0])}.{call.args[1].value}"
    return name if name in _NAMES or call.args[1].value in _ATTRIBUTES else ""


def _of_module(node: ast.expr, source: Source) -> bool:
    """Return whether an expression is a module or an attribute of one, and not the result of a call."""
    name = chain(node)
    called = isinstance(node, ast.Call)
    return not called and name.partition(".")[0] in source.aliases and name.rpartition(".")[2][:1].islower()


def _takes_environ(call: ast.Call) -> bool:
    return any(chain(argument).endswith("environ") for argument in call.args)


def _timing(source: Source) -> Iterator[str]:
    """Yield two clocks in one file, and loops that count how often they read one."""
    clocks = {clock for node in source.names() if (clock := _CLOCKS.get(source.resolved(node)))}
    if len(clocks) > 1:
        yield "two clocks"
    times = Times(source)
    if any(_compares(node, source, times) for node in source.nodes):
        yield "a clock that is compared"
    if any(_looks_closely(node, times) for node in source.nodes):
        yield "a part of a clock's reading"
    if any(_collects(node, times) for node in source.nodes):
        yield "a clock that is read repeatedly"
    looking = _around(source, (n for n in source.names() if source.resolved(n) in _CLOCKS))
    waiting = _around(source, (c for c in source.all(ast.Call) if chain(c.func).rpartition(".")[2] in _WAITING))
    counting = _around(source, source.all(ast.AugAssign))
    for loop in source.all(ast.While):
        if loop in looking and loop not in waiting and loop in counting:
            yield "a loop that counts"


def _around(source: Source, nodes: Iterable[ast.AST]) -> set[ast.AST]:
    """Return some nodes and everything that they are inside of."""
    found: set[ast.AST] = set()
    for node in nodes:
        here: ast.AST | None = node
        while here is not None and here not in found:
            found.add(here)
            here = source.parents.get(here)
    return found


#: Operators after which a time is not a date any more: a difference or a remainder.
_LESS = (ast.Sub, ast.Mod, ast.BitAnd)
#: Operators after which a time may have another unit.
_SCALING = (ast.Div, ast.FloorDiv, ast.Mult)
_Given = Sequence[tuple[ast.expr, str]]


class Times:
    """The expressions of a file that hold a time that was read from a clock, also by the names that they are given.

    Args:
        source: The file.
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        given = [
            (node.value, chain(target))
            for node in source.nodes
            if isinstance(node, (ast.Assign, ast.AnnAssign, ast.NamedExpr)) and node.value is not None
            for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        ]
        operations: list[ast.BinOp] = [*source.all(ast.BinOp)]
        read = [call for call in source.all(ast.Call) if self._reads(call)]
        self._scaled = _around(source, (one for one in operations if isinstance(one.op, _SCALING)))
        less = _around(source, (one for one in operations if isinstance(one.op, _LESS)))
        reading = _around(source, read)
        names = _reached(source, [pair for pair in given if pair[0] in reading], given)
        self._holding = _around(source, [*read, *_called(source, names.__contains__)])
        differences = [pair for pair in given if pair[0] in self._holding and pair[0] not in self._scaled]
        self._in_ns = _around(source, _called(source, _tells_ns))
        in_ns = _reached(source, [pair for pair in differences if pair[0] in self._in_ns], differences)
        self._in_ns = _around(source, _called(source, lambda name: name in in_ns or _tells_ns(name)))
        held = [pair for pair in given if pair[0] in less and pair[0] in self._holding]
        self._differences = _reached(source, held, given)
        compared = [*source.all(ast.Compare), *_called(source, self._differences.__contains__)]
        self._undated = less | _around(source, compared)

    def holds(self, node: ast.AST) -> bool:
        """Return whether a time is part of an expression."""
        return node in self._holding

    def holds_ns(self, node: ast.AST) -> bool:
        """Return whether an expression is a time in nanoseconds, or a difference of such times."""
        return node in self._holding and node not in self._scaled and node in self._in_ns

    def is_date(self, node: ast.AST) -> bool:
        """Return whether an expression holds a time since 1970, or since the start of a clock, and no difference."""
        return node in self._holding and node not in self._undated

    def is_difference(self, node: ast.AST) -> bool:
        """Return whether an expression is a difference of times, or what is left over of one."""
        inexact = isinstance(node, ast.BinOp) and isinstance(node.op, _LESS)
        return (inexact and self.holds(node)) or (isinstance(node, ast.Name) and node.id in self._differences)

    def _reads(self, node: ast.Call) -> bool:
        return _is_clock(node, self._source) or (isinstance(node.func, ast.Attribute) and node.func.attr == "now")


def _tells_ns(name: str) -> bool:
    return name.rpartition(".")[2] in _IN_NS


def _called(source: Source, wanted: Callable[[str], bool]) -> Iterator[ast.AST]:
    """Yield the expressions whose dotted names are wanted."""
    return (node for kind in (ast.Name, ast.Attribute, ast.Call) for node in source.all(kind) if wanted(chain(node)))


def _reached(source: Source, first: _Given, given: _Given) -> set[str]:
    """Return the names of some assignments, and of those whose values use such a name, looking at each once."""
    names_given: dict[ast.AST, list[str]] = {}
    for value, name in given:
        names_given.setdefault(value, []).append(name)
    using: dict[str, list[ast.AST]] = {}
    for node in _called(source, bool):
        here: ast.AST | None = node
        while here is not None and not isinstance(here, ast.stmt):
            if here in names_given:
                using.setdefault(chain(node), []).append(here)
            here = source.parents.get(here)
    left = [name for _, name in first]
    found: set[str] = set()
    reached: set[ast.AST] = set()
    while left:
        name = left.pop()
        if name and name not in found:
            found.add(name)
            for holder in using.get(name, ()):
                if holder not in reached:
                    reached.add(holder)
                    left += names_given[holder]
    return found


def _collects(node: ast.AST, times: Times) -> bool:
    """Return whether an expression reads a clock in a loop, or tells how many different times it holds."""
    if isinstance(node, (ast.ListComp, ast.SetComp, ast.GeneratorExp)):
        return times.holds(node.elt)
    return (
        isinstance(node, ast.Call)
        and chain(node.func) in ("set", "frozenset")
        and any(times.holds(argument) for argument in node.args)
    )


def _looks_closely(node: ast.AST, times: Times) -> bool:
    """Return whether an expression shows the last digits of a clock, or whether any time has passed."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.BitAnd, ast.BitXor)):
        return times.holds(node)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mod) and times.holds(node.left):
        least = _TINY_NS if times.holds_ns(node.left) else _TINY_S
        divisor = node.right.value if isinstance(node.right, ast.Constant) else None
        return isinstance(divisor, (int, float)) and 0 < divisor <= least
    if isinstance(node, ast.Call) and chain(node.func) == "divmod" and len(node.args) == 2:
        return times.holds_ns(node.args[0])
    if isinstance(node, ast.Subscript):  # the digits of a text
        of_text = isinstance(node.value, ast.Call) and chain(node.value.func) in ("str", "repr", "format", "hex", "bin")
        return of_text and times.holds(node.value)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in ("endswith", "count"):
        return times.holds(node.func.value)
    tested: list[ast.expr] = []
    if isinstance(node, (ast.If, ast.While, ast.IfExp, ast.Assert)):
        tested = [node.test]
    elif isinstance(node, ast.BoolOp):
        tested = node.values
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        tested = [node.operand]
    elif isinstance(node, ast.Call) and chain(node.func) == "bool":
        tested = node.args
    return any(times.is_difference(test) for test in tested)


def _compares(node: ast.AST, source: Source, times: Times) -> bool:
    """Return whether a date is compared, or a clock in a way that merely waiting for time to pass never needs."""
    if isinstance(node, (ast.Subscript, ast.Attribute)):
        return _is_date(node.value, source) and (
            isinstance(node, ast.Subscript) or node.attr in ("startswith", "endswith")
        )
    if not isinstance(node, ast.Compare):
        return False
    sides = [node.left, *node.comparators]
    numbers = [s.value for s in sides if isinstance(s, ast.Constant) and isinstance(s.value, (int, float))]
    dated = any(n != 0 for n in numbers) and any(times.is_date(side) for side in sides)
    if dated or any(_is_date(side, source) or (numbers and _is_clock(side, source)) for side in sides):
        return True
    exact = any(isinstance(op, (ast.Eq, ast.NotEq, ast.In, ast.NotIn)) for op in node.ops)
    named = any(isinstance(s, ast.Constant) and (s.value is None or isinstance(s.value, (str, bool))) for s in sides)
    if any(times.holds_ns(side) for side in sides):
        return (exact and not named) or any(0 < abs(n) < _TINY_NS for n in numbers)
    looks = any(times.holds(side) for side in sides)
    return looks and ((exact and not named) or any(0 < abs(n) < _TINY_S for n in numbers))


def _is_clock(node: ast.AST, source: Source) -> bool:
    return isinstance(node, ast.Call) and source.resolved(node.func) in _CLOCKS


def _is_date(node: ast.AST, source: Source) -> bool:
    if not isinstance(node, ast.Call):
        return False
    told = isinstance(node.func, ast.Attribute) and node.func.attr in _TOLD
    texts = chain(node.func) in ("str", "repr") and any(_is_date(a, source) or _is_clock(a, source) for a in node.args)
    return told or texts or source.resolved(node.func) in _CALENDARS


#: Calls in which a loop waits.
_WAITING = _words("sleep wait spin spin_once spin_until_future_complete join get publish sleep_for sleep_until")
