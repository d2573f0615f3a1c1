"""Programs with threads in virtual time: exact instants, one order, the same every time."""

from __future__ import annotations

import textwrap
import threading
from typing import Any

import pytest
from staging_programs import play
from thread_orders import IMPORTS, ORDERS

from grader.runtime.host.protocol import FaultReport
from grader.runtime.host.threads import report_threads


def test_sleeping_threads_interleave() -> None:
    """Each wakes at its own instants; at the same instant, whoever has slept longest goes first."""
    assert play("""
        import threading, time
        def work(name, period_s):
            for _ in range(3):
                time.sleep(period_s)
                say(name)
        threads = [threading.Thread(target=work, args=pair) for pair in (("a", 0.2), ("b", 0.3))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
            say("joined")
    """) == ["200 a", "300 b", "400 a", "600 b", "600 a", "600 joined", "900 b", "900 joined", "900 end"]


def test_hundred_threads_at_one_instant_go_in_the_order_of_their_start() -> None:
    """However the system switches between threads, no two runs differ."""
    assert play("""
        import threading, time
        order = []
        def work(number):
            time.sleep(1)
            order.append(number)
        threads = [threading.Thread(target=work, args=(n,)) for n in range(100)]
        for thread in threads: thread.start()
        for thread in threads: thread.join()
        say(order == list(range(100)))
    """) == ["1000 True", "1000 end"]


@pytest.mark.rule(5)
def test_a_race_between_threads_has_one_outcome() -> None:
    """Threads take turns only where they block: a counter without a lock loses nothing."""
    assert play("""
        import threading, time
        count = 0
        def work():
            global count
            for _ in range(2000):
                seen = count
                count = seen + 1
        threads = [threading.Thread(target=work) for _ in range(8)]
        for thread in threads: thread.start()
        for thread in threads: thread.join()
        say(count)
    """) == ["0 16000", "0 end"]


def test_an_event_is_waited_for_until_its_timeout() -> None:
    """False at the timeout, True at the instant at which another thread sets it."""
    assert play("""
        import threading, time
        event = threading.Event()
        say(event.wait(0.25))
        threading.Timer(0.1, event.set).start()
        say(event.wait(5))
        say(event.wait())
        event.clear()
        say(event.wait(timeout=0))
        say(event.wait(timeout=-1))
    """) == ["250 False", "350 True", "350 True", "350 False", "350 False", "350 end"]


def test_a_queue_is_waited_for() -> None:
    """The consumer gets each item when it is put; an empty queue raises at the timeout, a full one as well."""
    assert play("""
        import queue, threading, time
        items = queue.Queue(maxsize=2)
        def produce():
            for number in range(3):
                time.sleep(0.1)
                items.put(number)
        threading.Thread(target=produce).start()
        for _ in range(3):
            say(items.get())
        try:
            items.get(timeout=0.5)
        except queue.Empty:
            say("empty")
        try:
            items.get_nowait()
        except queue.Empty:
            say("empty now")
        items.put(1); items.put(2)
        try:
            items.put(3, timeout=0.2)
        except queue.Full:
            say("full")
    """) == ["100 0", "200 1", "300 2", "800 empty", "800 empty now", "1000 full", "1000 end"]


def test_a_queue_is_joined_when_its_tasks_are_done() -> None:
    """Unfinished tasks keep the main thread waiting."""
    assert play("""
        import queue, threading, time
        tasks = queue.Queue()
        def work():
            while True:
                time.sleep(tasks.get())
                tasks.task_done()
        threading.Thread(target=work, daemon=True).start()
        for pause_s in (0.5, 0.25): tasks.put(pause_s)
        tasks.join()
        say("done")
        simple = queue.SimpleQueue()
        try:
            simple.get(timeout=1)
        except queue.Empty:
            say("empty")
    """) == ["750 done", "1750 empty", "1750 end"]


