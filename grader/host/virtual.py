"""Puts the pieces of virtual time together, and holds the conversation with the grader."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from . import originals, threads, times
from .clock import VirtualClock
from .link import Link
from .scheduler import Scheduler

if TYPE_CHECKING:
    from .ledger import Ledger
    from .ros import RosClocks

#: After the stop signal the host's own clock runs on, at most this far.
STOPPING_NS = 60_000_000_000
#: Real seconds in which a thread that waits for its turn hears of a signal.
INTERRUPT_S = 0.02


class VirtualTime:
    """The virtual clock of one process and what hangs on it.

    Args:
        link: The line to the grader.
        report_fault: Called with an exception that ended one of the student's threads.
    """

    def __init__(self, link: Link, report_fault: Callable[[BaseException], None]) -> None:
        self._link = link
        self.clock = VirtualClock()
        self.scheduler = Scheduler(lambda: self.clock.now_ns, self._ask_for_time)
        self.clock.let_time_pass = lambda until_ns: self.scheduler.pause(until_ns, polls=True)
        self._ledger: Ledger | None = None
        self._clocks: RosClocks | None = None
        self._stopping = False
        self._end_ns = 0
        self._free_until_ns = 0
        self.unreported = False
        self.resumed_ns = originals.processor_ns()
        self.running = True
        self.has_blocked = False
        self._used_ns = 0
        threads.install_locks(self.scheduler, self.clock)
        threads.install_threads(self.scheduler, self.clock, report_fault)
        times.install_looks(self.clock)
        times.install_sleep_and_clocks(self.scheduler, self.clock)
        threads.install_selectors(self.scheduler, self.clock)

    def install_ros(self) -> None:
        """Import rclpy and make it virtual."""
        from . import ros
        from .ledger import Ledger

        self._ledger = Ledger()
        self._clocks = ros.RosClocks(self.clock)
        ros.install_clocks(self._clocks, self.scheduler, self.clock)
        ros.install_wait_sets(self.scheduler, self.clock, self._ledger)
        ros.install_traffic(self._ledger, self.clock, lambda: self._converse(self.clock.now_ns))
        ros.install_looks(self.clock)
        times.install_wall_time(self.clock)
        self._notice_output(ros)

    def _notice_output(self, ros: Any) -> None:
        """Have everything that is written reported before time moves, so that it gets its own instant."""

        def noticing(write: Callable[..., Any]) -> Callable[..., Any]:
            def write_and_note(*args: Any) -> Any:
                self.unreported = True
                return write(*args)

            return write_and_note

        for stream in (sys.stdout, sys.stderr):
            stream.write = noticing(stream.write)  # type: ignore[method-assign]
        ros.replace_log(noticing)

    def start(self, now_ns: int) -> None:
        """Begin to live at a time."""
        self._move_to(now_ns)
        self.resumed_ns = originals.processor_ns()

    def summary(self) -> dict[str, Any]:
        """Return what every report carries: traffic, endpoints if they changed, processor time."""
        self._charge()
        self.unreported = False
        report: dict[str, Any] = {"cpu_ns": self._used_ns, "now_ns": self.clock.now_ns}
        if self._ledger is not None:
            report["sent"] = dict(self._ledger.sent)
            self._ledger.sent.clear()
            if self._ledger.lost:
                report["lost"] = dict(self._ledger.lost)
                self._ledger.lost.clear()
            if self._ledger.changed:
                report["endpoints"] = self._ledger.claims()
        return report

    def _charge(self) -> None:
        """Add the processor time since the last look to what the program has used, unless it only waited."""
        now = originals.processor_ns()
        if not self.clock.waiting:
            self._used_ns += now - self.resumed_ns
        self.resumed_ns = now

    def _ask_for_time(self, wake_ns: int | None) -> None:
        self.has_blocked = True
        if self._stopping:
            self._run_on(wake_ns)
        else:
            self._converse(wake_ns)

    def _converse(self, wake_ns: int | None) -> None:
        """Report, wait for the answer and do what it says."""
        if self._stopping:
            return
        if wake_ns is not None and self._may_go_on(wake_ns):
            self._charge()
            self._move_to(wake_ns)
            return
        report = {"kind": "idle", "wake_ns": wake_ns, **self.summary()}
        self.running = False
        answer = self._link.ask(report)
        self.resumed_ns = originals.processor_ns()
        self.running = True
        while "match" in answer and self._ledger is not None:
            missing = self._ledger.await_matches(answer["match"], answer["wait_s"])
            self._ledger.await_absence(answer.get("gone", []), answer["wait_s"])
            answer = self._link.ask({"kind": "matched", "missing": missing})
        if answer.get("stop"):
            self._stopping = True
            self._end_ns = self.clock.now_ns + STOPPING_NS
            os.kill(os.getpid(), signal.SIGINT)
            return
        self._move_to(answer["now_ns"])
        self._free_until_ns = answer["free_until_ns"]
        if self._ledger is not None and answer.get("arrivals"):
            self._ledger.expect(answer["arrivals"])
        if answer.get("interrupt"):
            self._interrupt()

    def _interrupt(self) -> None:
        """Get the stop signal as from Ctrl-C, while time stays with the grader.

        The program's main thread hears of it here, or where it waits for its turn; rclpy shuts its contexts down in a
        thread of its own, which is waited for: what the program sees must not depend on who is faster.
        """
        try:
            os.kill(os.getpid(), signal.SIGINT)
            originals.sleep(INTERRUPT_S)
        finally:
            if self._ledger is not None:
                self._ledger.await_shutdown()
            self.scheduler.progress()

    def _may_go_on(self, wake_ns: int) -> bool:
        """Return whether time may move on unasked: nothing else happens until then, and nothing is to be told."""
        return (
            self.clock.now_ns < wake_ns < self._free_until_ns
            and not self.unreported
            and self._ledger is not None
            and not self._ledger.changed
            and not self._ledger.sent
        )

    def _move_to(self, now_ns: int) -> None:
        self.clock.move_to(now_ns)
        if self._clocks is not None:
            self._clocks.move()

    def _run_on(self, wake_ns: int | None) -> None:
        """Let time pass after the stop signal, without the grader."""
        originals.sleep(0.001)
        if wake_ns is not None and wake_ns <= self._end_ns:
            self._move_to(wake_ns)
