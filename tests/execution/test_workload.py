"""What steps cost adds up to the delay of a real clock; and the kernel's counts are read right."""

import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from grader.execution.workload import LATE_AT_LEAST, LATE_SHARE, Delay, Workload

MS = 1_000_000


def delayed(*costs_ms: float, period_ms: int = 50) -> Delay:
    """Return the delay of a process that wakes up once a period, and then does so much."""
    delay = Delay()
    for number, cost_ms in enumerate((0, *costs_ms)):
        delay.wake(number * period_ms * MS)
        delay.work(round(cost_ms * MS))
    delay.wake((len(costs_ms) + 1) * period_ms * MS)
    return delay


def test_work_within_the_period_delays_nothing() -> None:
    """However often: what was there before the next wake-up is no delay."""
    delay = delayed(*[45] * 200)
    assert (delay.wake_ups, delay.late, delay.hides) == (200, 0, False)


def test_work_beyond_the_period_adds_up() -> None:
    """Each wake-up inherits the delay of the one before: 60 ms of 50 are 40 ms late after four, and more after five."""
    assert not delayed(*[50] * 100).hides
    assert delayed(*[60] * 4).late == 0
    assert delayed(*[60] * 10).late == 6


def test_one_long_pause_is_no_habit() -> None:
    """A node that is held up once is late a few times, and its average hardly changes."""
    delay = delayed(*[1] * 50, 180, *[1] * 149)
    assert 0 < delay.late <= max(LATE_AT_LEAST, LATE_SHARE * delay.wake_ups)
    assert not delay.hides


def test_a_pause_in_every_second_is_a_habit() -> None:
    """200 ms in one of twenty callbacks of 50 ms hold up four of twenty."""
    assert delayed(*[200, *[1] * 19] * 10).hides


def test_a_long_answer_is_late_even_where_there_is_time() -> None:
    """Work of 300 ms before an answer matters although the next wake-up is a second away."""
    assert delayed(*[300] * 10, period_ms=1000).hides
    assert not delayed(*[100] * 10, period_ms=1000).hides


def put_off(*costs_ms: float, period_ms: int = 50) -> Delay:
    """Return the delay of a process that pauses for a period after so much work, each time."""
    delay = Delay()
    for number, cost_ms in enumerate((0, *costs_ms)):
        delay.wake(number * period_ms * MS)
        delay.work(round(cost_ms * MS))
        delay.put_off(round(cost_ms * MS))
    return delay


def test_a_pause_after_work_puts_off_what_comes_next() -> None:
    """A loop that works for 5 ms and sleeps for 50 runs at 18 Hz, and is never late by what a timer would need."""
    assert put_off(*[5] * 100).hides
    assert not delayed(*[5] * 100).hides
    assert not put_off(*[1.5] * 100).hides
    assert not put_off(*[20] * 20, period_ms=1000).hides


def test_some_long_work_between_pauses_is_no_habit() -> None:
    """Importing a module and making a node may come after a first pause."""
    assert not put_off(45, 45, 45, *[1.5] * 100).hides


def test_the_start_delays_nothing() -> None:
    """A program that imports for ten seconds only starts later."""
    delay = Delay()
    delay.wake(0)
    delay.work(10_000 * MS)
    assert not delay.hopeless
    delay.wake(50 * MS)
    delay.wake(100 * MS)
    assert (delay.late, delay.hides) == (0, False)


def test_endless_work_is_hopeless_at_once() -> None:
    """There is no next wake-up to wait for."""
    delay = delayed(1, 1)
    assert not delay.hopeless
    delay.work(2_500 * MS)
    assert delay.hopeless


@pytest.fixture
def child() -> Iterator[subprocess.Popen[str]]:
    """A process that works for so many milliseconds, or sleeps, for each line it is given, and then says so."""
    program = (
        "import sys, time\n"
        "for line in sys.stdin:\n"
        "    kind, ms = line.split()\n"
        "    end = time.process_time() + int(ms) / 1000\n"
        "    while kind == 'work' and time.process_time() < end: pass\n"
        "    if kind == 'sleep': time.sleep(int(ms) / 1000)\n"
        "    print('done', flush=True)\n"
    )
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1) as process:
        yield process
        assert process.stdin is not None
        process.stdin.close()


@pytest.mark.parametrize("kind", ["work", "sleep"])
def test_work_and_waiting_are_told_apart(child: subprocess.Popen[str], kind: str) -> None:
    """By the kernel's word, whatever else the machine does."""
    assert child.stdin is not None
    child.stdin.write("work 1\n")
    assert child.stdout is not None
    child.stdout.readline()
    workload = Workload(child.pid, 0)
    workload.begin(0)
    child.stdin.write(f"{kind} 300\n")
    child.stdout.readline()
    workload.end({})
    assert (workload.used_ns >= 290 * MS) is (kind == "work")
    assert (workload.waited_ns >= 100 * MS) is (kind == "sleep")


def test_waiting_for_messages_is_not_the_processs_own(child: subprocess.Popen[str]) -> None:
    """But only for as long as messages take."""
    assert child.stdin is not None
    child.stdin.write("work 1\n")
    assert child.stdout is not None
    child.stdout.readline()
    workload = Workload(child.pid, 0)
    workload.begin(0, arrivals=True)
    time.sleep(0.015)
    workload.arrived()
    workload.end({})
    assert workload.waited_ns < 15 * MS
    workload.begin(0, arrivals=True)
    time.sleep(0.3)
    workload.arrived()
    workload.end({})
    assert workload.waited_ns > 200 * MS


def test_a_process_that_has_ended_uses_nothing() -> None:
    """Its clock is gone, and nothing fails."""
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        workload = Workload(process.pid, 0)
    workload.begin(0)
    workload.end({})
    assert workload.used_ns == 0