def test_a_pool_runs_as_many_tasks_as_it_has_threads() -> None:
    """Two workers need two seconds for four tasks of a second each; results come in order."""
    assert play("""
        import time
        from concurrent.futures import ThreadPoolExecutor, as_completed, wait, TimeoutError
        def work(number):
            time.sleep(1)
            say(f"done {number}")
            return number
        with ThreadPoolExecutor(max_workers=2) as pool:
            say(list(pool.map(work, range(4))))
            slow = pool.submit(time.sleep, 3)
            try:
                slow.result(timeout=0.5)
            except TimeoutError:
                say("too slow")
            quick = pool.submit(work, 9)
            say([f is quick for f in as_completed([slow, quick])])
            say(len(wait([slow, quick]).done))
        say("closed")
    """) == [
        "1000 done 0",
        "1000 done 1",
        "2000 done 2",
        "2000 done 3",
        "2000 [0, 1, 2, 3]",
        "2500 too slow",
        "3500 done 9",
        "5000 [True, False]",
        "5000 2",
        "5000 closed",
        "5000 end",
    ]


def test_a_pool_hands_an_exception_on() -> None:
    """It is the caller's, and no fault of a thread."""
    assert play("""
        from concurrent.futures import ThreadPoolExecutor
        with ThreadPoolExecutor() as pool:
            say(repr(pool.submit(lambda: 1 / 0).exception()))
    """) == ["0 ZeroDivisionError('division by zero')", "0 end"]


def test_a_timer_that_starts_the_next_one_ticks_exactly() -> None:
    """Hundreds of threads one after another, and no drift; a cancelled timer stays silent."""
    assert play("""
        import threading
        def tick(left):
            if left % 200 == 0:
                say(left)
            if left:
                threading.Timer(0.05, tick, (left - 1,)).start()
        tick(600)
        never = threading.Timer(1, say, ("never",))
        never.start(); never.cancel()
    """) == ["0 600", "10000 400", "20000 200", "30000 0", "30000 end"]


def test_a_daemon_thread_does_not_keep_the_program_alive() -> None:
    """The others do, also when the main thread has come to its end."""
    assert play("""
        import threading, time
        def work(name, times):
            for _ in range(times):
                time.sleep(1)
                say(name)
        threading.Thread(target=work, args=("daemon", 100), daemon=True).start()
        threading.Thread(target=work, args=("worker", 2)).start()
        say("main ends")
    """) == ["0 main ends", "1000 daemon", "1000 worker", "2000 daemon", "2000 worker", "2000 end"]


def test_a_thread_that_raises_is_a_fault_and_the_others_go_on() -> None:
    """The main thread notices only that it has ended; SystemExit is no fault."""
    assert play("""
        import sys, threading, time
        def fail():
            time.sleep(0.5)
            raise ValueError("no")
        failing = threading.Thread(target=fail)
        leaving = threading.Thread(target=sys.exit)
        failing.start(); leaving.start()
        failing.join(); leaving.join()
        say(f"joined {failing.is_alive()}")
        time.sleep(1)
    """) == ["500 fault ValueError: no", "500 joined False", "1500 end"]


def test_a_join_ends_at_its_timeout() -> None:
    """The thread lives on; joining it again is allowed, joining oneself or too early is not."""
    assert play("""
        import threading, time
        sleeper = threading.Thread(target=time.sleep, args=(2,))
        for early in (sleeper, threading.current_thread()):
            try:
                early.join()
            except RuntimeError as error:
                say(error)
        sleeper.start()
        sleeper.join(timeout=0.5)
        say(sleeper.is_alive())
        sleeper.join(0); sleeper.join(-1)
        say(sleeper.is_alive())
        sleeper.join(); sleeper.join()
        say(sleeper.is_alive())
    """) == [
        "0 cannot join thread before it is started",
        "0 cannot join current thread",
        "500 True",
        "500 True",
        "2000 False",
        "2000 end",
    ]


