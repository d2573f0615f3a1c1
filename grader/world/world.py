"""The world of a stepped test: programs run in it, and time passes in it only when the test says so."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import wraps
from pathlib import Path
from random import Random
from typing import Any, ParamSpec, TypeVar

from grader.grading.model.wording import first_few, nearest
from grader.runtime.message_classes import built, plain_fields, wanted_class
from grader.runtime.model.author_files import AuthorMistake
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import GraderError, HarnessError, RecordingError
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import GIB, MIB, NS_PER_S, seconds
from grader.runtime.model.step_event import ProgramStep, StepEvent
from grader.runtime.model.trace import (
    AssessedTrace,
    ClockKind,
    Delivery,
    Endpoint,
    Fault,
    FaultKind,
    GraphSnapshot,
    LogRecord,
    Message,
    Observation,
    Offer,
    OutputLine,
    Response,
)
from grader.runtime.model.wording import printable
from grader.runtime.plan import Plan, PlannedStart, derive, ros_arguments
from grader.runtime.programs.executables import package_of
from grader.runtime.serialization import (
    QoSProfile,
    bytes_of,
    message_type_name,
    parameter_message,
    qos_words,
    read_message,
    serialized,
    service_type,
    type_of_part,
)
from grader.runtime.served_actions import TOPICS_OF_ACTIONS, ServedAction
from grader.runtime.session import RecordingSession, SteppedRun
from grader.runtime.simulation import SIMULATIONS, Moment, Simulation, WallMap, types_heard
from grader.runtime.simulation.loading import SimulationError, begin_of, guarded, made_simulation
from grader.runtime.steps import (
    Advance,
    CallService,
    Command,
    Interrupt,
    Kill,
    Publish,
    ReadSteps,
    SendGoal,
    Serve,
    ServeAction,
    Simulate,
    StartProcesses,
)
from grader.runtime.stimuli import PlannedGoal
from grader.world import telling
from grader.world.asking import GoalHandle, GoalResult, PendingCall, Received
from grader.world.errors import NoMessage, ParameterRejected, ProgramFailed, RecordingDiffers, StepTimeout, WrongType
from grader.world.faults import ALL, RunDraws, faults_of_run
from grader.world.frames import TRANSFORMS, FrameTransform, last_links, transform_between
from grader.world.golden import KeptMessage, difference_from_kept, kept_lines, read_kept
from grader.world.interfaces import let_import, modules_for
from grader.world.names import absolute_name
from grader.world.programs import (
    Found,
    Messages,
    Parameters,
    Program,
    Runnable,
    find_launch_file,
    find_program,
    given_parameters,
    parameter_values,
)

Value = TypeVar("Value")
Given = ParamSpec("Given")

#: How much the programs of a test may use, and how much of it is kept: they are trusted, so these are only to end what
#: runs away. Images of some megabytes have to fit.
OWN_LIMITS = Limits(
    memory_bytes=16 * GIB,
    processor_ns=3600 * NS_PER_S,
    processes=4096,
    output_bytes=64 * MIB,
    lines=1_000_000,
    open_files=4096,
    file_bytes=64 * GIB,
    scratch_bytes=64 * GIB,
    wall_ns=24 * 3600 * NS_PER_S,
    messages=1_000_000,
    message_bytes=64 * MIB,
    traffic_bytes=1 * GIB,
    participants=200,
)
#: How long `settle` waits on the wall clock: a reaction takes some milliseconds, tens of them on a busy machine.
REAL_SETTLE_S = 0.1
#: Topics that every node has, which a recording is played without.
EVERYWHERE = ("/rosout", "/parameter_events")
#: What fails a test. A program that ends by itself does not: the test can look at its exit code.
FAILING = (FaultKind.SYNTAX_ERROR, FaultKind.EXCEPTION, FaultKind.HUNG, FaultKind.KILLED)


def _with_hint(method: Callable[Given, Value]) -> Callable[Given, Value]:
    """Let the errors of a method show their hint, and the line of the test in place of those of the grader."""

    @wraps(method)
    def called(*args: Given.args, **kwargs: Given.kwargs) -> Value:
        __tracebackhide__ = True
        try:
            return method(*args, **kwargs)
        except GraderError as error:
            if error.hint:
                error.add_note(f"hint: {error.hint}")
            raise error.with_traceback(None) from None

    return called


@dataclass(frozen=True, slots=True)
class Launched:
    """What was started of a launch file."""

    programs: list[Program]
    left_out: list[str]  # sentences about what was not started, such as programs that are not written in Python


@dataclass(frozen=True, slots=True)
class _Started:
    """What a program was started as: what `restart` needs, and what is told if it changes nothing."""

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


class World:
    """Runs programs in virtual time, and lets a test act on them and look at what they do.

    Virtual time stands still between two calls. On the wall clock, the same calls take as long as they say, and the
    programs run on between them. Use `grader.api.open_world` or the fixture `ros`, not the constructor.

    Args:
        session: What the programs run in.
        near: Folders in which programs are looked for.
        clock: `virtual`, or `wall` for real time.
        seed: What everything drawn follows from.
        name: The name of the test in its recording.
        drawn_order: Whether the seed decides what runs first of all that is ready; on the wall clock, nothing does.
        delay: For topics that the test publishes on, the least and the most seconds that a message is on its way.
        lose: For such topics, the share of messages that are lost.
        between: What is done to programs, and to what they send each other; see `injected`.
        swarm: Whether the seed also draws which of the faults, of `delay`, `lose` and `between`, are on.
        only: What is drawn at all, of all that the seed draws.
        plan: Limits, clock and folder of the programs; None for programs of one's own, which run where they lie.
        measured: How coverage.py measures the lines of programs of one's own; empty if nobody measures them.
        debugger: Where a debugger of such programs is; empty without one.

    Attributes:
        session: What the programs run in.
        left_out: Sentences about what launch files describe and was not started, in the order in which they were told.
        faults: The names of the faults that are on in this run, such as `delay /scan`.
        updates_recordings: Whether `record` writes what it would compare.
    """

    def __init__(  # noqa: PLR0913 - the options of the marker
        self,
        session: RecordingSession,
        near: Sequence[Path],
        *,
        clock: str = ClockKind.VIRTUAL.value,
        seed: int = 0,
        name: str = "test",
        drawn_order: bool = False,
        delay: Mapping[str, tuple[float, float]] | None = None,
        lose: Mapping[str, float] | None = None,
        between: Mapping[str, Mapping[str, Any]] | None = None,
        swarm: bool = False,
        only: RunDraws = ALL,
        plan: Plan | None = None,
        measured: str = "",
        debugger: str = "",
    ) -> None:
        self.session = session
        self._clock = clock_named(clock)
        self._is_real = self._clock is ClockKind.WALL
        self._near = tuple(near)
        self._seed = seed
        plan = plan or Plan(
            scenario=name,
            processes=(),
            root="/",
            host_seed=derive(seed, "world"),
            duration_ns=0,
            first_message_on="",
            wait_at_most_ns=0,
            clock=self._clock.value,
            limits=OWN_LIMITS,
            drawn_order=drawn_order and not self._is_real,
            working=str(Path.cwd()),
            interfaces=_modules_for(self._near[:1]),
            measured=measured,
            debugger=debugger,
        )
        on = faults_of_run(seed, delay=delay, lose=lose, between=between, swarm=swarm, only=only)
        self.faults = on.names
        self._plan = replace(plan, connections=on.connections, faults=on.injected, drawn_steps=only.steps)
        self._observations: list[Observation] = []
        self._messages: dict[str, list[Message]] = {}
        self._read: dict[str, list[Received]] = {}
        self._graph = GraphSnapshot(0, (), ())
        self._programs: dict[str, Program] = {}
        self._functions: dict[str, tuple[Any, Callable[[Any], Any]]] = {}
        self._actions: dict[str, ServedAction] = {}
        self._offers: dict[str, Endpoint] = {}
        self._expected: list[Failure] = []
        self._failing: list[tuple[Program, Fault]] = []
        self._simulations: list[Simulation] = []
        self._authored: list[tuple[str, str]] = []  # name and file of each, if it is one of a rubric's own
        self._outputs: list[Mapping[str, str]] = []  # the topics of each, with their types
        self._fits = True  # whether nothing has changed since it was looked at whether types and QoS fit
        self._mismatches: set[str] = set()
        self.left_out: list[str] = []
        self.updates_recordings = False
        self._given: list[telling.Given] = []
        self._started_as: dict[str, _Started] = {}
        self._goals = 0
        self._random: Random | None = None
        self._starting = self._judging = False
        self._notes: list[str] = []
        self._unsuitable = ""
        self._run = SteppedRun(session.recorder, self._plan, self._answered)

    # ------------------------------------------------------------- programs

    @_with_hint
    def run(  # noqa: PLR0913 - what a launch file may say of a node
        self,
        program: Runnable,
        *,
        name: str = "",
        namespace: str = "",
        parameters: Parameters | Sequence[Parameters] | None = None,
        remappings: Mapping[str, str] | None = None,
        arguments: Sequence[str] = (),
        env: Mapping[str, str] | None = None,
    ) -> Program:
        """Start a program, which runs until it waits for a message, a timer or a service.

        Where a seed draws the order of programs, those that are started one right after the other start together, with
        whatever the test does next.

        Args:
            program: A Python file, looked for beside the test and in the working directory; `PACKAGE/EXECUTABLE` of a
                package in the same workspace; or `main` of a module, or the function of an entry point.
            name: Name of its node, instead of its own.
            namespace: Namespace of its node.
            parameters: Values of its parameters by name, or a parameter file, looked for like a program; or several of
                these, of which the last one counts most.
            remappings: New names of topics and services by their old ones.
            arguments: Arguments before the ROS arguments.
            env: Further environment variables.

        Raises:
            SubmissionError: There is no such program, or no such parameter file.
            ProgramFailed: It has failed at once.
        """
        __tracebackhide__ = True
        found = self._found(program)
        values, files = given_parameters(parameters, self._near)
        start = PlannedStart(
            found.name,
            executable=found.executable,
            arguments=tuple(map(str, arguments)),
            ros_arguments=ros_arguments(name, namespace, (remappings or {}).items(), parameter_values(values)),
            parameter_files=files,
        )
        return self._started(_Started(found, start, dict(env or {}), tuple(values), dict(remappings or {})))

    def _started(self, one: _Started) -> Program:
        """Start a program that has been found, under a name that none has."""
        __tracebackhide__ = True
        found, label = one.found, self._unused(one.found.name)
        start = replace(one.start, process=label)
        self._programs[label] = started = Program(label, found.root, self._signal, self._catch_up)
        before = {*self._graph.nodes}
        self._started_as[label] = one
        self._perform(StartProcesses(self._plan_of(found, start, one.env), settle=not self._plan.drawn_order))
        nodes = frozenset({*self._graph.nodes} - before)
        self._given.append(telling.Given(started, one.parameters, one.remappings, nodes))
        return started

    def restart(self, program: Program, *, timeout: float = 10.0) -> Program:
        """Stop a program as Ctrl-C does, let time pass until it has ended, and start it again as `run` started it.

        A program that has ended, such as one that was killed, is just started again.

        Args:
            program: The program; one that a launch file started cannot be restarted.
            timeout: Seconds to wait at most until it has ended.

        Returns:
            The new program; the old one keeps its logs, output and exit code.

        Raises:
            StepTimeout: It has not ended in time.
            ProgramFailed: It has failed, or the new one has failed at once.
        """
        __tracebackhide__ = True
        if program.name not in self._started_as:
            raise ValueError(
                f"{program.name}: expected a program that was started with run, found one of a launch file"
            )
        if program.running:
            program.interrupt()
            self.wait_until(lambda: not program.running, timeout)
        return self._started(self._started_as[program.name])

    @_with_hint
    def launch(self, file: str | Path, *, arguments: Mapping[str, Any] | None = None) -> Launched:
        """Start the nodes that a launch file describes.

        Args:
            file: The launch file, looked for like a program, or `PACKAGE/FILE` as for `ros2 launch PACKAGE FILE`.
            arguments: Values of its arguments.

        Raises:
            SubmissionError: There is no such file.
            HarnessError: It raises an exception, or describes nothing that can be started.
        """
        __tracebackhide__ = True
        found, known = self._found_launch_file(file)
        given = tuple((name, str(value)) for name, value in (arguments or {}).items())
        start = PlannedStart(found.name, launch_arguments=given, known=known, provided=self._provided)
        before = {*self._graph.nodes}
        told = self._perform(StartProcesses(self._plan_of(found, start, {}), settle=not self._plan.drawn_order))
        self.left_out += told["left_out"]
        nodes = frozenset({*self._graph.nodes} - before)
        for name, parameters, remappings in told["given"]:
            self._given.append(telling.Given(self._programs[name], parameters, dict(remappings), nodes))
        return Launched([self._programs[name] for name in told["started"]], told["left_out"])

    #: Name and text of files that a launch file may need, beside those that lie around it.
    _provided: tuple[tuple[str, str], ...] = ()

    def _found(self, program: Runnable) -> Found:
        return find_program(program, self._near)

    def _found_launch_file(self, file: str | Path) -> tuple[Found, tuple[tuple[str, str], ...]]:
        return find_launch_file(file, self._near)

    def _plan_of(self, found: Found, start: PlannedStart, env: Mapping[str, str]) -> Plan:
        package = package_of(found.root / Path(found.file).parent) if found.projects else found.root
        installed = self.session.folder / f"installed_{derive(0, str(found.root))[:16]}"
        prefixes, _ = self.session.install_shares(found.root, found.projects, installed)
        return replace(
            self._plan,
            processes=((start.process, found.file),),
            root=str(found.root),
            host_seed=derive(self._seed, "program", start.process),
            starts=(start,),
            projects=found.projects,
            prefixes=prefixes,
            interfaces=tuple(dict.fromkeys((*self._plan.interfaces, *_modules_for((package,))))),
            environment=tuple((name, str(value)) for name, value in env.items()),
        )

    def _unused(self, name: str) -> str:
        number = 1 + sum(known == name or known.startswith(f"{name} (") for known in self._programs)
        return name if number == 1 else f"{name} ({number})"

    def _signal(self, program: Program, how: str) -> None:
        __tracebackhide__ = True
        self._perform(Interrupt(program.name) if how == "interrupt" else Kill(program.name))

    # ------------------------------------------------------------------ time

    @property
    def now(self) -> float:
        """Seconds since the test began: of virtual time, or of real time on the wall clock."""
        __tracebackhide__ = True
        if self._is_real:
            self._catch_up()
        return seconds(self._run.now_ns)

    def advance(self, seconds: float) -> None:
        """Let so many seconds pass, with everything that happens at their end; 0 is as good as `settle`.

        Raises:
            ProgramFailed: A program has failed meanwhile.
        """
        __tracebackhide__ = True
        if seconds < 0:
            raise ValueError(f"expected seconds to advance, found {seconds:g}: time does not go back")
        self._perform(Advance(self._begin_ns() + round(seconds * NS_PER_S)))

    def settle(self) -> None:
        """Let everything happen that happens now, such as the reaction to a message; no virtual time passes.

        On the wall clock nobody knows when a reaction is complete: it waits for a tenth of a second.
        """
        __tracebackhide__ = True
        self.advance(REAL_SETTLE_S if self._is_real else 0.0)

    def _begin_ns(self) -> int:
        """Return the time at which a wait begins."""
        __tracebackhide__ = True
        if self._is_real:
            self._catch_up()
        return self._run.now_ns

    def wait_until(self, condition: Callable[[], Value], timeout: float) -> Value:
        """Let time pass until a condition holds, and return its value.

        It is looked at whenever something was observed. A message that has not arrived makes it false.

        Args:
            condition: Called without arguments.
            timeout: Seconds to wait at most.

        Raises:
            StepTimeout: It does not hold in time; the message says what happened meanwhile.
            ProgramFailed: A program has failed meanwhile.
        """
        __tracebackhide__ = True
        since_ns = self._begin_ns()
        lacking: list[NoMessage] = []

        def holds() -> Value | None:
            lacking.clear()
            try:
                return condition()
            except NoMessage as error:
                lacking.append(error)
                return None

        found = self._until(holds, since_ns + round(timeout * NS_PER_S))
        if found:
            return found
        asked = {"it asks for": [str(error) for error in lacking]}
        raise self._timeout("the condition did not hold", since_ns, asked, *(error.hint for error in lacking))

    def wait_for_log(self, match: str, timeout: float, *, program: Program | None = None) -> LogRecord | OutputLine:
        """Let time pass until a program has logged or written something, and return that; what is there already counts.

        Args:
            match: A regular expression that is found in the text of a log record, or in a line of output.
            timeout: Seconds to wait at most.
            program: Whose text it is; None for any program's.

        Raises:
            StepTimeout: Nothing of that kind came in time.
            ProgramFailed: A program has failed meanwhile.
        """
        __tracebackhide__ = True
        since_ns, pattern, seen = self._begin_ns(), re.compile(match), 0

        def look() -> LogRecord | OutputLine | None:
            nonlocal seen
            new, seen = self._observations[seen:], len(self._observations)
            for one in new:
                if not isinstance(one, (LogRecord, OutputLine)):
                    continue
                if (program is None or one.process == program.name) and pattern.search(one.text):
                    return one
            return None

        found: Any = self._until(look, since_ns + round(timeout * NS_PER_S))
        if isinstance(found, (LogRecord, OutputLine)):
            return found
        who = "no program has" if program is None else f"{program.name} has not"
        raise self._timeout(f"{who} logged or written {match!r}", since_ns, {})

    def _until(self, look: Callable[[], Value | None], deadline_ns: int) -> Value | None:
        """Let time pass until a function returns something true, and return that; what it returns last otherwise."""
        __tracebackhide__ = True
        self._perform(Advance(self._run.now_ns))
        while not (found := self._looked(look)) and self._run.now_ns < deadline_ns:
            self._perform(Advance(deadline_ns, until_news=True))
        return found

    def _looked(self, look: Callable[[], Value]) -> Value:
        """Return what a function returns, all of whose looks show the same moment."""
        __tracebackhide__ = True
        self._judging = True
        try:
            return look()
        finally:
            self._judging = False

    def _timeout(self, what: str, since_ns: int, first: Mapping[str, Iterable[str]], hint: str = "") -> StepTimeout:
        programs = [*self._programs.values()]
        apart = [*telling.unheard(self._graph, self._offers), *telling.apart(self._graph)]
        sections = {
            **first,
            "meanwhile": [*telling.meanwhile(self._observations, programs, since_ns)],
            "does not fit": apart,
            "waiting": [*telling.waiting(self._graph, self._offers, self._functions)],
        }
        return telling.timeout(what, since_ns, self._run.now_ns, sections, hint or self.advice)

    @property
    def advice(self) -> str:
        """What may be meant where a message of the test has no subscription; empty if all have, or nothing is alike."""
        return telling.advice(self._graph, self._offers)

    # --------------------------------------------------------------- acting

    def publish(self, topic: str, message: Any, *, rate: float | None = None, qos: QoSProfile | None = None) -> None:
        """Publish a message now, or from now on with a rate; that replaces what the test published on the topic before.

        The programs react with the next step.

        Args:
            topic: Its name.
            message: The message. With a rate also a list: sent in turn, and the last one is repeated.
            rate: Messages per second; None to publish once.
            qos: Reliability and durability of the publisher; reliable and volatile by default.

        Raises:
            WrongType: A program subscribes to the topic, and no message would ever arrive.
        """
        __tracebackhide__ = True
        topic = absolute_name(topic)
        if rate is not None and rate <= 0:
            raise ValueError(f"{topic}: expected a rate above 0, found {rate:g}; None publishes once")
        several = [*message] if isinstance(message, (list, tuple)) else [message]
        if not several or (rate is None and len(several) > 1):
            raise ValueError(f"{topic}: expected one message without a rate, found {len(several)}")
        packed = [serialized(one, topic) for one in several]
        types = {interface for interface, _ in packed}
        if len(types) > 1:
            raise TypeError(f"{topic}: expected messages of one type, found {', '.join(sorted(types))}")
        period_ns = 0 if rate is None else round(NS_PER_S / rate)
        self._offer(Publish(topic, packed[0][0], tuple(data for _, data in packed), period_ns), qos)

    def _offer(self, command: Publish, qos: QoSProfile | None) -> None:
        __tracebackhide__ = True
        topic, (reliability, durability) = command.topic, qos_words(qos)
        self._offers[topic] = Endpoint("publisher", topic, command.type, "the test", -1, reliability, durability)
        self._fits = False
        best_effort, latched = reliability == "best_effort", durability == "transient_local"
        self._perform(replace(command, best_effort=best_effort, latched=latched))

    @_with_hint
    def play(
        self, bag: str | Path, *, topics: Iterable[str] | None = None, rate: float = 1.0, qos: QoSProfile | None = None
    ) -> float:
        """Publish the messages of a recording from now on, with the times between them that they were recorded with.

        On each topic that replaces what the test published there before. The first message is sent now.

        Args:
            bag: A rosbag2 folder, or a .mcap or .db3 file, looked for like a program.
            topics: The topics to play; None for all of them, without those that every node has, and without what the
                grader adds to a recording of its own.
            rate: How many times as fast as they were recorded.
            qos: Reliability and durability of the publishers; reliable and volatile by default.

        Returns:
            How many seconds it takes until the last message.

        Raises:
            RecordingError: There is no such recording, it cannot be read, or it lacks a topic.
            WrongType: A program subscribes to a topic, and no message would ever arrive.
        """
        __tracebackhide__ = True
        from grader.runtime.recording.bag import read_bag, topics_in  # noqa: PLC0415 - few tests play a recording
        from grader.runtime.recording.recording_file import OWN  # noqa: PLC0415 - the same

        if rate <= 0:
            raise ValueError(f"expected a rate above 0, found {rate:g}")
        path = next((found for folder in self._near if (found := folder / bag).exists()), Path(bag))
        types = topics_in(path)
        recorded = [topic for topic in types if not topic.startswith(OWN) and topic not in EVERYWHERE]
        wanted = recorded if topics is None else [absolute_name(topic) for topic in topics]
        if lacking := [topic for topic in wanted if topic not in types]:
            close = nearest(lacking[0], recorded)
            hint = f"did you mean {close}?" if close else f"it has {first_few(sorted(recorded))}"
            raise RecordingError(f"{bag}: expected the topic {lacking[0]}, found none", hint)
        streams = [read_bag(path, topic, types[topic]) for topic in wanted]
        began_ns = min((one.began_ns for one in streams), default=0)
        last_ns = 0
        for one in streams:
            times_ns = tuple(round((one.began_ns - began_ns + message.t_ns) / rate) for message in one.messages)
            messages = tuple(message.cdr for message in one.messages)
            self._offer(Publish(one.topic, one.type, messages, times_ns=times_ns), qos)
            last_ns = max(last_ns, times_ns[-1])
        return seconds(last_ns)

    def stop_publishing(self, topic: str) -> None:
        """End what the test publishes on a topic; its publisher stays."""
        __tracebackhide__ = True
        topic = absolute_name(topic)
        if topic not in self._offers:
            raise ValueError(f"{topic}: expected a topic that the test publishes on, found none")
        self._perform(Publish(topic, self._offers[topic].type, ()))

    def serve(self, name: str, type: Any, function: Callable[[Any], Any]) -> None:  # noqa: A002 - as in rclpy
        """Offer a service; serving it again replaces the function.

        Args:
            name: Its name.
            type: The class of the service, such as `std_srvs.srv.Trigger`.
            function: Called with each request while virtual time stands still; returns the response. It may look at
                everything, but not let time pass.

        Raises:
            WrongType: A program has a client of another type.
        """
        __tracebackhide__ = True
        name = absolute_name(name)
        interface = message_type_name(type, "srv")
        known = self._functions.get(name)
        if known is not None and message_type_name(known[0]) != interface:
            raise ValueError(
                f"{name}: expected {message_type_name(known[0])}, as it is served already, found {interface}"
            )
        self._functions[name] = (service_type(interface), function)
        self._fits = False
        self._perform(Serve(name, interface))

    def serve_action(
        self,
        name: str,
        type: Any,  # noqa: A002 - as in rclpy
        answer: Callable[[Any], Any] | Sequence[Any],
        *,
        preempts: bool = False,
    ) -> None:
        """Offer an action; serving it again replaces what answers goals from then on.

        Args:
            name: Its name.
            type: The class of the action, such as `test_msgs.action.Fibonacci`.
            answer: What is done with each goal: a list of steps, or a function that is called with the goal while
                virtual time stands still. It returns the result, or is a generator, which goes on beside everything
                else. A step, or what a generator yields, is a number of seconds to let pass, or a feedback to publish.
                A list may end with the result, as a generator does that returns it; without one, the result has its
                default values. `GoalRejected` before the first pause refuses the goal, `GoalAborted` aborts it, and a
                generator whose goal is cancelled gets `GoalCanceled`: it may return a result. An error ends a list.
            preempts: Whether a goal that is accepted aborts the one before it, as Nav2 does.

        Raises:
            WrongType: A program has a client of another type.
        """
        __tracebackhide__ = True
        name, interface = absolute_name(name), message_type_name(type, "action")
        known = self._actions.get(name)
        if known is not None and known.type != interface:
            raise ValueError(f"{name}: expected {known.type}, as it is served already, found {interface}")
        if known is not None:
            known.answer, known.preempts = answer, preempts
            return
        self._actions[name] = ServedAction(name, interface, answer, preempts=preempts)
        self._fits = False
        self._perform(ServeAction(name, interface))

    def call(self, name: str, request: Any, *, timeout: float = 10.0) -> Any:
        """Call a service, let time pass until the response is there, and return it.

        Args:
            name: Its name.
            request: The request, such as `Trigger.Request()`.
            timeout: Seconds to wait at most, for the server and the response together.

        Raises:
            WrongType: The server is of another type.
            StepTimeout: There was no response in time; the message says whether there is a server.
        """
        __tracebackhide__ = True
        return self.call_async(name, request).wait(timeout)

    def call_async(self, name: str, request: Any) -> PendingCall:
        """Call a service, and return at once; the request is sent with the next step, when its server is there.

        Args:
            name: Its name.
            request: The request, such as `Trigger.Request()`.

        Returns:
            The call, which has the response once that is there.

        Raises:
            WrongType: The server is of another type.
        """
        __tracebackhide__ = True
        name = absolute_name(name)
        interface, kind = type_of_part(request, "Request", name)
        self._refuse_other_server(name, interface, name)
        since_ns, seen = self._begin_ns(), len(self._observations)
        told = self._perform(CallService(name, interface, plain_fields(request)))

        def look() -> Any:
            found = self._response(seen, name, told["client"])
            return None if found is None else built(kind.Response, found.value, name)

        def wait(timeout: float) -> Any:
            __tracebackhide__ = True
            found = self._until(look, self._begin_ns() + round(timeout * NS_PER_S))
            if found is not None:
                return found
            servers = telling.service_ends(self._graph, "service")
            offered = any((e.service, e.type) == (name, interface) for e in servers)
            why = f"{name} has a server, which has not answered" if offered else self._no_server(name, interface)
            raise self._timeout(f"{name} did not answer", since_ns, {"the service": [why]})

        return PendingCall(name, self._caught_up(look), wait)

    def _caught_up(self, look: Callable[[], Value]) -> Callable[[], Value]:
        """Return a function that looks at what has happened until now."""

        def looked() -> Value:
            __tracebackhide__ = True
            self._catch_up()
            return look()

        return looked

    def send_goal(
        self, name: str, goal: Any, *, cancel_after: float | None = None, timeout: float = 60.0
    ) -> GoalResult:
        """Send a goal to an action, let time pass until its result is there, and return it.

        Args:
            name: Name of the action.
            goal: The goal, such as `Fibonacci.Goal(order=5)`.
            cancel_after: Seconds after its acceptance at which the goal is cancelled; None to let it go on.
            timeout: Seconds to wait at most.

        Raises:
            WrongType: The action is of another type.
            StepTimeout: There was no result in time.
        """
        __tracebackhide__ = True
        return self._goal(name, goal, cancel_after).wait(timeout)

    def send_goal_async(self, name: str, goal: Any) -> GoalHandle:
        """Send a goal to an action, and return at once; it is sent with the next step, when its server is there.

        Args:
            name: Name of the action.
            goal: The goal, such as `Fibonacci.Goal(order=5)`.

        Returns:
            Its handle, with which it can be looked at, waited for and cancelled.

        Raises:
            WrongType: The action is of another type.
        """
        __tracebackhide__ = True
        return self._goal(name, goal, None)

    def _goal(self, name: str, goal: Any, cancel_after: float | None) -> GoalHandle:
        __tracebackhide__ = True
        name = absolute_name(name)
        interface, kind = type_of_part(goal, "Goal", name)
        self._refuse_other_server(f"{name}/_action/send_goal", f"{interface}_SendGoal", name)
        self._goals += 1
        uuid = tuple(bytes.fromhex(derive(self._seed, "goal", str(self._goals))[:32]))
        after_ns = 0 if cancel_after is None else max(1, round(cancel_after * NS_PER_S))
        since_ns, seen = self._begin_ns(), len(self._observations)
        told = self._perform(SendGoal(PlannedGoal(name, interface, since_ns, after_ns, plain_fields(goal), uuid)))
        sent, asked = told["clients"][:2]

        def feedback() -> list[Received]:
            got = self.received(f"{name}/_action/feedback")
            return [Received(one.t, one.message.feedback) for one in got if tuple(one.message.goal_id.uuid) == uuid]

        def look() -> tuple[bool | None, GoalResult | None]:
            accepted = self._response(seen, f"{name}/_action/send_goal", sent)
            if accepted is None:
                return None, None
            if not accepted.value["accepted"]:
                return False, GoalResult(accepted=False, status=0, result=None, feedback=[])
            result = self._response(seen, f"{name}/_action/get_result", asked)
            if result is None:
                return True, None
            ending = built(kind.Result, result.value["result"], name)
            return True, GoalResult(accepted=True, status=result.value["status"], result=ending, feedback=feedback())

        def wait(timeout: float) -> GoalResult:
            __tracebackhide__ = True
            found = self._until(lambda: look()[1], self._begin_ns() + round(timeout * NS_PER_S))
            if found is not None:
                return found
            why = "it has accepted the goal" if look()[0] else "it has not answered the goal"
            servers = [one.service for one in telling.service_ends(self._graph, "service")]
            offered = f"{name}/_action/send_goal" in (*servers, *(offer.name for offer in self.trace().of(Offer)))
            first = {"the action": [why if offered else f"nobody offers the action {name}"]}
            raise self._timeout(f"{name} gave no result", since_ns, first)

        def cancel() -> None:
            __tracebackhide__ = True
            request = {"goal_info": {"goal_id": {"uuid": list(uuid)}}}
            self._perform(CallService(f"{name}/_action/cancel_goal", "action_msgs/srv/CancelGoal", request))

        return GoalHandle(name, self._caught_up(look), feedback, wait, cancel)

    def _response(self, seen: int, service: str, client: int) -> Response | None:
        """Return the response of a program to a client of the test, among the observations from a number on."""
        found = (o for o in self._observations[seen:] if isinstance(o, Response))
        return next((o for o in found if (o.service, o.sender, o.client) == (service, "student", client)), None)

    def set_parameter(self, node: str, name: str, value: Any, *, timeout: float = 10.0) -> None:
        """Set a parameter of a node while it is running, as `ros2 param set` does.

        Args:
            node: Full name of the node.
            name: Name of the parameter.
            value: Its value.
            timeout: Seconds to wait at most.

        Raises:
            ParameterRejected: The node does not accept the value, or has not declared the parameter.
            StepTimeout: There is no such node, or it does not answer.
        """
        __tracebackhide__ = True
        kind = service_type("rcl_interfaces/srv/SetParameters")
        request = kind.Request(parameters=[parameter_message(name, value)])
        result = self.call(f"{absolute_name(node)}/set_parameters", request, timeout=timeout).results[0]
        if not result.successful:
            raise ParameterRejected(f"{absolute_name(node)}: {name} = {value!r} was not accepted: {result.reason}")

    @_with_hint
    def simulate(self, simulation: Simulation | str, **parameters: Any) -> Simulation:
        """Let a simulation take part from now on; its methods run in the test's process, while time stands still.

        Args:
            simulation: An object of a class that derives from `grader.api.Simulation`, or the name of a built-in one;
                in the tests of a rubric also that of one of its own, from the files under `simulations`.
            **parameters: Of one that is named.

        Returns:
            The simulation, whose state the test may look at.

        Raises:
            WrongType: A program uses one of its topics or services with another type.
            ValueError: No simulation has this name, or it does not take the parameters.
        """
        __tracebackhide__ = True
        name, path, content = "", "", b""
        if isinstance(simulation, str):
            name, (path, content) = simulation, self._simulations_by_name().get(simulation, ("", b""))
            simulation = self._made(name, path, content, parameters)
        number = len(self._simulations)
        self._simulations.append(simulation)
        self._authored.append((name, path))
        draw = Random(derive(self._seed, "simulation", str(number)))  # noqa: S311 - it has to repeat
        self._asked(number, "begin", draw)
        publishes, serves, records = (dict(self._asked(number, key)) for key in ("publishes", "serves", "records"))
        hears = types_heard(self._asked(number, "hears"))
        self._outputs.append({**publishes, **records})
        self._fits = False
        self._perform(Simulate(number, simulation.period, publishes, hears, serves, records))
        return simulation

    def _simulations_by_name(self) -> Mapping[str, tuple[str, bytes]]:
        """Return file and text of each simulation of a rubric's own."""
        return {}

    def _maps(self) -> Mapping[str, WallMap]:
        """Return the maps of a rubric, by name."""
        return {}

    def _made(self, name: str, path: str, content: bytes, parameters: Mapping[str, Any]) -> Simulation:
        """Make a simulation by its name; raises ValueError for what the test asks wrongly."""
        known = {**dict.fromkeys(SIMULATIONS), **dict.fromkeys(self._simulations_by_name())}
        if name not in known:
            raise ValueError(f"simulate: expected one of {first_few(list(known), 20)}, found {name!r}")
        try:
            return made_simulation(name, path, content, parameters, self._maps())
        except SimulationError as error:
            if isinstance(error.__cause__, TypeError) and "__init__()" in str(error.__cause__):
                raise ValueError(f"simulate: {name}: {error.__cause__}") from None  # it does not take what is given
            raise
        except HarnessError as error:
            raise ValueError(f"simulate: {error.message}") from None

    def _asked(self, number: int, method: str, *arguments: Any) -> Any:
        """Call a method of a simulation; a mistake in one of a rubric's own raises SimulationError with its place."""
        name, path = self._authored[number]
        simulation = self._simulations[number]

        def work() -> Any:
            answer = getattr(simulation, method)(*arguments)
            return answer if answer is None or isinstance(answer, Mapping) else [*answer]

        return guarded(name, path, work, begin_of(simulation, method, path)) if path else work()

    def _checked(self, number: int, method: str, answer: Any) -> Any:
        """Return what a simulation publishes; raises SimulationError for anything but a message of its topics."""
        simulation, (name, path) = self._simulations[number], self._authored[number]
        types = self._outputs[number] if path and isinstance(answer, list) else {}
        try:
            for output in answer if types else ():
                topic, fields = output
                built(wanted_class(types[topic], "msg", topic), fields, topic)
        except (HarnessError, TypeError, ValueError, KeyError, AttributeError) as error:
            among = f"one of its topics ({', '.join(types)}) with the fields of a message"
            found = (
                error.message if isinstance(error, HarnessError) else f"{printable(str(output), 80)}, expected {among}"
            )
            text = f"the simulation `{name}` failed in {method}(): {found}"
            raise SimulationError(AuthorMistake(path, begin_of(simulation, method, path), text)) from error
        return answer

    # --------------------------------------------------------------- looking

    def received(self, topic: str, type: Any = None) -> list[Received]:  # noqa: A002 - as in rclpy
        """Return the messages that programs have published on a topic so far, with their times.

        Args:
            topic: Its name.
            type: The class that they have to be of; None for any.

        Raises:
            WrongType: A message is of another type.
        """
        __tracebackhide__ = True
        self._catch_up()
        topic = absolute_name(topic)
        known = self._read.setdefault(topic, [])
        found = self._messages.get(topic, ())
        if type is not None:
            expected = message_type_name(type)
            other = next((one.type for one in found if one.type != expected), "")
            if other:
                raise WrongType(f"{topic}: expected messages of type {expected}, found {other}")
        for one in found[len(known) :]:
            known.append(Received(seconds(one.t_ns), self._as_object(one)))
        return Messages(known, lambda: self._silence(topic))

    def messages(self, topic: str, type: Any = None) -> list[Any]:  # noqa: A002 - as in rclpy
        """Return the messages that programs have published on a topic so far.

        Args:
            topic: Its name.
            type: The class that they have to be of; None for any.

        Raises:
            WrongType: A message is of another type.
        """
        __tracebackhide__ = True
        found = self.received(topic, type)
        return Messages([one.message for one in found], lambda: self._silence(absolute_name(topic)))

    def transform(self, target: str, source: str) -> FrameTransform:
        """Return where a frame is in another one now, by the last transforms that programs have published.

        Args:
            target: The frame in which the other one is looked for, such as `map`.
            source: The other frame, such as `base_link`; its origin in `target` is the translation.

        Raises:
            NoTransform: The frames are in no tree together; the message names the link that is missing.
        """
        __tracebackhide__ = True
        sent = sorted((one for topic in TRANSFORMS for one in self.received(topic)), key=lambda one: one.t)
        links = last_links([one.message for one in sent])
        return transform_between(links, target.lstrip("/"), source.lstrip("/"))

    @_with_hint
    def record(
        self,
        file: str | Path,
        *topics: str,
        tolerance: float | Mapping[str, float] = 0.0,
        time_tolerance: float = 0.0,
    ) -> None:
        """Compare what programs have published so far with a recording that the test keeps.

        With `pytest --ros-update` the recording is written, and nothing is compared.

        Args:
            file: The recording, relative to the test; its name ends with `.jsonl`.
            topics: The topics; none for all that programs have published on, but for those that every node has.
            tolerance: What numbers may differ by, in their own units; for all topics or by topic.
            time_tolerance: Seconds by which times may differ. On the wall clock, times are not compared.

        Raises:
            RecordingDiffers: It differs, or there is no such recording.
        """
        __tracebackhide__ = True
        self._catch_up()
        path = self._near[0] / file
        names = [*map(absolute_name, topics)] or sorted(set(self._messages) - set(EVERYWHERE))
        now = [
            KeptMessage(one.t_ns, name, one.type, plain_fields(self._as_object(one)))
            for name in names
            for one in self._messages.get(name, ())
        ]
        if self.updates_recordings:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(kept_lines(now), encoding="utf-8")
            return
        if not path.is_file():
            raise RecordingDiffers(f"{path}: expected a recording, found none; pytest --ros-update writes it")
        kept = [one for one in read_kept(path) if not topics or one.topic in names]
        allowed = (
            dict.fromkeys({one.topic for one in (*kept, *now)}, tolerance)
            if isinstance(tolerance, (int, float))
            else {absolute_name(name): value for name, value in tolerance.items()}
        )
        late_ns = None if self._is_real else round(time_tolerance * NS_PER_S)
        if differs := difference_from_kept(kept, now, allowed, late_ns):
            raise RecordingDiffers(f"{differs}; recorded in {path}, which pytest --ros-update renews")

    def _silence(self, topic: str) -> NoMessage:
        others = {name: "a simulation" for one in self._simulations for name in one.publishes()}
        others |= dict.fromkeys(self._offers, "the test")
        return telling.silence(self._graph, topic, self._run.now_ns, others.get(topic, ""))

    def _no_server(self, service: str, interface: str) -> str:
        """Return why nobody offers a service of a type."""
        del interface  # it is told where there is a server of another one
        return telling.no_server(self._graph, service)

    def _as_object(self, message: Message) -> Any:
        return read_message(message)

    def rate(self, topic: str, *, last: float | None = None) -> float:
        """Return how many messages a second programs publish on a topic, from the first to the last one.

        Args:
            topic: Its name.
            last: Count only the messages of so many last seconds.

        Returns:
            The rate, 0 for fewer than two messages.
        """
        __tracebackhide__ = True
        self._catch_up()
        since_ns = 0 if last is None else self._run.now_ns - round(last * NS_PER_S)
        times = [one.t_ns for one in self._messages.get(absolute_name(topic), ()) if one.t_ns >= since_ns]
        # n - 1 gaps, not n: counting messages overstates a short time
        return (len(times) - 1) * NS_PER_S / (times[-1] - times[0]) if times and times[-1] > times[0] else 0.0

    def nodes(self) -> list[str]:
        """Return the full names of the programs' nodes, sorted."""
        __tracebackhide__ = True
        self._catch_up()
        return sorted(self._graph.nodes)

    def topics(self) -> dict[str, str]:
        """Return the topics that programs publish on or subscribe to, with their types."""
        __tracebackhide__ = True
        self._catch_up()
        return {e.topic: e.type for e in sorted(self._graph.endpoints, key=lambda e: e.topic)}

    def services(self) -> dict[str, str]:
        """Return the services that programs offer, with their types; without those that every node has."""
        __tracebackhide__ = True
        self._catch_up()
        return {e.service: e.type for e in telling.service_ends(self._graph, "service")}

    def graph(self) -> GraphSnapshot:
        """Return nodes, publishers, subscriptions, servers and clients of the programs as they are now."""
        __tracebackhide__ = True
        self._catch_up()
        return self._graph

    @property
    def programs(self) -> list[Program]:
        """Every program that was started."""
        return [*self._programs.values()]

    @contextmanager
    def expects_failure(self, match: str = "") -> Iterator[Failure]:
        """Expect that a program fails in this block: what it raises does not fail the test.

        Args:
            match: A regular expression that is found in the exception, as in `ValueError: too fast`.

        Raises:
            AssertionError: No program has failed, or of something else.
        """
        __tracebackhide__ = True
        failure = Failure()
        self._expected.append(failure)
        try:
            yield failure
            self._catch_up()  # what was started last comes up in this block
        finally:
            self._expected.remove(failure)
        if failure.fault is None:
            raise AssertionError("expected that a program fails, but none did")
        if match and failure.fault.said(match) is None:
            raise AssertionError(f"expected a failure that matches {match!r}, found {failure.text}")

    # ------------------------------------------------------------- recording

    def trace(self) -> AssessedTrace:
        """Return what was observed so far as a trace, as checks of a rubric read it."""
        now_ns = self._run.now_ns + 1
        return AssessedTrace(
            self._plan.scenario,
            self._clock,
            stop_ns=now_ns,
            observations=tuple(self._observations),
            clock_reason=self._unsuitable,
            notes=tuple(self._notes),
        )

    def keep(self, folder: Path | str, why: str = "") -> list[Path]:
        """Write what happened so far into a folder, and return the paths: an MCAP file, and a page that plays the run.

        Args:
            folder: Where; it is created if it is not there.
            why: What the page says above the run.
        """
        from grader.world.keeping import keep  # noqa: PLC0415 - takes long, and most tests pass

        place = Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        return keep(self.session, self.trace(), self._drawn, place, why)

    def situation(self) -> dict[str, Any]:
        """Return what is known of the run so far as plain values, as `failure.json` of a failed test has it.

        Times are in seconds since the test began.
        """
        published: dict[str, dict[str, Any]] = {}
        for one in self._observations:
            if isinstance(one, (Message, Delivery)):
                by = "program" if isinstance(one, Message) else "test"
                found = published.setdefault(f"{one.topic} {by}", {"topic": one.topic, "type": one.type, "by": by})
                found |= {"messages": found.get("messages", 0) + 1, "last_t_s": seconds(one.t_ns)}
        logs = [one for one in self._observations if isinstance(one, LogRecord)][-telling.MOST_LINES :]
        return {
            "t_s": seconds(self._run.now_ns),
            "clock": self._clock.value,
            "seed": self._drawn,
            "faults": list(self.faults),
            "programs": [_as_plain(program) for program in self.programs],
            "waiting": [*telling.waiting(self._graph, self._offers, self._functions)],
            "does_not_fit": [*telling.unheard(self._graph, self._offers), *telling.apart(self._graph)],
            "published": [published[key] for key in sorted(published)],
            "logs": [
                {"t_s": seconds(one.t_ns), "program": one.process, "severity": one.severity, "text": one.text}
                for one in logs
            ],
        }

    def _repr_html_(self) -> str:
        """Return the run so far as a notebook shows it: a page in the page that plays it."""
        from grader.world.keeping import page_of  # noqa: PLC0415 - as above

        page = html.escape(page_of(self.session, self.trace(), self._drawn))
        return f'<iframe sandbox="allow-scripts" style="width:100%;height:60em;border:0" srcdoc="{page}"></iframe>'

    @property
    def _drawn(self) -> int | None:
        return self._seed if self.is_drawn else None

    @property
    def seed(self) -> int:
        """What everything drawn in this run follows from."""
        return self._seed

    @property
    def random(self) -> Random:
        """A source of numbers for the test itself, which follow from the seed: what is drawn once can be repeated."""
        if self._random is None:
            self._random = Random(derive(self._seed, "test"))  # noqa: S311 - it has to repeat
        return self._random

    @property
    def repeats(self) -> bool:
        """Whether the same seed gives the same run; on the wall clock it gives the same delays and losses only."""
        return not self._is_real

    @property
    def is_drawn(self) -> bool:
        """Whether anything in this run was drawn from its seed."""
        return self._plan.drawn_order or bool(self._plan.connections or self._plan.faults)

    def steps(self) -> list[ProgramStep]:
        """Return what each program has done so far, step by step; empty on the wall clock."""
        found = []
        for t_ns, process, name, deviates, events in self._run.perform(ReadSteps())[0]["steps"]:
            done = tuple(StepEvent(node, does, what, tuple(others)) for node, does, what, others in events)
            found.append(ProgramStep(t_ns, process, name, deviates, done))
        return found

    @property
    def remarks(self) -> list[str]:
        """Sentences about what the test has asked for in vain: parts of launch files, parameters and remappings."""
        return [*self.left_out, *(text for one in self._given for text in telling.in_vain(one, self._observations))]

    @property
    def problem(self) -> str:
        """Why what happened may be untrue, once the world is closed; empty if it is not."""
        clock = "the wall clock" if self._is_real else "virtual time"
        return f"{clock} does not suit these programs: {self._unsuitable}" if self._unsuitable else ""

    def finish(self) -> None:
        """Let the programs come up that were started last, so that none fails unnoticed.

        Raises:
            ProgramFailed: One has failed.
        """
        __tracebackhide__ = True
        self._catch_up()

    def close(self) -> None:
        """End all programs, and the run; what was observed can still be looked at."""
        if self._run.is_closed:
            return
        self._adopt(self._run.close())
        self._notes, self._unsuitable = self._run.notes, self._run.unsuitable
        self._failing.clear()

    def _perform(self, command: Command) -> dict[str, Any]:
        """Carry out a command; raises ProgramFailed if a program has failed meanwhile."""
        __tracebackhide__ = True
        if self._run.is_busy:
            raise RuntimeError("a function that answers for the test cannot let time pass or act on the programs")
        if self._starting and not isinstance(command, (StartProcesses, Advance)):
            self._catch_up()
        self._starting = isinstance(command, StartProcesses) and not command.settle
        told, observations = self._run.perform(command)
        if isinstance(command, StartProcesses):
            for name in told["started"]:
                self._programs.setdefault(name, Program(name, Path(command.plan.root), self._signal, self._catch_up))
        for name, root in told.get("begun", {}).items():  # a launch file has started them, and maybe again
            if name not in self._programs:
                self._programs[name] = Program(name, Path(root), self._signal, self._catch_up)
        self._adopt(observations)
        if self._run.full:
            raise GraderError(f"the test was ended: {self._run.full}")
        self._raise_failure()
        self._raise_mismatch()
        return told

    def _catch_up(self) -> None:
        """Learn what has happened since the last command, before the test looks or time passes.

        On the virtual clock, that is the start of the programs that were started last: where a seed draws their order,
        they start together. While a condition is looked at, nothing changes.
        """
        __tracebackhide__ = True
        stands_still = self._run.is_busy or self._run.is_closed or self._judging
        if (self._starting or self._is_real) and not stands_still:
            self._perform(Advance(self._run.now_ns))

    def _adopt(self, observations: Sequence[Observation]) -> None:
        for one in observations:
            self._observations.append(one)
            if isinstance(one, Message):
                self._messages.setdefault(one.topic, []).append(one)
            elif isinstance(one, GraphSnapshot):
                self._graph, self._fits = one, False
            elif isinstance(one, (LogRecord, OutputLine, Fault)) and one.process in self._programs:
                program = self._programs[one.process]
                program._note(one)  # noqa: SLF001 - a program is told by its world alone
                if isinstance(one, Fault) and one.kind in FAILING:
                    self._failing.append((program, one))
        for name, code in self._run.ended.items():
            if name in self._programs:
                self._programs[name]._end(code)  # noqa: SLF001 - the same

    def _raise_failure(self) -> None:
        __tracebackhide__ = True
        failing, self._failing = self._failing, []
        for program, fault in failing:
            if not self._expected:
                raise ProgramFailed(telling.failure(program, fault), fault)
            innermost = self._expected[-1]
            if innermost.program is None:
                innermost.program, innermost.fault = program, fault

    def _raise_mismatch(self) -> None:
        """Raise WrongType, once, for what never arrives although both sides use the same name."""
        __tracebackhide__ = True
        if self._fits:
            return
        self._fits = True
        served = {name: message_type_name(kind) for name, (kind, _) in self._functions.items()}
        served |= {f"{name}/_action/send_goal": f"{one.type}_SendGoal" for name, one in self._actions.items()}
        of_test = telling.Sides(self._offers.values(), {}, served)
        for found in telling.mismatches(self._graph, [of_test, *map(telling.sides_of, self._simulations)]):
            if found not in self._mismatches:
                self._mismatches.add(found)
                raise WrongType(found)

    def _refuse_other_server(self, service: str, interface: str, name: str) -> None:
        """Raise WrongType if all servers of a service are of another type than the test calls it with."""
        __tracebackhide__ = True
        self._catch_up()
        servers = [end for end in telling.service_ends(self._graph, "service") if end.service == service]
        if servers and all(end.type != interface for end in servers):
            one, expected = servers[0], interface.removesuffix("_SendGoal")
            raise WrongType(f"{name}: {one.node} offers {one.type.removesuffix('_SendGoal')}, the test uses {expected}")

    def _answered(self, question: Mapping[str, Any]) -> Any:
        """Answer a question of the worker: what a simulation does, or what a served function responds."""
        if question["ask"] == "simulation":
            now, number, method = (
                Moment(question["now_ns"], question["clock_ns"]),
                question["number"],
                question["method"],
            )
            answer = self._checked(number, method, self._asked(number, method, now, *question["arguments"]))
            return dict(answer) if isinstance(answer, Mapping) else answer
        if question["ask"] == "action":
            now = Moment(question["now_ns"], question["clock_ns"])
            done = self._actions[question["action"]].attend(
                now, question["part"], question["number"], question["request"]
            )
            return done | {"does": [_portable(*one) for one in done["does"]]}
        name = question["service"]
        kind, function = self._functions[name]
        response = function(built(kind.Request, question["request"], name))
        if not isinstance(response, kind.Response):
            found = type(response).__name__
            raise TypeError(f"{name}: expected a {kind.__name__}.Response from its function, found {found}")
        return plain_fields(response)


