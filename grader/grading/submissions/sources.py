"""Reads the graded files as text, and finds names that reach into the internals of their process."""

from __future__ import annotations

import ast
import io
import sys
import tokenize
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from grader.grading.judging.source import LONGEST_SOURCE, Source, chain, read
from grader.grading.submissions.revealing import ORDER, orders, read_attributes, shown_functions
from grader.runtime.model.limits import MAX_PROGRAM_BYTES, MAX_SOURCE_BYTES
from grader.runtime.model.submission import Submission


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


#: Reported for a file that is too long to be examined, and for one that is not text, or in an unusual encoding.
LONG, UNREADABLE = "a very long file", "a file that cannot be read as text"
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
#: The names of what depends on the hashes of a process.
HASHES = frozenset((ORDER, "hash"))
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


def reaching(text: str) -> tuple[str, ...]:
    """Return the names by which a file reaches into its process, in order without duplicates; usually none."""
    source = read("", text)
    if source.tree is None:
        return (LONG,) if len(text) > LONGEST_SOURCE or _can_run(text) else ()
    shown = (*shown_functions(source), *orders(source))
    return tuple(dict.fromkeys((*_imports(source), *_named(source), *_computed(source), *_timing(source), *shown)))


def _can_run(text: str) -> bool:
    try:
        compile(text, "", "exec", dont_inherit=True)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    return True


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
            if name.partition(".")[0] in _MODULES or any(name == n or name.startswith(f"{n}.") for n in _NAMES):
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
    given = [name.id for name in source.all(ast.Name) if isinstance(name.ctx, ast.Store)]
    return frozenset(name for name in named if given.count(name) == named.count(name))


def _may_name_internals(node: ast.expr) -> bool:
    """Return whether an expression may be anything but a text that names nothing internal."""
    if not isinstance(node, ast.Constant) or not isinstance(node.value, str):
        return True
    return node.value in _ATTRIBUTES or any(node.value == name.rpartition(".")[2] for name in _NAMES)


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
    for loop in source.all(ast.While):
        inside = list(ast.walk(loop))
        looks = any(isinstance(n, (ast.Attribute, ast.Name)) and source.resolved(n) in _CLOCKS for n in inside)
        waits = any(isinstance(n, ast.Call) and chain(n.func).rpartition(".")[2] in _WAITING for n in inside)
        if looks and not waits and any(isinstance(n, ast.AugAssign) for n in inside):
            yield "a loop that counts"


#: Operators after which a time is not a date any more: a difference or a remainder.
_LESS = (ast.Sub, ast.Mod, ast.BitAnd)