def test_many_threads_joined_in_turn_wake_nobody_else() -> None:
    """A thread's number in memory is used again; what waits for the old one is not disturbed by the new."""
    assert play("""
        import threading, time
        def one_after_another():
            for _ in range(300):
                thread = threading.Thread(target=time.sleep, args=(0.01,))
                thread.start(); thread.join(0.001); thread.join()
            say("short ones")
        threading.Thread(target=one_after_another).start()
        time.sleep(2.5)
        say("long one")
    """) == ["2500 long one", "3000 short ones", "3000 end"]


@pytest.mark.parametrize(
    "wait",
    [
        "threading.Event().wait()",
        "queue.Queue().get()",
        "a.acquire()",
        "threading.Barrier(2).wait()",
        "threading.Thread(target=a.acquire).start() or [t for t in threading.enumerate() if t is not here][0].join()",
        "c.wait()",
    ],
)
def test_a_deadlock_is_idle_without_a_wish_to_wake(wait: str) -> None:
    """The grader is asked, not the processor: it learns that nothing but the world can go on."""
    assert play(f"""
        import queue, threading
        here = threading.current_thread()
        a = threading.Lock(); a.acquire()
        c = threading.Condition(threading.RLock()); c.acquire()
        {wait}
        say("never")
    """) == ["0 idle for ever"]


def test_two_threads_that_want_each_others_lock_are_idle() -> None:
    """The textbook's deadlock."""
    assert play("""
        import threading, time
        a, b = threading.Lock(), threading.Lock()
        def work(first, second):
            with first:
                time.sleep(0.1)
                with second:
                    say("never")
        threading.Thread(target=work, args=(a, b)).start()
        threading.Thread(target=work, args=(b, a)).start()
    """) == ["100 idle for ever"]


@pytest.mark.rule(5)
def test_a_lock_goes_to_whoever_has_waited_longest() -> None:
    """First come, first served; a timeout gives up at its instant."""
    assert play("""
        import threading, time
        lock = threading.Lock()
        def work(name):
            with lock:
                say(name)
                time.sleep(1)
        for name in "abc":
            threading.Thread(target=work, args=(name,)).start()
        time.sleep(0.5)
        say(lock.locked())
        say(lock.acquire(blocking=False))
        say(lock.acquire(timeout=1))
        say(lock.acquire(timeout=2))
        lock.release()
        say(lock.locked())
    """) == [
        "0 a",
        "500 True",
        "500 False",
        "1000 b",
        "1500 False",
        "2000 c",
        "3000 True",
        "3000 False",
        "3000 end",
    ]


@pytest.mark.rule(5)
@pytest.mark.parametrize(
    ("made", "wait", "wake"),
    [
        ("threading.Lock(); one.acquire()", "one.acquire(timeout=1)", "one.release()"),
        ("threading.Lock(); one.acquire()", "one.acquire()", "one.release()"),
        ("threading.Event()", "one.wait(1)", "one.set()"),
        ("threading.Semaphore(0)", "one.acquire(timeout=1)", "one.release()"),
        ("queue.Queue()", "one.get(timeout=1)", "one.put(True)"),
        ("queue.SimpleQueue()", "one.get(timeout=1)", "one.put(True)"),
        ("concurrent.futures.Future()", "one.result(1)", "one.set_result(True)"),
    ],
)
def test_what_others_do_while_a_program_works_is_seen(made: str, wait: str, wake: str) -> None:
    """Time passes for the work before a wait, and what is to be waited for may happen in it."""
    assert play(f"""
        import concurrent.futures, queue, threading, time
        one = {made}
        def other():
            time.sleep(0.1)
            {wake}
        threading.Thread(target=other).start()
        work(200)
        say({wait})
    """) == ["200 True", "200 end"]


