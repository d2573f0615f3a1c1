"""Clocks and sleeps in virtual time: they agree with each other, drift by nothing and let busy loops go on."""

from __future__ import annotations

import time

import pytest
from staging_programs import play


def test_sleeping_is_exact() -> None:
    """A thousand pauses of a twentieth of a second are fifty seconds, to the nanosecond; then one of half of one."""
    assert play("""
        import time
        from time import sleep, monotonic_ns
        for _ in range(1000):
            sleep(0.05)
        time.sleep(0.0000005)
        time.sleep(True)
        start, epoch = monotonic_ns(), time.time_ns() - 51_000_000_500
        time.sleep(0.5)
        say((monotonic_ns() - start, (time.time_ns() - epoch) // 10_000))
    """) == ["51500 (500002000, 5150000)", "51500 end"]


@pytest.mark.breadth(5, 20)
@pytest.mark.parametrize("clock", ["time.time", "time.monotonic", "time.perf_counter", "now"])
@pytest.mark.parametrize(("compare", "pause"), [(">=", 0.01), (">", 0.01), (">=", 0.025), (">", 0.05), (">", 0.002)])
def test_a_loop_that_compares_clocks_after_each_pause_keeps_its_pace(clock: str, compare: str, pause: float) -> None:
    """As on any machine a pause is over a little late, so that the last one of a period completes it."""
    said = play(f"""
        import datetime, time
        def now():
            return datetime.datetime.now().timestamp()
        last = {clock}()
        rounds = 0
        while rounds < 40:
            time.sleep({pause})
            if {clock}() - last {compare} 0.05:
                last = {clock}()
                rounds += 1
        say("over")
    """)
    assert 2000 <= float(said[0].split()[0]) <= 2002


def test_every_clock_tells_the_same_time() -> None:
    """Wall clocks and steady ones, in seconds and nanoseconds, advance together."""
    assert play("""
        import datetime, time
        clocks = (time.time, time.monotonic, time.perf_counter, lambda: datetime.datetime.now().timestamp())
        whole = (time.time_ns, time.monotonic_ns, time.perf_counter_ns)
        before = [c() for c in clocks], [c() for c in whole]
        time.sleep(1.5)
        say([round(c() - b, 4) for c, b in zip(clocks, before[0])])
        say([round(c() - b, -5) for c, b in zip(whole, before[1])])
    """) == ["1500.01 [1.5, 1.5, 1.5, 1.5]", "1500.01 [1500000000, 1500000000, 1500000000]", "1500.01 end"]


def test_dates_follow() -> None:
    """However they were imported, and with or without a time zone."""
    assert play("""
        import datetime, time
        from datetime import date, datetime as dt, timezone
        time.sleep(90061)
        say(dt.now(timezone.utc).isoformat())
        say(date.fromtimestamp(time.time()) == date.today() == datetime.date.today() == dt.today().date())
        say(time.strftime("%Y-%m-%d %H:%M:%S", time.gmtime()))
        say(time.strftime("%j") == dt.now().strftime("%j"))
        say(time.localtime() == time.localtime(time.time()))
        say(time.ctime() == time.asctime())
    """) == [
        "90061000 2026-11-02T01:01:01+00:00",
        "90061000 True",
        "90061000 2026-11-02 01:01:01",
        "90061000 True",
        "90061000 True",
        "90061000 True",
        "90061000 end",
    ]


@pytest.mark.parametrize(
    "look",
    [
        "time.time() < start + 0.1",
        "time.time_ns() < (start + 0.1) * 1e9",
        "time.monotonic() - steady < 0.1",
        "time.perf_counter_ns() - precise < 100_000_000",
        "datetime.datetime.now() < begin + datetime.timedelta(seconds=0.1)",
        "time.clock_gettime(time.CLOCK_MONOTONIC) < raw + 0.1",
        "time.clock_gettime_ns(time.CLOCK_MONOTONIC) < (raw + 0.1) * 1e9",
    ],
)
def test_a_loop_that_only_looks_at_a_clock_goes_on(look: str) -> None:
    """It sees the time pass in small steps, and leaves the loop within one of them."""
    said = play(f"""
        import datetime, time
        start, begin, steady, precise = time.time(), datetime.datetime.now(), time.monotonic(), time.perf_counter_ns()
        raw = time.clock_gettime(time.CLOCK_MONOTONIC)
        while {look}:
            pass
        say("over")
    """)
    at_ms, _ = said[0].split()
    assert 100 <= float(at_ms) <= 101


