"""What steps cost adds up to the delay of a real clock; and the kernel's counts are read right."""

import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest
from quiet_kernel import QuietKernel

from grader.runtime.host.protocol import Progress
from grader.runtime.worker.delay import ARRIVAL_NS, LATE_AT_LEAST, LATE_SHARE, OUTRUN, Delay
from grader.runtime.worker.workload import Workload

MS = 1_000_000


def delayed(*costs_ms: float, period_ms: int = 50) -> Delay:
    """Return the delay of a process that wakes up once a period, and then does so much."""
    delay = Delay()
    for number, cost_ms in enumerate((0, *costs_ms)):
        delay.wake(number * period_ms * MS)
        delay.work(round(cost_ms * MS))
    delay.wake((len(costs_ms) + 1) * period_ms * MS)
    return delay


@pytest.mark.rule(21)
def test_work_within_the_period_delays_nothing() -> None:
    """However often: what was there before the next wake-up is no delay."""
    delay = delayed(*[45] * 200)
    assert (delay.wake_ups, delay.late, delay.hides) == (200, 0, False)


@pytest.mark.rule(21)
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


def put_off(*costs_ms: float, period_ms: int = 50, certain: bool = True) -> Delay:
    """Return the delay of a process that pauses for a period after so much work, each time."""
    delay = Delay()
    for number, cost_ms in enumerate((0, *costs_ms)):
        delay.wake(number * period_ms * MS)
        delay.work(round(cost_ms * MS))
        delay.put_off(round(cost_ms * MS), certain=certain)
    return delay


@pytest.mark.rule(22)
def test_a_pause_after_work_puts_off_what_comes_next() -> None:
    """A loop that works for 5 ms and sleeps for 50 runs at 18 Hz, and is never late by what a timer would need."""
    assert put_off(*[7] * 100).hides
    assert not delayed(*[7] * 100).hides
    assert not put_off(*[1.5] * 100).hides
    assert not put_off(*[20] * 20, period_ms=1000).hides


@pytest.mark.rule(22)
def test_a_pause_after_work_and_a_look_at_a_clock_may_put_off_what_comes_next() -> None:
    """It may be until a deadline, so that only another recording can tell; from far less work on."""
    assert [put_off(*[cost] * 100, certain=False).may_drift for cost in (0.3, 1.5, 2.0, 30)] == [
        False,
        False,
        True,
        True,
    ]
    assert not put_off(*[30] * 100, certain=False).hides
    assert not delayed(*[30] * 100).may_drift


def test_some_long_work_between_pauses_is_no_habit() -> None:
    """Importing a module and making a node may come after a first pause."""
    assert not put_off(45, 45, 45, *[1.5] * 100).hides


@pytest.mark.rule(21)
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
    workload.end(Progress())
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
    workload.end(Progress())
    assert workload.waited_ns < 15 * MS
    workload.begin(0, arrivals=True)
    time.sleep(0.3)
    workload.arrived()
    workload.end(Progress())
    assert workload.waited_ns > 200 * MS


def test_a_process_that_has_ended_uses_nothing() -> None:
    """Its clock is gone, and nothing fails."""
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        workload = Workload(process.pid, 0)
    workload.begin(0)
    workload.end(Progress())
    assert workload.used_ns == 0


