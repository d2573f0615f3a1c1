"""Combines the parts of virtual time, and exchanges reports and answers with the grader."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from . import originals, threads, times
from .clock import VirtualClock
from .link import Link
from .order import ReadyOrder
from .protocol import Answer, AwaitMatches, Expect, FaultReport, Go, Idle, Matched, MessagesArrived, Progress, Stop
from .replaced import as_builtin
from .scheduler import GreenThread, Scheduler

if TYPE_CHECKING:
    from .ros_clocks import RosClocks
    from .ros_state import RosState

#: How often time may advance without asking the grader. The grader measures the work between two reports, which must
#: not be hidden among the polls of a busy loop.
MOST_MOVES = 10
#: The same for the processor time since the last answer: what a program did between two pauses is measured apart.
MOST_WORK_NS = 5_000_000
#: Where the time of work is part of the recording: so much work after each pause takes no time, as it depends on the
#: machine; and less than this is not worth a report.
FREE_NS, LEAST_NS = 500_000, 50_000
#: What work takes beyond its processor time counts if it is more than this, without the time that the thread waited for
#: a processor: on a busy machine the middleware's threads hold it up as well.
UNEXPLAINED_NS = 3_000_000
#: How far the host's own clock may advance after the stop signal.
STOPPING_NS = 60_000_000_000
#: Messages that arrive in less real time are not worth a report.
QUICK_S = 0.0005
#: Real seconds that a waiting thread is given to receive a signal.
INTERRUPT_S = 0.02


class Work:
    """Measures the work of the student's code since it last continued: real time without waits for a processor.

    Args:
        share: The share of it that counts.
    """

    def __init__(self, share: float) -> None:
        self._share = share
        self.restart(0)

    def restart(self, free_ns: int) -> None:
        """Begin to measure; so much is not counted."""
        self._thread, self._free_ns = originals.get_native_id(), free_ns
        self._used_ns, self._began_s = originals.processor_ns(), originals.perf_counter()
        self._starved_ns = originals.starved_ns(self._thread)

    def done_ns(self) -> int:
        """Return the time that counts."""
        used_ns = originals.processor_ns() - self._used_ns
        waited_ns = round((originals.perf_counter() - self._began_s) * 1e9) - used_ns
        if waited_ns > UNEXPLAINED_NS and self._thread == originals.get_native_id():
            waited_ns -= originals.starved_ns(self._thread) - self._starved_ns
        taken_ns = used_ns + (waited_ns if waited_ns > UNEXPLAINED_NS else 0)
        return round(self._share * taken_ns) - self._free_ns


class VirtualTime:
    """The virtual time of one process.

    Args:
        link: The connection to the grader.
        real: The real clocks, signals and pauses: the module `originals`.
    """

    def __init__(self, link: Link, real: Any = originals) -> None:
        self._link = link
        self._real = real
        self.clock = VirtualClock()
        self.scheduler = Scheduler(lambda: self.clock.now_ns, self._ask_for_time)
        self.clock.let_time_pass = lambda until_ns: self.scheduler.pause(until_ns, polls=True)
        self.order = ReadyOrder(lambda: self.clock.now_ns)
        self._ros: RosState | None = None
        self._clocks: RosClocks | None = None
        self._stopping = False
        self._finishing = False
        self._end_ns = 0
        self._free_until_ns = self._moved = self._domain = 0
        self.unreported = False
        self.resumed_ns = self._real.processor_ns()
        self._worked_ns = 0  # until then, without what the host does while it waits for the grader
        self.running = True
        self.has_blocked = False
        self._work: Work | None = None
        self._charging: set[GreenThread] = set()
        self._charges = False
        #: Called with a reason before the program waits for something outside of virtual time.
        self.give_up_outside: Callable[[str], None] = lambda reason: None
        #: Called before the stop signal at the end of a recording: the program may be killed soon after it.
        self.before_stop: Callable[[], None] = lambda: None

    def install(self, describe: Callable[[BaseException], FaultReport], report: Callable[[FaultReport], None]) -> None:
        """Make the threads, locks, selectors and clocks of this process virtual.

        Args:
            describe: Describes an exception that ends one of the student's threads.
            report: Called with the description once Python has printed the exception.
        """
        threads.install_locks(self.scheduler, self.clock)
        threads.install_threads(self.scheduler, self.clock, describe, report)
        times.install_thread_looks(self.clock)
        times.install_sleep_and_clocks(self.scheduler, self.clock)
        threads.install_selectors(self.scheduler, self.clock, lambda: self.give_up_outside("waiting"))

    def install_ros(self) -> None:
        """Import rclpy and make it virtual."""
        # All of them before the first is installed: each keeps the originals that the host itself goes on using.
        from . import lifetimes, looks, ros, ros_clocks, traffic, wait_set
        from .ros_state import new_ros_state

        self._ros = new_ros_state(self.order.note)
        self._clocks = ros_clocks.RosClocks(self.clock)
        self.clock.real_ns = ros_clocks.system_ns
        # Each replacement calls what it finds, so that of two for one function the later one is called first.
        ros.install_order()
        ros_clocks.install_clocks(self._clocks, self.scheduler, self.clock)
        wait_set.install_wait_sets(self.scheduler, self.clock, self._ros, self.order, self._settle)
        traffic.install_traffic(
            self._ros,
            self.clock,
            self._settle,
            self.leave,
            self.depart,
            lambda: self.give_up_outside("timed_event"),
            lambda: self._worked_ns + self._real.processor_ns() - self.resumed_ns,
        )
        ros.install_events_executor(lambda: self.give_up_outside("events_executor"))
        lifetimes.note_other_domains(lambda: self._domain, self._link.send)
        looks.install_looks(self.clock, self._ros, self._settle)
        lifetimes.install_own_signals(self._await_shutdown)
        ros.install_callers()
        times.install_wall_time(self.clock)
        self._notice_output(ros.replace_log)

    def _notice_output(self, replace_log: Callable[..., None]) -> None:
        """Make the program report before time advances whenever it has written output, so that its time is exact.

        Threads may take turns after a line or a log record: `print` writes the end of a line after the line.
        """

        def noticing(write: Callable[..., Any], ends: Callable[..., bool]) -> Callable[..., Any]:
            def write_and_note(*args: Any, **named: Any) -> Any:
                self.unreported = True
                written = write(*args, **named)
                if ends(*args):
                    self.scheduler.wrote()
                return written

            return write_and_note

        for stream in (sys.stdout, sys.stderr):
            noted = noticing(stream.write, lambda text: text.endswith("\n"))
            stream.write = as_builtin(noted, stream.write)  # type: ignore[method-assign]
        replace_log(lambda log: noticing(log, lambda *_: True))

    def start(self, now_ns: int, steady_ns: int, *, charged: float = 0.0) -> None:
        """Start virtual time in this thread, which may be of a fork of the process that made this object.

        Args:
            now_ns: Nanoseconds since 1970.
            steady_ns: When its monotonic clocks were at zero, in nanoseconds since 1970.
            charged: The share of the program's work that takes time; 0 if time stands still while it works.
        """
        self.clock.steady_ns = steady_ns
        if charged:
            self._work = Work(charged)
            self.clock.charge = self._charge
        self.scheduler.current.native = self._real.get_native_id()
        self._domain = int(os.environ.get("ROS_DOMAIN_ID", "0"))
        self._move_to(now_ns)
        self.resumed_ns = self._real.processor_ns()

    def progress(self) -> Progress:
        """Return the common part of reports: the time, and what has happened since the last one, if anything has."""
        self.unreported = False
        found = Progress(
            now_ns=self.clock.now_ns,
            paused=self.clock.paused,
            counted=self.clock.counted,
            moved=self._moved,
            charged=self._charges,
            threads=self.scheduler.others_ran(),
        )
        self._charges = False
        if self.order.is_drawn:
            did, drew = self.order.told()
            found = found._replace(did=did, drew=drew)
        self.clock.paused = self.clock.counted = False
        self._moved = 0
        return found if self._ros is None else self._with_traffic(found, self._ros)

    def _with_traffic(self, found: Progress, ros: RosState) -> Progress:
        """Add what was sent and lost, and the endpoints if they have changed."""
        found = found._replace(sent=dict(ros.outbox.sent), early=dict(+ros.outbox.early), lost=dict(ros.inbox.lost))
        for counted in (ros.outbox.sent, ros.outbox.early, ros.inbox.lost):
            counted.clear()
        if ros.endpoints.changed and not (ros.sending_and_removed or self._finishing):
            found = found._replace(endpoints=ros.endpoints.claims(self._domain), sees_graph=ros.graph.sees_graph)
        return found

    def _ask_for_time(self, wake_ns: int | None) -> None:
        self.has_blocked = True
        if self._ros is not None and (wake_ns is None or wake_ns > self.clock.now_ns):
            self._ros.outbox.note_waited()
        if self._stopping:
            self._run_on(wake_ns)
        else:
            self._converse(wake_ns)

    def _charge(self) -> None:
        """Let the time pass that the program has worked since it last continued."""
        thread = self.scheduler.mine()
        if self._work is None or thread is None or thread in self._charging or self._stopping:
            return
        done_ns = self._work.done_ns()
        if done_ns < LEAST_NS:
            return
        self._work.restart(0)
        self._charging.add(thread)
        try:
            end_ns = self.clock.now_ns + done_ns
            while self.clock.now_ns < end_ns and not self._stopping:
                self.unreported = self._charges = True  # the grader measures how much there was
                self.scheduler.pause(end_ns)
        finally:
            self._charging.remove(thread)

    def depart(self) -> None:
        """Do what `leave` does before the process may end at once, and tell what has changed: time, and endpoints."""
        self.leave()
        if self._ros is not None and (self._moved or self._ros.endpoints.changed):
            self._settle()

    def _settle(self) -> None:
        """Yield to the grader at the same instant."""
        self._converse(self.clock.now_ns)

    def leave(self) -> None:
        """Wait until everything that was sent has arrived, because its sender is about to be destroyed."""
        if self._ros is not None and self._ros.outbox.sending and not self._stopping:
            self._converse(self.clock.now_ns, leaving=True)

    def finish(self) -> None:
        """Report the last changes of endpoints; later ones are not reported, since freed objects may still send."""
        if self._ros is not None and self._ros.endpoints.changed:
            self._settle()
        self._finishing = True

    def end(self) -> bool:
        """Leave the ROS graph, as the interpreter does when it exits; return whether that was done."""
        if self._ros is None or self._stopping:
            return False
        from .lifetimes import leave_graph

        self.leave()
        leave_graph(self._ros.endpoints)
        return True

    def _converse(self, wake_ns: int | None, *, leaving: bool = False) -> None:
        """Send a report, wait for the answer and act on it.

        Args:
            wake_ns: When the program next wants to run, or None.
            leaving: Whether the answer has to wait until everything that was sent has arrived.
        """
        if self._stopping:
            return
        self.clock.pause()
        if wake_ns is not None and self._may_go_on(wake_ns):
            self._move_to(wake_ns)
            self._moved += 1
            if self._work is not None:
                self._work.restart(FREE_NS)
            return
        if self._ros is not None and self._ros.sending_and_removed and not leaving:
            self.leave()  # endpoints that were freed in the meantime may only be destroyed now
        report = Idle(self.progress(), wake_ns, leaving)
        before_ns, done_ns = self.clock.now_ns, 0 if self._work is None else self._work.done_ns()
        # What the host does until it has the answer is not the program's work: neither the watchdog nor the age of new
        # publishers counts it.
        self.running = False
        self._worked_ns += self._real.processor_ns() - self.resumed_ns
        answer = self._answered(report)
        self.resumed_ns = self._real.processor_ns()
        self.running = True
        if self._ros is not None and self._ros.graph.is_timed:
            self.give_up_outside("timed_event")
        if leaving and self._ros is not None:
            self._ros.outbox.settled()
        if isinstance(answer, Stop):
            self._stopping = True
            self._end_ns = self.clock.now_ns + STOPPING_NS
            self.before_stop()
            # The signal that Ctrl-C would send; the program ends as it ends then, on a clock that runs alone.
            self._real.kill(os.getpid(), signal.SIGINT)
            return
        self._move_to(answer.now_ns)
        self.order.step(answer.order)
        self._free_until_ns = answer.free_until_ns
        if self._ros is not None and answer.released:
            self.clock.busy()  # as below
            self._ros.inbox.let_go(answer.released)
        if self._ros is not None and answer.arrivals:
            self.clock.busy()  # a busy loop polls what has arrived before it lets time pass again
            began_s = self._real.perf_counter()
            self._ros.inbox.expect(answer.arrivals)
            if self._real.perf_counter() - began_s > QUICK_S:  # until then, the grader counts it as the program's work
                self._link.send(MessagesArrived())
        if self._work is not None:  # what was done at this instant is still to be counted
            self._work.restart(FREE_NS if self.clock.now_ns > before_ns else -done_ns)
        if answer.interrupt:
            self._interrupt()

    def _answered(self, report: Idle) -> Go | Stop:
        """Send a report and return the answer; handle the grader's requests to wait for matches or messages first."""
        answer: Answer = self._link.ask(report)
        while not isinstance(answer, (Go, Stop)):
            answer = self._link.ask(self._waited(answer))
        return answer

    def _waited(self, answer: Expect | AwaitMatches) -> MessagesArrived | Matched:
        """Wait as the grader says, and report it."""
        assert self._ros is not None  # who has no endpoints is never told to wait
        if isinstance(answer, Expect):
            self._ros.inbox.expect(answer.arrivals)
            self._ros.inbox.hold(answer.held)
            return MessagesArrived()
        missing = self._ros.graph.await_matches(answer.expected, answer.wait_s)
        self._ros.graph.await_absence(answer.gone, answer.wait_s)
        return Matched(missing, self._ros.graph.await_events(answer.expected, answer.wait_s))

    def _interrupt(self) -> None:
        """Receive the stop signal as from Ctrl-C, while the grader keeps control of time.

        The program's main thread handles it here, or where it waits for its turn. rclpy shuts down its contexts in
        another thread; waiting for it makes the result independent of which is faster.
        """
        try:
            self._real.kill(os.getpid(), signal.SIGINT)
            self._real.sleep(INTERRUPT_S)
        finally:
            self._await_shutdown()

    def _await_shutdown(self) -> None:
        """Wait, in real time, until rclpy has handled a signal."""
        if self._ros is not None:
            self._ros.endpoints.await_shutdown()
        self.scheduler.progress()

    def _may_go_on(self, wake_ns: int) -> bool:
        """Return whether time may advance without asking: nothing else happens and there is nothing to report."""
        return (
            self.clock.now_ns < wake_ns < self._free_until_ns
            and self._moved < MOST_MOVES
            and self._real.processor_ns() - self.resumed_ns < MOST_WORK_NS
            and not self.unreported
            and self._ros is not None
            and not self._ros.endpoints.changed
            and not self._ros.outbox.sent
        )

    def _move_to(self, now_ns: int) -> None:
        if self._ros is not None and now_ns > self.clock.now_ns:
            self._ros.outbox.settled()  # time advances only after all messages have arrived
        self.clock.move_to(now_ns)
        if self._clocks is not None:
            self._clocks.move()

    def _run_on(self, wake_ns: int | None) -> None:
        """Advance time after the stop signal, without the grader."""
        self._real.sleep(0.001)
        if wake_ns is not None and wake_ns <= self._end_ns:
            self._move_to(wake_ns)