def test_a_lock_can_be_copied_no_more_than_elsewhere() -> None:
    """A program that copies an object with a lock in it fails, and fails here as well."""
    said = play("""
        import copy, threading
        class Robot:
            def __init__(self):
                self.lock = threading.Lock()
        for thing in (Robot(), threading.RLock(), threading.Event()):
            try:
                copy.deepcopy(thing)
            except TypeError as error:
                say(type(error).__name__)
        say(repr(threading.Lock())[:24])
    """)
    assert [line.partition(" ")[2] for line in said[:-1]] == [*["TypeError"] * 3, "<unlocked _thread.lock ob"[:24]]


def test_locks_are_misused_with_the_same_errors() -> None:
    """Whatever raises in an ordinary program raises here, with the same words."""
    with pytest.raises(ValueError, match="timeout value must be") as refused:  # each Python has its own words
        threading.Lock().acquire(timeout=-2)
    said = play("""
        import threading
        lock, again, condition, bounded = (
            threading.Lock(), threading.RLock(), threading.Condition(), threading.BoundedSemaphore(1)
        )
        def tried(call, *arguments, **named):
            try:
                say(call(*arguments, **named))
            except (RuntimeError, ValueError, TypeError, threading.ThreadError) as error:
                say(f"{type(error).__name__}: {error}")
        tried(lock.release)
        tried(lock.acquire, False, 1)
        tried(lock.acquire, timeout=-2)
        tried(again.release)
        tried(condition.notify)
        tried(condition.wait, 1)
        tried(bounded.release)
        tried(threading.Semaphore, -1)
        tried(threading.Thread(target=int).join)
        twice = threading.Thread(target=int)
        twice.start(); twice.join()
        tried(twice.start)
    """)
    assert [line.partition(" ")[2] for line in said[:-1]] == [
        "RuntimeError: release unlocked lock",
        "ValueError: can't specify a timeout for a non-blocking call",
        f"ValueError: {refused.value}",
        "RuntimeError: cannot release un-acquired lock",
        "RuntimeError: cannot notify on un-acquired lock",
        "RuntimeError: cannot wait on un-acquired lock",
        "ValueError: Semaphore released too many times",
        "ValueError: semaphore initial value must be >= 0",
        "RuntimeError: cannot join thread before it is started",
        "RuntimeError: threads can only be started once",
    ]


def test_an_rlock_is_entered_again_by_its_owner_only() -> None:
    """Another thread waits until it is left as often as it was entered."""
    assert play("""
        import threading, time
        lock = threading.RLock()
        def other():
            say(lock.acquire(timeout=0.5))
            with lock:
                say("other")
        with lock:
            with lock:
                threading.Thread(target=other).start()
                time.sleep(1)
            time.sleep(1)
            say("main")
    """) == ["500 False", "2000 main", "2000 other", "2000 end"]


def test_a_lock_is_released_when_its_block_raises() -> None:
    """The with statement holds what it promises."""
    assert play("""
        import threading
        lock = threading.Lock()
        try:
            with lock:
                raise KeyError("x")
        except KeyError:
            say(lock.locked())
    """) == ["0 False", "0 end"]


def test_a_condition_wakes_as_many_as_it_is_told() -> None:
    """One, then all; `wait_for` looks at its predicate again and gives up at its timeout."""
    assert play("""
        import threading, time
        condition = threading.Condition()
        state = 0
        def work(name):
            with condition:
                condition.wait()
                say(name)
        for name in "abc":
            threading.Thread(target=work, args=(name,)).start()
        time.sleep(1)
        with condition: condition.notify()
        time.sleep(1)
        with condition: condition.notify_all()
        def advance():
            global state
            for state in (1, 2):
                time.sleep(1)
                with condition: condition.notify_all()
        threading.Thread(target=advance).start()
        with condition:
            say(condition.wait_for(lambda: state == 2, timeout=10))
            say(condition.wait_for(lambda: state == 3, timeout=2))
            say(condition.wait(0.5))
    """) == ["1000 a", "2000 b", "2000 c", "3000 True", "5000 False", "5500 False", "5500 end"]


