"""Checks on how a process ends: not before it is stopped, and tidily when it is."""

from __future__ import annotations

from dataclasses import dataclass

from grader.core.errors import HarnessError
from grader.core.exercise import Finding
from grader.core.quantities import NS_PER_S, DurationNs, seconds
from grader.core.trace import FaultKind, Trace
from grader.judging.findings import met, not_met
from grader.judging.services import LATENESS_NS
from grader.judging.silence import fault_hint, faults_before_stop, first_fault
from grader.judging.wording import counted, fault_sentence, moment, number, span

_SHUTDOWN_HINT = "end on Ctrl-C: except KeyboardInterrupt: pass, then destroy the node and rclpy.try_shutdown()"


@dataclass(frozen=True, slots=True)
class NoFault:
    """A process, or every one, lives through the recording: no exception, no early end, no hanging.

    What happens after the stop signal is not asked about.

    Attributes:
        process: File name of the student process; all of them if left out.
    """

    process: str | None = None

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        return f"{self.process or 'every process'} runs to the end without an exception"

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if there is no fault; the reason names the first."""
        faults = faults_before_stop(trace, self.process)
        if not faults:
            return met(f"{self.process or 'every process'}: no fault in {span(trace.stop_ns)}", {"faults": 0})
        first = first_fault(trace, self.process) or faults[0]
        reason = f"{moment(first.t_ns)}: {fault_sentence(first)}"
        more = f"; {counted(len(faults), 'fault')} in all" if len(faults) > 1 else ""
        return not_met(reason + more, {"faults": len(faults)}, hint=fault_hint(first), fault=first)


@dataclass(frozen=True, slots=True)
class CleanShutdown:
    """A process that is stopped with Ctrl-C (SIGINT) ends soon: with code 0 or by that very signal, by no other error.

    The scenario has to stop it: `shutdown` in the rubric.

    Attributes:
        process: File name of the student process.
        within: How long it may take.
    """

    process: str
    within: DurationNs = 2 * NS_PER_S

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        return f"{self.process} ends within {number(seconds(self.within))} s of Ctrl-C, without another exception"

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if it ended in time; the reason says what happened instead."""
        signals = trace.marks("stop_signal", self.process)
        faults = trace.faults(self.process)
        if not signals:
            if faults:
                first = min(faults, key=lambda f: f.t_ns)
                reason = f"{fault_sentence(first)}; it could not be stopped any more"
                return not_met(reason, hint=fault_hint(first), fault=first)
            ended = trace.marks("exited", self.process)
            if ended:
                return not_met(f"{self.process} ended by itself at {moment(ended[0].t_ns)}, before it was stopped")
            raise HarnessError(f"{self.process}: the scenario has no `shutdown`, so nobody stopped it")
        asked_ns = signals[0].t_ns
        stopped = [m for m in trace.marks("stopped", self.process) if m.t_ns >= asked_ns]
        after = [f for f in faults if f.t_ns >= asked_ns]
        if stopped and not after:
            took = stopped[0].t_ns - asked_ns
            reason = f"{self.process}: ended {seconds(took):.3f} s after Ctrl-C"
            if took <= self.within + LATENESS_NS[trace.clock]:
                return met(reason, {"took_s": seconds(took)})
            return not_met(f"{reason}, expected within {number(seconds(self.within))} s", {"took_s": seconds(took)})
        if after:
            reason = f"{moment(after[0].t_ns)}, after Ctrl-C: {fault_sentence(after[0])}"
            hint = "" if after[0].kind is FaultKind.EXCEPTION else _SHUTDOWN_HINT
            return not_met(reason, hint=hint, fault=after[0])
        reason = f"{self.process}: still running {span(self.within)} after Ctrl-C at {moment(asked_ns)}"
        return not_met(reason, {"asked_s": seconds(asked_ns)}, hint=_SHUTDOWN_HINT)
