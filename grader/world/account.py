"""Tells what is known of a stepped run: as a trace, as plain values, and in words when something has not happened."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from grader.runtime.model.quantities import seconds
from grader.runtime.model.trace import AssessedTrace, ClockKind, Delivery, LogRecord, Message
from grader.world import telling
from grader.world.errors import NoMessage, StepTimeout
from grader.world.observed import Observed
from grader.world.offering import Offers
from grader.world.running import RunningPrograms
from grader.world.started import Program
from grader.world.timeline import Timeline


class RunAccount:
    """What can be told of a run, to the author of its programs: neither they nor the test are taken to be wrong.

    Args:
        scenario: The name of the run.
        timeline: Its time.
        observed: What was observed in it.
        programs: The programs.
        offers: What the test does for them.
    """

    def __init__(
        self, scenario: str, timeline: Timeline, observed: Observed, programs: RunningPrograms, offers: Offers
    ) -> None:
        self._scenario = scenario
        self._timeline = timeline
        self._observed = observed
        self._programs = programs
        self._offers = offers

    def trace(self) -> AssessedTrace:
        """Return what was observed so far as a trace."""
        run = self._timeline.run
        return AssessedTrace(
            self._scenario,
            ClockKind.WALL if self._timeline.is_real else ClockKind.VIRTUAL,
            stop_ns=run.now_ns + 1,
            observations=tuple(self._observed.everything),
            clock_reason=run.unsuitable,
            notes=tuple(run.notes),
        )

    def advice(self) -> str:
        """Return one thing to do about messages of the test that do not arrive; empty if nothing is very likely."""
        return telling.advice(self._observed.graph, self._offers.publishers)

    def silence(self, topic: str) -> NoMessage:
        """Return an error that says why no message of a program came on a topic."""
        other = self._offers.others_on(topic)
        return telling.silence(self._observed.graph, topic, self._timeline.now_ns, other)

    def no_server(self, service: str, interface: str) -> str:
        """Return why nobody offers a service of a type."""
        del interface  # it is told where there is a server of another one
        if other := self._offers.others_offering(service):
            return f"no program offers {service}, only {other} does"
        return telling.no_server(self._observed.graph, service)

    def no_action(self, name: str) -> str:
        """Return why nobody offers an action."""
        other = self._offers.others_offering(name)
        what = f"offers the action {name}"
        return f"no program {what}, only {other} does" if other else f"nobody {what}"

    def timeout(self, what: str, since_ns: int, first: Mapping[str, Iterable[str]], hint: str = "") -> StepTimeout:
        """Return the error of a timeout.

        Args:
            what: What did not happen.
            since_ns: From when on it was waited for.
            first: Lines about the cause, below their title.
            hint: One thing to do; empty for the advice about messages that do not arrive.
        """
        sections = {
            **first,
            "meanwhile": [*telling.meanwhile(self._observed.everything, self._programs, since_ns)],
            "does not fit": self._unfit(),
            "waiting": self._waiting(),
        }
        return telling.timeout(what, since_ns, self._timeline.now_ns, sections, hint or self.advice())

    def _unfit(self) -> list[str]:
        graph = self._observed.graph
        return [*telling.unheard(graph, self._offers.publishers), *telling.apart(graph)]

    def _waiting(self) -> list[str]:
        return [*telling.waiting(self._observed.graph, self._offers.publishers, self._offers.services)]

    def situation(self, **given: Any) -> dict[str, Any]:
        """Return what is known of the run so far as plain values; times are in seconds since the run began.

        Args:
            **given: What the run was given, such as its seed.
        """
        logs = [one for one in self._observed.everything if isinstance(one, LogRecord)][-telling.MOST_LINES :]
        return {
            "t_s": seconds(self._timeline.now_ns),
            **given,
            "programs": [_as_plain(program) for program in self._programs],
            "waiting": self._waiting(),
            "does_not_fit": self._unfit(),
            "published": self._published(),
            "logs": [
                {"t_s": seconds(one.t_ns), "program": one.process, "severity": one.severity, "text": one.text}
                for one in logs
            ],
        }

    def _published(self) -> list[dict[str, Any]]:
        """Return who has published how many messages on what topic, and when the last one."""
        published: dict[str, dict[str, Any]] = {}
        for one in self._observed.everything:
            if isinstance(one, (Message, Delivery)):
                by = "program" if isinstance(one, Message) else "test"
                found = published.setdefault(f"{one.topic} {by}", {"topic": one.topic, "type": one.type, "by": by})
                found |= {"messages": found.get("messages", 0) + 1, "last_t_s": seconds(one.t_ns)}
        return [published[key] for key in sorted(published)]


def _as_plain(program: Program) -> dict[str, Any]:
    """Return a program as plain values: whether it runs, and what it failed of."""
    fault, failed = program.fault, None
    if fault is not None:
        place = {"file": str(program.root / fault.file) if fault.file else "", "line": fault.line}
        failed = {"kind": fault.kind.value, "text": fault.text, "t_s": seconds(fault.t_ns), **place}
    return {"name": program.name, "running": program.running, "exit_code": program.exit_code, "failed": failed}