@pytest.mark.parametrize(
    "look",
    [
        "not done.is_set()",
        "not future.done()",
        "thread.is_alive()",
        "not results",
        "items.empty()",
        "not items.qsize()",
        "not got(items)",
        "lock.locked()",
        "not lock.acquire(blocking=False)",
    ],
)
def test_a_loop_that_waits_for_another_thread_without_blocking(look: str) -> None:
    """The other thread gets its turn if the loop sleeps, looks at a clock or asks whether something has happened."""
    pause = "time.sleep(0)" if look == "not results" else "pass"
    said = play(f"""
        import queue, threading, time
        from concurrent.futures import Future
        done, future, items, results, lock = threading.Event(), Future(), queue.Queue(), [], threading.Lock()
        lock.acquire()
        def got(items):
            try:
                return items.get_nowait()
            except queue.Empty:
                return None
        def work():
            time.sleep(0.1)
            done.set(); future.set_result(1); items.put(1); results.append(1); lock.release()
        thread = threading.Thread(target=work)
        thread.start()
        while {look}:
            {pause}
        say("over")
    """)
    at_ms, _ = said[0].split()
    assert 100 <= float(at_ms) <= 110.5


def test_looking_now_and_then_costs_nothing() -> None:
    """A program that sleeps between its looks, however often it looks, drifts by a microsecond a look only."""
    assert play("""
        import datetime, threading, time
        stop = threading.Event()
        start = time.monotonic()
        for number in range(3000):
            time.time(); time.monotonic(); datetime.datetime.now(); stop.is_set()
            time.sleep(0.01)
        say(round(time.monotonic() - start, 9))
    """) == ["30009 30.009001", "30009 end"]


def test_sleeping_until_a_deadline_does_not_drift() -> None:
    """The pattern of a paced loop: look at the clock, sleep for the rest."""
    assert play("""
        import time
        following = time.monotonic()
        for number in range(1, 2001):
            following += 0.05
            time.sleep(max(0.0, following - time.monotonic()))
        say(number)
    """) == ["100000 2000", "100000 end"]


def test_sleep_refuses_what_it_always_refuses() -> None:
    """The same kinds of error, in the words of this version of Python where students see them often."""
    words = []
    for wrong in (-1, "1"):
        with pytest.raises((ValueError, TypeError)) as caught:
            time.sleep(wrong)  # type: ignore[arg-type]
        words.append(f"{type(caught.value).__name__}: {caught.value}")
    assert play("""
        import time
        from decimal import Decimal
        from fractions import Fraction
        for wrong in (-1, -0.001, "1", None, [], float("nan"), float("inf"), Decimal(1), Fraction(1, 2)):
            try:
                time.sleep(wrong)
                say(f"slept {wrong!r}")
            except (TypeError, ValueError, OverflowError) as error:
                words = f": {error}" if isinstance(wrong, (str, int)) else ""
                say(type(error).__name__ + words)
        try:
            time.sleep()
        except TypeError:
            say("needs one")
    """) == [
        f"0 {words[0]}",
        "0 ValueError",
        f"0 {words[1]}",
        "0 TypeError",
        "0 TypeError",
        "0 ValueError",
        "0 OverflowError",
        "0 TypeError",
        "0 TypeError",
        "0 needs one",
        "0 end",
    ]


def test_sleeping_for_nothing_lets_others_run() -> None:
    """`sleep(0)` gives the turn away and takes no time."""
    assert play("""
        import threading, time
        def work(name):
            for _ in range(2):
                say(name)
                time.sleep(0)
        threading.Thread(target=work, args=("a",)).start()
        threading.Thread(target=work, args=("b",)).start()
    """) == ["0 a", "0 b", "0 a", "0 b", "0 end"]


