"""Runs the programs of a test: starts them, knows what became of each, and fails the test when one fails."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import Fault, FaultKind, LogRecord, Observation, OutputLine
from grader.runtime.model.wording import unused_name
from grader.runtime.plan import Plan, PlannedStart
from grader.runtime.steps import Command, Interrupt, Kill, LaunchFailedError, StartProcesses
from grader.world import telling
from grader.world.errors import ProgramFailed
from grader.world.observed import Observed, compiled_match
from grader.world.programs import Found, Runnable
from grader.world.started import Program
from grader.world.timeline import Timeline

#: What fails a test. A program that ends by itself does not: the test can look at its exit code.
FAILING = (FaultKind.SYNTAX_ERROR, FaultKind.EXCEPTION, FaultKind.HUNG, FaultKind.KILLED)


class ProgramSource(Protocol):
    """Where the programs of a test come from."""

    @property
    def provided(self) -> tuple[tuple[str, str], ...]:
        """Name and text of files that a launch file may need, beside those that lie around it."""

    def find(self, program: Runnable) -> Found:
        """Find a program; raises SubmissionError if there is none."""

    def find_launch(self, file: str | Path) -> tuple[Found, tuple[tuple[str, str], ...]]:
        """Find a launch file, and return it with the name of each program that it may start, by the program's file."""

    def complete(self, plan: Plan, found: Found) -> Plan:
        """Return the plan of one start with what depends on where the program lies, and with the seed of its host."""

    def failure(self, file: str | Path, error: LaunchFailedError) -> Exception:
        """Return what a launch file that has raised an exception means for the test."""


@dataclass(frozen=True, slots=True)
class Launched:
    """What was started of a launch file."""

    programs: list[Program]
    left_out: list[str]  # sentences about what was not started, such as programs that are not written in Python


@dataclass(frozen=True, slots=True)
class ProgramStart:
    """What a program is started as: what `restart` needs, and what is told if it changes nothing."""

    found: Found
    start: PlannedStart
    env: Mapping[str, str]
    parameters: tuple[str, ...]
    remappings: Mapping[str, str]


class Failure:
    """What `expects_failure` waits for.

    Attributes:
        program: The program that failed; None until one has.
        fault: What happened to it; None until it has.
    """

    def __init__(self) -> None:
        self.program: Program | None = None
        self.fault: Fault | None = None

    @property
    def text(self) -> str:
        """What it failed of, such as `ValueError: too fast`; empty until it has."""
        return "" if self.fault is None else self.fault.text