class Times:
    """The expressions of a file that hold a time that was read from a clock, also by the names that they are given.

    Args:
        source: The file.
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self._names: set[str] = set()
        self._in_ns: set[str] = set()
        self._differences: set[str] = set()
        given = [
            (node.value, chain(target))
            for node in source.nodes
            if isinstance(node, (ast.Assign, ast.AnnAssign, ast.NamedExpr)) and node.value is not None
            for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        ]
        self._names = _reached([(value, name) for value, name in given if self.holds(value)], given)
        differences = [(value, name) for value, name in given if self.holds(value) and not _is_scaled(value)]
        self._in_ns = _reached([(value, name) for value, name in differences if self.holds_ns(value)], differences)
        less = [(value, name) for value, name in given if any(isinstance(n, _LESS) for n in ast.walk(value))]
        self._differences = _reached([(value, name) for value, name in less if self.holds(value)], given)

    def holds(self, node: ast.AST) -> bool:
        """Return whether a time is part of an expression."""
        return any(self._reads(n) or chain(n) in self._names for n in ast.walk(node))

    def holds_ns(self, node: ast.AST) -> bool:
        """Return whether an expression is a time in nanoseconds, or a difference of such times."""
        if _is_scaled(node) or not self.holds(node):
            return False
        return any(chain(n).rpartition(".")[2] in _IN_NS or chain(n) in self._in_ns for n in ast.walk(node))

    def is_date(self, node: ast.AST) -> bool:
        """Return whether an expression holds a time since 1970, or since the start of a clock, and no difference."""
        return self.holds(node) and not any(
            isinstance(n, (*_LESS, ast.Compare)) or chain(n) in self._differences for n in ast.walk(node)
        )

    def is_difference(self, node: ast.AST) -> bool:
        """Return whether an expression is a difference of times, or what is left over of one."""
        inexact = isinstance(node, ast.BinOp) and isinstance(node.op, _LESS)
        return (inexact and self.holds(node)) or (isinstance(node, ast.Name) and node.id in self._differences)

    def _reads(self, node: ast.AST) -> bool:
        return _is_clock(node, self._source) or (
            isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "now"
        )


def _is_scaled(node: ast.AST) -> bool:
    return any(isinstance(n, (ast.Div, ast.FloorDiv, ast.Mult)) for n in ast.walk(node))


def _reached(first: Sequence[tuple[ast.expr, str]], given: Sequence[tuple[ast.expr, str]]) -> set[str]:
    """Return the names of some assignments, and of those whose values use such a name, looking at each once."""
    using: dict[str, list[str]] = {}
    for value, name in given:
        for used in {chain(n) for n in ast.walk(value)} - {""}:
            using.setdefault(used, []).append(name)
    left = [name for _, name in first]
    found: set[str] = set()
    while left:
        name = left.pop()
        if name and name not in found:
            found.add(name)
            left += using.get(name, ())
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


#: Suffixes of modules that Python imports without their source, and of archives that it imports from.
COMPILED = (".so", ".pyc", ".pyo", ".pth", ".zip", ".egg", ".whl", ".pyz")
#: Encodings in which editors save programs.
_ENCODINGS = ("utf-8", "utf-8-sig", "ascii", "iso-8859-", "latin", "cp125", "windows-125")


def read_sources(submission: Submission) -> dict[str, str]:
    """Return wanted file name -> text of the staged files that were found and that Python can decode."""
    texts = {
        wanted: source_text(submission.root / file.found)
        for wanted, file in submission.files.items()
        if file.found is not None
    }
    return {wanted: text for wanted, text in texts.items() if text is not None}


def read_reaches(root: Path) -> tuple[str, ...]:
    """Return the names by which the files of a staged submission reach into their process, without duplicates.

    A module that is not text, or has more text than is read, counts as reaching, and so does an archive that modules
    could be imported from, whatever its name.
    """
    found: list[str] = []
    size = 0
    for path in sorted(path for path in root.rglob("*") if path.is_file()):
        if path.suffix.lower() in COMPILED:
            found.append(f"a {path.suffix.lower()} file")
        elif path.suffix.lower() not in _DOCUMENTS and zipfile.is_zipfile(path):
            found.append("an archive")
        elif path.suffix == ".py":
            size += path.stat().st_size
            if size > MAX_PROGRAM_BYTES:
                return (*dict.fromkeys(found), LONG)
            found += _reached_by(path)
    return tuple(dict.fromkeys(found))


#: Documents that are archives inside. A program that puts one on `sys.path` is noticed when it imports from it.
_DOCUMENTS = frozenset((".docx", ".xlsx", ".pptx", ".odt", ".ods", ".odp", ".jar", ".npz", ".epub"))


def _reached_by(path: Path) -> tuple[str, ...]:
    """Return the names by which a module reaches into its process; that it cannot be read, or not surely, is one."""
    if path.stat().st_size > MAX_SOURCE_BYTES:
        return (LONG,)
    text = source_text(path)
    if text is None:
        return () if b"\0" in path.read_bytes() else (UNREADABLE,)  # Python refuses a source with a null byte
    return (*reaching(text), *(() if _is_usual(path) else (UNREADABLE,)))


def _is_usual(path: Path) -> bool:
    """Return whether a file is written in an encoding that editors save programs in."""
    with path.open("rb") as file:
        return tokenize.detect_encoding(file.readline)[0].startswith(_ENCODINGS)


def source_text(path: Path) -> str | None:
    """Return the text of a staged file; None if it is too long or not text in its declared encoding."""
    try:
        with path.open("rb") as file:
            content = file.read(MAX_SOURCE_BYTES + 1)
        if len(content) > MAX_SOURCE_BYTES:
            return None
        encoding, _ = tokenize.detect_encoding(io.BytesIO(content).readline)
        return io.TextIOWrapper(io.BytesIO(content), encoding, newline=None).read()
    except (OSError, SyntaxError, UnicodeError, LookupError):
        return None