def test_sched_follows() -> None:
    """A scheduler of the standard library that was made with the module's own clock."""
    assert play("""
        import sched, time
        plan = sched.scheduler(time.monotonic, time.sleep)
        soon = time.monotonic() + 1
        plan.enter(2, 1, say, ("late",))
        plan.enterabs(soon, 2, say, ("second",))
        plan.enterabs(soon, 1, say, ("first",))
        plan.run()
        sched.scheduler().enter(1, 1, say, ("default",))
    """) == ["1000 first", "1000 second", "2000 late", "2000 end"]


def test_processor_time_is_not_virtual() -> None:
    """What was computed was computed."""
    assert play("""
        import time
        before = time.process_time()
        time.sleep(100)
        say(time.process_time() - before < 50)
    """) == ["100000 True", "100000 end"]


CLOCKS = (
    "time.time()",
    "time.time_ns()",
    "time.monotonic()",
    "time.monotonic_ns()",
    "time.perf_counter()",
    "time.perf_counter_ns()",
    "time.clock_gettime(time.CLOCK_MONOTONIC)",
    "time.clock_gettime_ns(time.CLOCK_REALTIME)",
    "datetime.datetime.now().timestamp()",
    "datetime.datetime.now(datetime.timezone.utc).timestamp()",
)


@pytest.mark.parametrize("look", CLOCKS)
def test_two_looks_at_one_instant_differ(look: str) -> None:
    """By a microsecond, as on any real clock: programs divide by the difference, and take logarithms of it."""
    said = play(f"""
        import datetime, math, time
        looks = [{look} for _ in range(100)]
        steps = [b - a for a, b in zip(looks, looks[1:])]
        unit = 1e-6 if isinstance(looks[0], float) else 1000
        say(all(0.5 < step / unit < 1.5 for step in steps))
        say(max(1 / step for step in steps) > 0 and math.log(min(steps)) < 7)
    """)
    assert said == ["0 True", "0 True", "0 end"]


def test_looks_at_different_clocks_are_in_order() -> None:
    """Whatever clock a program looks at, the time that it was shown before is over."""
    assert play("""
        import datetime, time
        start = time.time_ns(), time.monotonic_ns()
        told = []
        for _ in range(20):
            told += [time.time_ns() - start[0], time.monotonic_ns() - start[1] + 1000]
        say(told == [1000 * n for n in range(2, 42)])
    """) == ["0 True", "0 end"]


def test_looks_of_libraries_take_no_time() -> None:
    """Their number is theirs: a coroutine that sleeps is woken as exactly as a thread, and may look at its clock."""
    assert play("""
        import asyncio, logging, time
        async def main():
            loop = asyncio.get_running_loop()
            start = loop.time()
            for _ in range(1000):
                logging.getLogger().debug("x")
                await asyncio.sleep(0.01)
            say(round(loop.time() - start, 6))
            first = loop.time()
            say(loop.time() > first)
        asyncio.run(main())
    """) == ["10001 10.001", "10001 True", "10001 end"]


def test_many_looks_between_other_things_let_time_pass() -> None:
    """Time is never shown further ahead than it is about to be: what other threads are due for comes in between."""
    assert play("""
        import threading, time
        done = threading.Event()
        start = time.monotonic()
        timer = threading.Timer(0.0005, done.set)
        timer.start()
        looks = 0
        while not done.is_set():
            threading.Event().set()
            looks += 1
            assert time.monotonic() - start < 0.0011
        say(looks > 100)
        timer.join()
    """) == ["0.5 True", "0.5 end"]


@pytest.mark.parametrize("looks", [0, 1, 2, 7])
def test_sleeping_until_a_deadline_ends_at_it_however_often_a_program_looks(looks: int) -> None:
    """Never before the deadline by any clock, and not later the longer it goes on."""
    assert play(f"""
        import time
        following = time.monotonic()
        early = 0
        for number in range(1, 1001):
            following += 0.05
            for _ in range({looks}):
                time.perf_counter()
            time.sleep(max(0.0, following - time.monotonic()))
            early += time.monotonic() < following
        say(early)
    """) == ["50000 0", "50000 end"]
