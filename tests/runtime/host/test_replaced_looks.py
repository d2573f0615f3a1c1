"""What replaced functions and classes show of themselves, and how they refuse arguments, is what the originals do."""

from __future__ import annotations

import subprocess
import sys

import pytest
from staging_programs import play

#: Classes stand there for locks in C and for what they return, and ours show it (docs/explanation/limits.md).
pytestmark = pytest.mark.skipif(sys.version_info >= (3, 13), reason="threading.Lock is a class since Python 3.13")

#: Describes one value, and tries one expression, without addresses and idents.
SHOWING = """
import concurrent.futures, copy, inspect, math, pickle, re, sys, threading, types
import _queue, _thread, os, queue, random, select, selectors, signal, socket, time

def stable(text):
    return re.sub(r"0x[0-9a-f]+|owner=[1-9][0-9]*", "N", text)

def tried(get):
    try:
        return stable(repr(get()))
    except BaseException as error:
        return stable(f"{type(error).__name__}: {error}")

def shown(value):
    kind = type(value)
    names = "__name__ __qualname__ __module__ __doc__ __text_signature__ __self__ __defaults__".split()
    parts = [kind.__name__, kind.__module__, kind.__qualname__, repr(kind), tried(lambda: value)]
    parts += [tried(lambda: getattr(value, name, "none")) for name in names]
    parts += [tried(lambda: value.__class__), tried(lambda: isinstance(value, types.BuiltinFunctionType))]
    parts += [tried(lambda: str(inspect.signature(value))), tried(lambda: pickle.loads(pickle.dumps(value)) is value)]
    parts += [tried(lambda: copy.deepcopy(value) is value), tried(lambda: inspect.isbuiltin(value))]
    parts += [tried(lambda: inspect.isroutine(value)), tried(lambda: inspect.isclass(value))]
    parts += [tried(lambda: value | None)] if callable(value) else []
    return parts

def show(name, value):
    for place, part in enumerate(shown(value)):
        say(f"{name} {place}: {part}")
"""
MODULES = (
    *("time", "select", "signal", "os", "posix", "socket", "threading", "queue", "random", "selectors"),
    *("_thread", "_queue", "concurrent.futures"),
)
#: Describes each function and class of a module, and each method that a class of it has.
MODULE = """
import importlib
module = importlib.import_module(MODULE)
for name, value in sorted(vars(module).items()):
    if {name, f"{MODULE}.{name}"} & PRIVATE:
        continue
    if callable(value):
        show(name, value)
    if inspect.isclass(value) and value.__module__ == MODULE:
        for each, method in sorted(vars(value).items()):
            if inspect.isroutine(method) and (each[:1] != "_" or each[:2] == "__"):
                show(f"{name}.{each}", method)
"""
#: What the modules have for themselves: their own copies of functions, and the classes in Python behind those in C.
PRIVATE = {
    "_start_new_thread",
    "_allocate_lock",
    "_CRLock",
    "_PyRLock",
    "_RLock",
    "_time",
    "_urandom",
    "_PySimpleQueue",
}
PRIVATE |= {"__excepthook__", "queue.time"}
#: In Python here, in C there: their methods show it (docs/explanation/limits.md).
IN_PYTHON = {"LockType", "lock", "RLock", "SimpleQueue"}