class Clocks(QuietKernel):
    """Stands in for the kernel's counts: real and processor time, and how long each thread has waited."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        super().__init__()
        self.real_ns, self.used_ns = 1_000 * MS, 0
        self.starved_ns = {"1": 0}
        monkeypatch.setattr(time, "monotonic_ns", lambda: self.real_ns)
        monkeypatch.setattr(time, "clock_gettime_ns", lambda _: self.used_ns)
        self.workload = Workload(1, 0, self)

    def step(self, t_ms: float, real_ms: float, *, used_ms: float = 0, arrivals: int = 0, **report: Any) -> None:
        """Make one step at a virtual time, in which messages are said to arrive so often; half of it comes before."""
        self.workload.begin(round(t_ms * MS), arrivals=report.pop("announced", arrivals > 0) is True)
        self.real_ns += round(real_ms * MS / 2)
        for _ in range(arrivals):
            self.workload.arrived()
        self.real_ns += round(real_ms * MS / 2)
        self.used_ns += round(used_ms * MS)
        self.workload.end(Progress.checked(report))


@pytest.fixture
def clocks(monkeypatch: pytest.MonkeyPatch) -> Clocks:
    clocks = Clocks(monkeypatch)
    clocks.step(0, 0)
    clocks.step(50, 0)
    return clocks


@pytest.mark.rule(20)
def test_one_message_of_a_step_forgives_a_wait_and_only_where_messages_were_announced(clocks: Clocks) -> None:
    """Whatever a process says, and however often."""
    clocks.step(100, 100, arrivals=1)
    forgiven_ns = 100 * MS - clocks.workload.waited_ns
    assert forgiven_ns == ARRIVAL_NS
    clocks.step(150, 100, arrivals=5)
    assert 200 * MS - clocks.workload.waited_ns == 2 * ARRIVAL_NS
    clocks.step(200, 100, arrivals=5, announced=False)
    assert 300 * MS - clocks.workload.waited_ns == 2 * ARRIVAL_NS


@pytest.mark.rule(20)
def test_only_the_thread_that_waited_longest_is_taken_to_have_run(clocks: Clocks) -> None:
    """A hundred threads that each wait for a millisecond do not excuse a step of 100 ms."""
    clocks.starved_ns = {str(n): MS for n in range(100)}
    clocks.step(100, 100, threads=True)
    assert clocks.workload.waited_ns == 99 * MS
    clocks.starved_ns = {"1": 1000 * MS}
    clocks.step(150, 100, threads=True)
    assert clocks.workload.waited_ns == 99 * MS


@pytest.mark.rule(20)
def test_threads_of_the_middleware_excuse_nothing(clocks: Clocks) -> None:
    """As long as the program has one thread, only its waits count."""
    clocks.starved_ns = {"1": MS, "2": 100 * MS}
    clocks.step(100, 100)
    assert clocks.workload.waited_ns == 99 * MS


@pytest.mark.rule(20)
def test_work_while_the_grader_makes_a_process_wait_is_in_the_account(clocks: Clocks) -> None:
    """While its endpoints are matched, and while another step is not its own; discovery itself may take a while."""
    for number in range(2, 42):
        with clocks.workload.beside():
            clocks.real_ns += 10 * MS
        clocks.step(number * 50, 1)
    assert not clocks.workload.delay.hides
    for number in range(42, 82):
        with clocks.workload.beside():
            clocks.real_ns += 400 * MS
        clocks.step(number * 50, 1)
    assert clocks.workload.delay.hides


def test_threads_that_compute_between_two_steps_are_in_the_account(clocks: Clocks) -> None:
    """The process is only told to wait; what the middleware's threads use is little."""
    for busy, until in ((1, 42), (100, 82)):
        for number in range(until - 40, until):
            clocks.used_ns += busy * MS
            clocks.step(number * 50, 1, used_ms=1)
        assert clocks.workload.delay.hides is (busy > 50)


@pytest.mark.rule(21)
@pytest.mark.parametrize("report", [{}, {"moved": 10}, {"charged": True, "moved": 10}, {"arrivals": 3}])
def test_no_report_makes_a_process_faster_than_it_is(clocks: Clocks, report: dict[str, Any]) -> None:
    """Real time less waits for a processor, against virtual time: the bound of the whole run needs no report at all."""
    for number in range(2, 200):
        for _ in range(5):  # short steps, each with as many polls or arrivals as are believed
            clocks.step(number * 50, 2 * OUTRUN * 10, **report)
    assert clocks.workload.delay.hides