def test_semaphores_and_barriers_hold_threads_back() -> None:
    """Two at a time through the semaphore; all three at once through the barrier; a broken barrier raises."""
    assert play("""
        import threading, time
        semaphore, barrier = threading.Semaphore(2), threading.Barrier(3)
        def work(name, pause_s):
            with semaphore:
                time.sleep(1)
                say(name)
            time.sleep(pause_s)
            barrier.wait()
            say(f"{name} through")
        for pair in (("a", 3), ("b", 0), ("c", 0)):
            threading.Thread(target=work, args=pair).start()
        time.sleep(5)
        try:
            barrier.wait(timeout=1)
        except threading.BrokenBarrierError:
            say("broken")
    """) == [
        "1000 a",
        "1000 b",
        "2000 c",
        "4000 a through",
        "4000 b through",
        "4000 c through",
        "6000 broken",
        "6000 end",
    ]


def test_thread_locals_and_names_stay_the_threads_own() -> None:
    """What threads know about themselves is untouched."""
    assert play("""
        import threading, time
        own = threading.local()
        def work():
            own.value = threading.current_thread().name
            time.sleep(0.1)
            say(own.value)
        for name in ("left", "right"):
            threading.Thread(target=work, name=name).start()
        say(threading.active_count())
        say(threading.main_thread() is threading.current_thread())
    """) == ["0 3", "0 True", "100 left", "100 right", "100 end"]


def test_the_low_level_module_is_virtual_as_well() -> None:
    """`_thread` is what everything above rests on."""
    assert play("""
        import _thread, time
        done = _thread.allocate_lock()
        done.acquire()
        def work(pause_s):
            time.sleep(pause_s)
            say("work")
            done.release()
        _thread.start_new_thread(work, (0.5,))
        say(done.acquire(timeout=2))
    """) == ["500 work", "500 True", "500 end"]


@pytest.mark.breadth(6, 20)
@pytest.mark.rule(5)
@pytest.mark.parametrize("name", ORDERS)
def test_who_goes_on_first(name: str) -> None:
    """A new thread runs until it blocks or writes; whoever wakes another one goes on, also where both write."""
    code, expected = ORDERS[name]
    said = play(IMPORTS + "note = say\n" + textwrap.dedent(code))
    assert " ".join(line.partition(" ")[2] for line in said[:-1]) == expected


def test_a_thread_that_writes_waits_for_nobody_who_waits() -> None:
    """Threads that nothing has woken do not go on because another one writes, and a lock stays with its owner."""
    assert play("""
        import threading, time
        lock = threading.Lock()
        def work():
            with lock:
                write("a 1"); write("a 2")
        with lock:
            thread = threading.Thread(target=work)
            thread.start()
            write("main 1"); time.sleep(1); write("main 2")
        thread.join()
    """) == ["0 main 1", "1000 main 2", "1000 a 1", "1000 a 2", "1000 end"]


def test_a_thread_is_reported_once_its_exception_is_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was written before a report is recorded before it; also where the program has broken its own output."""
    events: list[str] = []
    monkeypatch.setattr(threading, "excepthook", threading.excepthook)
    monkeypatch.setattr(threading, "__excepthook__", lambda args: events.append("printed"))
    report_threads(lambda error: FaultReport(message=str(error)), lambda fault: events.append(fault.message))
    thread = threading.Thread(target=int, args=("x",))
    thread.start()
    thread.join()
    assert events == ["printed", "invalid literal for int() with base 10: 'x'"]

    def broken(args: Any) -> None:
        raise OSError("closed")

    monkeypatch.setattr(threading, "__excepthook__", broken)
    with pytest.raises(OSError, match="closed"):
        threading.excepthook(threading.ExceptHookArgs((ValueError, ValueError("second"), None, None)))
    with pytest.raises(OSError, match="closed"):
        threading.excepthook(threading.ExceptHookArgs((SystemExit, SystemExit(0), None, None)))
    assert events[2:] == ["second"]