OBJECTS = (
    *("time.sleep", "time.monotonic", "threading.Lock", "threading.Lock()", "threading.RLock", "threading.RLock()"),
    *("threading.Event()", "threading.Event().is_set", "threading.Condition()", "threading.Semaphore()", "os.urandom"),
    *("threading.Thread.join", "threading.Thread.is_alive", "queue.Queue().get", "queue.Queue().empty", "os.kill"),
    *("queue.SimpleQueue()", "_thread.allocate_lock", "select.select", "signal.alarm"),
    *("concurrent.futures.Future().done", "random.seed", "time.perf_counter_ns", "time.clock_gettime"),
)
CALLS = (
    *(
        "time.sleep()",
        "time.sleep(0, 1)",
        "time.sleep(secs=0)",
        "time.sleep('1')",
        "time.sleep(-1)",
        "time.sleep(None)",
    ),
    *("time.sleep(math.nan)", "time.sleep(math.inf)", "time.sleep(1j)", "time.sleep(1e300)", "time.sleep.pause"),
    *("time.monotonic(1)", "time.monotonic(clock=1)", "time.perf_counter_ns(1)", "time.perf_counter(None)"),
    *("time.clock_gettime()", "time.clock_gettime('a')", "time.clock_gettime_ns(1, 2)", "time.clock_gettime(999)"),
    *("time.clock_gettime_ns(clk_id=1)", "time.clock_gettime([])", "setattr(time.sleep, 'late', 1)", "time.sleep + 1"),
    *("threading.Lock(1)", "threading.Lock().acquire(True, -2)", "threading.Lock().acquire(False, 1)"),
    *("threading.Lock().acquire(True, 'x')", "threading.Lock().acquire(True, 1e300)", "threading.Lock().acquire('x')"),
    *("threading.Lock().acquire(True, math.nan)", "threading.Lock().acquire(1, 2, 3)", "threading.Lock().release()"),
    *("threading.Lock().acquire(0)", "threading.Lock().acquire(blocking=False)", "threading.Lock().acquire(timeout=1)"),
    *("threading.Lock().acquire(wait=1)", "threading.Lock().locked()", "pickle.dumps(threading.Lock())"),
    *("type('Mine', (type(threading.Lock()),), {})", "type('Mine', (type(threading.RLock()),), {}).__name__"),
    *("isinstance(threading.Lock(), _thread.LockType)", "threading.Lock() == threading.Lock()", "threading.RLock(1)"),
    *("isinstance(1, threading.Lock)", "isinstance(1, threading.RLock)", "threading.RLock().release()"),
    *("(lambda r: (r.acquire(), r.acquire(), repr(r), r.release(), repr(r)))(threading.RLock())",),
    *("(lambda r: (r.__enter__(), r.__enter__()))(threading.RLock())", "pickle.dumps(threading.RLock())"),
    *("queue.SimpleQueue().get(True, -1)", "queue.SimpleQueue().get(False)", "pickle.dumps(queue.SimpleQueue())"),
    *(
        "threading.Thread().join()",
        "threading.Thread().join('x')",
        "threading.Thread.join()",
        "threading.Event.is_set()",
    ),
    *("select.select([], [], [], -1)", "select.select([], [], [], 'x')", "select.select()", "select.select(1, [], [])"),
    *("select.select(['x'], [], [], 0)", "select.select([], [], [], timeout=0)", "select.select([], [], [], 0)"),
    *("os.urandom(-1)", "os.urandom('x')", "os.urandom()", "len(os.urandom(size=3))", "os.getrandom()", "os.kill()"),
    *("len(os.getrandom(3))", "len(os.getrandom(size=3, flags=0))", "os.getrandom(3, 999)", "signal.alarm('x')"),
    *(
        "signal.setitimer()",
        "signal.setitimer(0, 'x')",
        "_thread.start_new_thread()",
        "_thread.start_new_thread(1, ())",
    ),
    *(
        "type('A', (), {'f': time.sleep})().f(0)",
        "type(type('A', (), {'f': time.time})().f())",
    ),
    *("type(type('A', (), {'f': time.monotonic})().f())", "type(type('A', (), {'f': threading.Lock})().f())"),
    *("time.sleep.__call__(0)", "sys.getsizeof(time.sleep)", "hash(time.sleep) == hash(time.sleep)"),
)


def differences(program: str) -> list[tuple[str, str]]:
    """What a program says otherwise in virtual time than in a Python of its own; it has to say as many things."""
    done = subprocess.run(
        [sys.executable, "-c", f"say = lambda text: print(ascii(text))\n{SHOWING}{program}"],
        capture_output=True,
        text=True,
        check=True,
    )
    said = play(f"heard = say\nsay = lambda text: heard(ascii(text))\n{SHOWING}{program}", repeats=1)
    here, there = [line.partition(" ")[2] for line in said[:-1]], done.stdout.splitlines()
    assert len(here) == len(there) > 0
    return [pair for pair in zip(here, there, strict=True) if pair[0] != pair[1]]


def test_what_is_replaced_shows_what_the_original_shows() -> None:
    """Type, names, text, signature, pickling."""
    assert not differences(f"for text in {OBJECTS!r}:\n    show(text, eval(text))\n")


def test_what_is_replaced_refuses_what_the_original_refuses() -> None:
    """With the same words, and takes what that takes."""
    assert not differences(f"for text in {CALLS!r}:\n    say(f'{{text}}: {{tried(lambda: eval(text))}}')\n")


@pytest.mark.parametrize("module", MODULES)
def test_no_name_of_a_module_tells_that_it_is_replaced(module: str) -> None:
    """So nothing is forgotten that is replaced later."""
    assert not differences(f"MODULE, PRIVATE = {module!r}, {PRIVATE | IN_PYTHON!r}\n{MODULE}")
