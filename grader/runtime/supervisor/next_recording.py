"""Decides what to record next of a scenario: a pure function of what was recorded of it so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import AssessedTrace
from grader.runtime.plan import Plan
from grader.runtime.supervisor.pace import keeps_pace, slower_share

#: The values of `--clock`: `auto` is virtual time, with the wall clock where virtual time is unsuitable.
VIRTUAL, WALL, AUTO = "virtual", "wall", "auto"
#: The reason for the wall clock where a node is slower than it seems in virtual time.
DRIFTS = "the node pauses after its work, so that virtual time would hide how slow it is"
#: What readers see where the machine was too busy to find out on the wall clock.
CHARGED_NOTE = "the machine was too busy for the wall clock: the measured time of the nodes' work was counted instead"
#: The same work takes longer on a busy machine: two threads that share a core get about half of it each, and so do two
#: virtual machines; caches are shared too. What a node sends if only this share counts, it may send on an idle machine.
SURE_SHARE = 0.5
#: How often the work of such a node is counted at most: the fastest is right.
COUNTED_TIMES = 3
#: Why the recording is not judged if a node sends something only where a share of its work counts.
UNCLEAR = "the machine was too busy to tell whether the nodes are fast enough"
#: Nodes that waited for a processor for more than this share of the time are slower than on an idle machine, on which
#: they wait for less than 1 %.
HELD_UP_SHARE = 0.03


@dataclass(frozen=True, slots=True)
class NextRecording:
    """A recording to make.

    Attributes:
        clock: `virtual` or `wall`.
        charged: The share of the nodes' work for which time passes in virtual time; 0 if none passes.
        may_stop: Whether it may end as soon as virtual time is known to be unsuitable.
    """

    clock: str = VIRTUAL
    charged: float = 0.0
    may_stop: bool = False

    @property
    def title(self) -> str:
        """What follows the title of the scenario while it is made."""
        return ", on the wall clock" if self.clock == WALL else ", with the time of its work" if self.charged else ""

    def planned(self, plan: Plan) -> Plan:
        """Return the plan for it."""
        return replace(plan, clock=self.clock, charged=self.charged, stop_when_unfit=self.may_stop)


#: With the time of all work, and of what is surely work on an idle machine too.
COUNTED, SURELY_COUNTED = NextRecording(charged=1.0, may_stop=True), NextRecording(charged=SURE_SHARE)
#: What was recorded of a scenario so far, in order.
Made = Sequence[tuple[NextRecording, AssessedTrace]]


def next_recording(  # noqa: PLR0911  one for each row of the table
    made: Made, clock: str, *, on_wall: bool = True
) -> NextRecording | AssessedTrace:
    """Return the recording to make next, or the trace that counts.

    | recorded so far | next |
    |---|---|
    | nothing | the scenario, on the clock that was asked for |
    | virtual time, and another clock was not to be chosen, or it suits the nodes | that trace |
    | virtual time, which does not suit them | the wall clock |
    | virtual time, in which work may slow a node down | the same, with the time of the work |
    | with it, and they keep their pace | the trace without it: its times are those of a machine that is fast enough |
    | with it, and they do not | the wall clock |
    | the wall clock | that trace, unless work was the reason and the machine was busy |
    | the wall clock of a busy machine | with the time of the work, up to `COUNTED_TIMES`; see `_counted` |

    Args:
        made: What was recorded so far.
        clock: `virtual`, `wall` or `auto`.
        on_wall: Whether to record on the wall clock at all. If not, what would be recorded there is the trace in
            virtual time, with the reason.
    """
    if not made:
        return NextRecording(WALL if clock == WALL else VIRTUAL, may_stop=clock == AUTO)
    plain = made[0][1]
    # A failure of the grader's own code is not one of virtual time, unless it makes that unsuitable.
    if clock != AUTO or plain.harness_problem not in ("", plain.clock_reason):
        return plain
    counted = [trace for wanted, trace in made if wanted == COUNTED]
    if not plain.clock_reason:
        if not plain.may_drift or plain.harness_problem:
            return plain
        if not counted:
            return COUNTED
        if keeps_pace(plain, counted[0]):
            return plain
    reason = plain.clock_reason or DRIFTS
    if not on_wall:
        return replace(plain, clock_reason=reason)
    wall = next((replace(trace, clock_reason=reason) for wanted, trace in made if wanted.clock == WALL), None)
    if wall is None:
        return NextRecording(WALL)
    # Only where work was the reason: a program that waits for something outside needs the wall clock.
    if not plain.may_drift or not _was_held_up(wall):
        return wall
    surely = next((trace for wanted, trace in made if wanted == SURELY_COUNTED), None)
    return _counted(plain, wall, counted, surely)


def _counted(  # noqa: PLR0911  as above
    plain: AssessedTrace, wall: AssessedTrace, counted: Sequence[AssessedTrace], surely: AssessedTrace | None
) -> NextRecording | AssessedTrace:
    """Return the same where the machine is too busy for the wall clock: a trace that counts the time of the work.

    A node that keeps its pace once is fast enough, because a busy machine makes work slower and never faster. One that
    does not keep it with `SURE_SHARE` of its work either is too slow anywhere. How much faster an idle machine may be
    is then told as time that was waited, so that no point is lost for what this may explain.

    Args:
        plain: The recording in virtual time.
        wall: The one on the wall clock.
        counted: Those with the time of the work.
        surely: The one with a share of it.
    """
    if not counted:
        return COUNTED
    last = counted[-1]
    if last.clock_reason or last.harness_problem:
        return wall
    if keeps_pace(plain, last):
        return _noted(last)
    if surely is None:
        return SURELY_COUNTED
    is_sure = not surely.harness_problem and not keeps_pace(plain, surely)
    if not is_sure and len(counted) < COUNTED_TIMES:
        return COUNTED
    fastest = min(counted, key=lambda trace: slower_share(plain, trace))
    slower = 1.0 if surely.harness_problem else slower_share(surely, fastest)
    if slower == 1:
        return replace(wall, harness_problem=wall.harness_problem or UNCLEAR)
    slower_ns = round(slower * fastest.stop_ns)
    return replace(_noted(fastest), most_starved_ns=slower_ns, all_starved_ns=slower_ns)


def _noted(counted: AssessedTrace) -> AssessedTrace:
    return replace(counted, notes=(*counted.notes, CHARGED_NOTE))


def _was_held_up(trace: AssessedTrace) -> bool:
    """Return whether a recording on the wall clock shows how busy the machine was, more than how fast the nodes are."""
    return bool(trace.harness_problem) or trace.most_starved_ns > HELD_UP_SHARE * trace.stop_ns