def _portable(part: str, number: int, content: Any) -> tuple[str, int, Any]:
    """Return what an action does as JSON values: a message as its bytes."""
    if part in TOPICS_OF_ACTIONS:
        return part, number, base64.b64encode(bytes_of(content)).decode()
    return part, number, content


def _as_plain(program: Program) -> dict[str, Any]:
    """Return a program as plain values: whether it runs, and what it failed of."""
    fault, failed = program.fault, None
    if fault is not None:
        place = {"file": str(program.root / fault.file) if fault.file else "", "line": fault.line}
        failed = {"kind": fault.kind.value, "text": fault.text, "t_s": seconds(fault.t_ns), **place}
    return {"name": program.name, "running": program.running, "exit_code": program.exit_code, "failed": failed}


def _modules_for(folders: Sequence[Path]) -> tuple[str, ...]:
    """Return where packages are that programs of folders need and nobody has installed; a test may import them too."""
    found = tuple(str(path) for folder in folders for path in modules_for(folder))
    let_import(found)
    return found


def clock_named(name: str) -> ClockKind:
    """Return the clock of a name; raises ValueError if there is none."""
    if name not in [kind.value for kind in ClockKind]:
        raise ValueError(f"clock: expected virtual or wall, found {name!r}")
    return ClockKind(name)