class RunningPrograms:
    """The programs of a run, in the order in which they were started.

    Args:
        timeline: Of the run.
        observed: What is observed in it.
        source: Where they come from.
        plan: Of the run.

    Attributes:
        left_out: Sentences about what launch files describe and was not started, in the order in which they were told.
    """

    def __init__(self, timeline: Timeline, observed: Observed, source: ProgramSource, plan: Plan) -> None:
        self._timeline = timeline
        self._observed = observed
        self._source = source
        self._plan = plan
        self._programs: dict[str, Program] = {}
        self._started_as: dict[str, ProgramStart] = {}
        self._given: list[telling.Given] = []
        self._expected: list[Failure] = []
        self._failing: list[tuple[Program, Fault]] = []
        self.left_out: list[str] = []
        timeline.join(self)

    def __iter__(self) -> Iterator[Program]:
        """Return every program that was started."""
        return iter([*self._programs.values()])

    def find(self, program: Runnable) -> Found:
        """Find a program; raises SubmissionError if there is none."""
        return self._source.find(program)

    def start(self, one: ProgramStart) -> Program:
        """Start a program, under a name that none has; raises ProgramFailed if it fails at once."""
        __tracebackhide__ = True
        found, label = one.found, unused_name(one.found.name, self._programs)
        self._programs[label] = started = self._program(label, found.root)
        self._started_as[label] = one
        before = {*self._observed.graph.nodes}
        self._perform(found, replace(one.start, process=label), one.env)
        nodes = frozenset({*self._observed.graph.nodes} - before)
        self._given.append(telling.Given(started, one.parameters, one.remappings, nodes))
        return started

    def restart(self, program: Program) -> Program:
        """Start a program again that has ended, as it was started."""
        __tracebackhide__ = True
        return self.start(self._started_as[program.name])

    def can_restart(self, program: Program) -> bool:
        """Return whether it is known how a program was started; that is not known of those of a launch file."""
        return program.name in self._started_as

    def launch(self, file: str | Path, arguments: Mapping[str, Any]) -> Launched:
        """Start what a launch file describes; see `World.launch`."""
        __tracebackhide__ = True
        found, known = self._source.find_launch(file)
        given = tuple((name, str(value)) for name, value in arguments.items())
        start = PlannedStart(found.name, launch_arguments=given, known=known, provided=self._source.provided)
        before = {*self._observed.graph.nodes}
        try:
            told = self._perform(found, start, {})
        except LaunchFailedError as error:
            raise self._source.failure(file, error) from None
        self.left_out += told["left_out"]
        nodes = frozenset({*self._observed.graph.nodes} - before)
        for name, parameters, remappings in told["given"]:
            self._given.append(telling.Given(self._programs[name], parameters, dict(remappings), nodes))
        return Launched([self._programs[name] for name in told["started"]], told["left_out"])

    def _perform(self, found: Found, start: PlannedStart, env: Mapping[str, str]) -> dict[str, Any]:
        __tracebackhide__ = True
        plan = replace(
            self._plan,
            processes=((start.process, found.file),),
            starts=(start,),
            environment=tuple((name, str(value)) for name, value in env.items()),
        )
        command = StartProcesses(self._source.complete(plan, found), settle=not self._plan.drawn_order)
        return self._timeline.perform(command)

    def _program(self, name: str, root: Path) -> Program:
        return Program(name, root, self._signal, self._timeline.catch_up)

    def _signal(self, program: Program, how: str) -> None:
        __tracebackhide__ = True
        self._timeline.perform(Interrupt(program.name) if how == "interrupt" else Kill(program.name))

    def note(self, command: Command | None, told: Mapping[str, Any], observations: Sequence[Observation]) -> None:
        """Tell each program what it has logged and written, how it failed, and how it ended."""
        if isinstance(command, StartProcesses):
            for name in told["started"]:
                self._programs.setdefault(name, self._program(name, Path(command.plan.root)))
        for name, root in told.get("begun", {}).items():  # by a launch file, at its start or later
            if name not in self._programs:
                self._programs[name] = self._program(name, Path(root))
        for one in observations:
            if isinstance(one, (LogRecord, OutputLine, Fault)) and one.process in self._programs:
                program = self._programs[one.process]
                program._note(one)  # noqa: SLF001 - a program is told by this object alone
                if isinstance(one, Fault) and one.kind in FAILING:
                    self._failing.append((program, one))
        for name, code in self._timeline.run.ended.items():
            if name in self._programs:
                self._programs[name]._end(code)  # noqa: SLF001 - the same

    def complain(self) -> None:
        """Raise ProgramFailed if a program has failed, unless the test expects it."""
        __tracebackhide__ = True
        failing, self._failing = self._failing, []
        for program, fault in failing:
            if not self._expected:
                raise ProgramFailed(telling.failure(program, fault), fault)
            innermost = self._expected[-1]
            if innermost.program is None:
                innermost.program, innermost.fault = program, fault

    @contextmanager
    def expects_failure(self, match: str) -> Iterator[Failure]:
        """Expect that a program fails in this block; see `World.expects_failure`."""
        __tracebackhide__ = True
        failure = Failure()
        compiled_match(match)  # a mistake in it is told before anything happens
        self._expected.append(failure)
        try:
            yield failure
            self._timeline.catch_up()  # what was started last comes up in this block
        finally:
            self._expected.remove(failure)
        if failure.fault is None:
            raise AssertionError("expected that a program fails, but none did")
        if match and failure.fault.said(match) is None:
            raise AssertionError(f"expected a failure that matches {match!r}, found {failure.text}")

    def remarks(self) -> list[str]:
        """Return sentences about what the test has asked for in vain: parts of launch files, parameters, remappings."""
        vain = (text for one in self._given for text in telling.in_vain(one, self._observed.everything))
        return [*self.left_out, *vain]
