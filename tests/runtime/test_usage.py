"""What processes use, as the system says."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest

from grader.runtime.model.quantities import MIB, NS_PER_S
from grader.runtime.usage import activity, families, last_pid, peak_bytes, restart_peak, threads_starved_ns, usage

WAIT = "import sys; sys.stdout.write('x'); sys.stdout.flush(); sys.stdin.read()"


@pytest.fixture
def run() -> Iterator[Callable[[str], subprocess.Popen[bytes]]]:
    """Start a program that waits when it is done, and end it afterwards."""
    running = []

    def run_one(code: str) -> subprocess.Popen[bytes]:
        argv = [sys.executable, "-I", "-S", "-c", f"{code}\n{WAIT}"]
        process = subprocess.Popen(argv, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True)
        running.append(process)
        assert process.stdout is not None
        process.stdout.read(1)
        return process

    yield run_one
    for process in running:
        os.killpg(process.pid, 9)
        process.communicate()


def test_memory_is_what_is_filled_not_what_is_mapped(run: Callable[[str], subprocess.Popen[bytes]]) -> None:
    """A large empty mapping costs nothing; filled memory, also shared with nobody yet, counts."""
    nothing = usage([run("").pid]).memory_bytes
    mapped = usage([run("import mmap; m = mmap.mmap(-1, 1 << 30)").pid]).memory_bytes
    filled = usage([run("x = bytearray(b'x' * (64 << 20))").pid]).memory_bytes
    shared = usage([run("import mmap; m = mmap.mmap(-1, 64 << 20); m.write(b'x' * (64 << 20))").pid]).memory_bytes
    assert mapped < nothing + 8 * MIB
    assert filled > nothing + 60 * MIB
    assert shared > nothing + 60 * MIB


def test_processor_time_includes_ended_children(run: Callable[[str], subprocess.Popen[bytes]]) -> None:
    """A program cannot hide its work in children that it has waited for."""
    work = "import time; t = time.process_time()\nwhile time.process_time() < t + 0.3: pass"
    parent = run(f"import subprocess, sys; subprocess.run([sys.executable, '-I', '-S', '-c', {work!r}])")
    assert usage([parent.pid]).processor_ns >= 0.25 * NS_PER_S


def test_threads_are_counted(run: Callable[[str], subprocess.Popen[bytes]]) -> None:
    """Every one of them."""
    code = "import threading, time\nsleepers = [threading.Timer(99, print) for _ in range(5)]"
    assert usage([run(f"{code}\nfor s in sleepers: s.start()").pid]).threads == 6


def test_a_halted_process_is_told(run: Callable[[str], subprocess.Popen[bytes]]) -> None:
    """A signal that halts is not an end: nobody would ever hear of it again."""
    process = run("")
    assert not usage([process.pid]).halted
    os.kill(process.pid, 19)
    while not usage([process.pid]).halted:
        os.sched_yield()
    os.kill(process.pid, 18)


def test_a_process_that_is_gone_uses_nothing() -> None:
    """Between a search and a look anything may end."""
    with subprocess.Popen([sys.executable, "-I", "-S", "-c", ""]) as process:
        pass
    assert usage([process.pid]) == usage([])
    assert threads_starved_ns([process.pid]) == {}


def test_the_last_pid_tells_that_something_was_started(run: Callable[[str], subprocess.Popen[bytes]]) -> None:
    """A process or a thread, by whomever; so as long as it stays the same, nothing was."""
    before = last_pid()
    started = run("print(flush=True); input()")
    assert last_pid() != before
    assert int(last_pid()) >= started.pid or int(last_pid()) < int(before)


def test_a_family_is_a_process_with_all_below_it(run: Callable[[str], subprocess.Popen[bytes]]) -> None:
    """Children of children belong to it, its siblings do not."""
    child = "import os, time; os.fork(); time.sleep(99)"
    code = f"import subprocess, sys\nc = subprocess.Popen([sys.executable, '-c', {child!r}])"
    first, second = run(code), run("")
    while len(found := families([first.pid, second.pid])[first.pid]) < 3:
        time.sleep(0)
    assert first.pid in found
    assert families([first.pid, second.pid])[second.pid] == {second.pid}


def test_waiting_for_a_processor_is_seen(run: Callable[[str], subprocess.Popen[bytes]]) -> None:
    """Two programs that want the same processor wait for each other."""
    work = "import os, time; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\nwhile True: pass"
    code = f"import subprocess, sys\nc = [subprocess.Popen([sys.executable, '-c', {work!r}]) for _ in range(2)]"
    parent = run(code)
    deadline = time.monotonic() + 30
    while sum(threads_starved_ns(families([parent.pid])[parent.pid] - {parent.pid}).values()) < 50_000_000:
        assert time.monotonic() < deadline
        os.sched_yield()


def test_the_peak_of_one_task_is_not_that_of_the_next() -> None:
    """Where the kernel forgets it when it is told to, as in a process of one's own."""
    restart_peak()
    before = peak_bytes()
    held = b"x" * (100 * MIB)
    most = peak_bytes()
    assert most >= before + 90 * MIB
    del held
    restart_peak()
    assert peak_bytes() < most - 90 * MIB


def test_a_process_that_only_computes_has_done_nothing_else() -> None:
    """A loop without end: neither has it slept, nor read, nor written, since it told that it begins."""
    argv = [sys.executable, "-I", "-S", "-c", "import os; os.write(1, b'x')\nwhile True: pass"]
    with subprocess.Popen(argv, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.read(1)
        before = activity(process.pid)
        used_ns = usage([process.pid]).processor_ns
        while usage([process.pid]).processor_ns < used_ns + NS_PER_S // 10:
            time.sleep(0.01)
        after = activity(process.pid)
        process.kill()
    assert after.is_known
    assert (after.runs, after.exchanged) == (True, before.exchanged)


def test_a_process_that_waits_for_input_has_slept(run: Callable[[str], subprocess.Popen[bytes]]) -> None:
    """What it has done since nobody knows: another may have woken it in between."""
    process = run("")
    while activity(process.pid).runs:
        os.sched_yield()
    assert activity(process.pid).slept > 0
    assert not activity(process.pid).is_known


def test_who_shares_memory_may_tell_something_at_any_time() -> None:
    """Without sleeping, reading or writing."""
    code = "import mmap, os\nshared = mmap.mmap(-1, 4096)\nshared[0] = 1\nos.write(1, b'x')\nwhile True: pass"
    with subprocess.Popen([sys.executable, "-I", "-S", "-c", code], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.read(1)
        assert not activity(process.pid).is_known
        process.kill()
