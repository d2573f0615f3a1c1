"""The world of a stepped test: programs run in it, and time passes in it only when the test says so."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field
from functools import wraps
from pathlib import Path
from random import Random
from typing import Any, ParamSpec, TypeVar

from grader.grading.model.tested_run import SideOfTest
from grader.grading.model.wording import moment
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import GraderError
from grader.runtime.model.quantities import NS_PER_S, seconds
from grader.runtime.model.step_event import ProgramStep, StepEvent
from grader.runtime.model.trace import AssessedTrace, GraphSnapshot, LogRecord, Message, OutputLine
from grader.runtime.plan import Plan, PlannedStart, derive, ros_arguments
from grader.runtime.serialization import (
    QoSProfile,
    message_type_name,
    parameter_message,
    read_message,
    service_type,
)
from grader.runtime.served_actions import ServedAction
from grader.runtime.session import RecordingSession
from grader.runtime.simulation import Simulation
from grader.runtime.steps import ReadSteps
from grader.world.account import RunAccount
from grader.world.asking import GoalHandle, GoalResult, PendingCall, Received
from grader.world.calling import Calls
from grader.world.calls import CallLog, noted_call
from grader.world.errors import NoMessage, ParameterRejected, StepTimeout
from grader.world.frames import TRANSFORMS, FrameTransform, last_links, transform_between
from grader.world.golden import compare_with_kept, refuse_no_tolerance, write_kept
from grader.world.names import absolute_name
from grader.world.observed import Observed, compiled_match
from grader.world.offering import Offers, length_of, publication, recorded_publications
from grader.world.programs import Parameters, Runnable, given_parameters, parameter_values
from grader.world.running import Failure, Launched, ProgramSource, ProgramStart, RunningPrograms
from grader.world.simulating import NamedSimulations, SimulationsOfTest
from grader.world.started import Messages, Program
from grader.world.timeline import StepSession, Timeline

Value = TypeVar("Value")
Given = ParamSpec("Given")


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


def _refuse_no_program(program: Any) -> Program:
    """Return a program; raises TypeError for anything else, such as its name."""
    if not isinstance(program, Program):
        raise TypeError(f"expected what run or launch has returned, found {program!r}")
    return program


@dataclass(frozen=True, slots=True)
class WorldSetting:
    """What differs between worlds: those of a test's own programs, and those of programs that were handed in.

    Attributes:
        session: What the programs run in.
        source: Where they come from.
        near: Folders in which files are looked for; the first one is that of the test.
        read: Makes an object of its class from a message of a program.
        simulations: What may be simulated by name, besides the built-in simulations.
        account: Tells what is known of a run.
    """

    session: StepSession
    source: ProgramSource
    near: Sequence[Path] = ()
    read: Callable[[Message], Any] = read_message
    simulations: NamedSimulations = field(default_factory=NamedSimulations)
    account: type[RunAccount] = RunAccount


class World:
    """Runs programs in virtual time, and lets a test act on them and look at what they do.

    Virtual time stands still between two calls. On the wall clock, the same calls take as long as they say, and the
    programs run on between them. Use `grader.api.open_world` or the fixture `ros`, not the constructor.

    Args:
        setting: What the programs run in, and where they come from.
        plan: Name, limits and clock of the run, and the faults that are on in it.
        seed: What everything drawn follows from.
        faults: The names of these faults.

    Attributes:
        session: What the programs run in.
        faults: The names of the faults that are on in this run, such as `delay /scan`.
        updates_recordings: Whether `record` writes what it would compare.
    """

    def __init__(self, setting: WorldSetting, plan: Plan, seed: int, faults: Sequence[str] = ()) -> None:
        self.session = setting.session
        self.faults = tuple(faults)
        self.updates_recordings = False
        self._near = tuple(setting.near)
        self._plan = plan
        self._seed = seed
        self._random: Random | None = None
        self._observed = Observed(setting.read)
        self._timeline = Timeline(setting.session, plan, self._observed)
        self._run = self._timeline.run
        self._log = CallLog(lambda: self._timeline.now_ns)
        self._timeline.join(self._log)
        self._programs = RunningPrograms(self._timeline, self._observed, setting.source, plan)
        self._simulations = SimulationsOfTest(self._timeline, seed, setting.simulations)
        self._offers = Offers(self._timeline, self._observed, self._simulations)
        self._account = setting.account(plan.scenario, self._timeline, self._observed, self._programs, self._offers)
        self._calls = Calls(self._timeline, self._observed, self._account, seed)

    # ------------------------------------------------------------- programs

    @noted_call
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
        found = self._programs.find(program)
        values, files, names = given_parameters(parameters, self._near)
        start = PlannedStart(
            found.name,
            executable=found.executable,
            arguments=tuple(map(str, arguments)),
            ros_arguments=ros_arguments(name, namespace, (remappings or {}).items(), parameter_values(values)),
            parameter_files=files,
        )
        return self._programs.start(ProgramStart(found, start, dict(env or {}), names, dict(remappings or {})))

    @noted_call
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
        if not self._programs.can_restart(_refuse_no_program(program)):
            raise ValueError(
                f"{program.name}: expected a program that was started with run, found one of a launch file"
            )
        if program.running:
            program.interrupt()
            self.wait_until(lambda: not program.running, timeout)
        return self._programs.restart(program)

    @noted_call
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
        return self._programs.launch(file, arguments or {})

    # ------------------------------------------------------------------ time

    @property
    def now(self) -> float:
        """Seconds since the test began: of virtual time, or of real time on the wall clock."""
        __tracebackhide__ = True
        return seconds(self._timeline.begin_ns())

    @noted_call
    def advance(self, seconds: float) -> None:
        """Let so many seconds pass, with everything that happens at their end; 0 is as good as `settle`.

        Raises:
            ProgramFailed: A program has failed meanwhile.
        """
        __tracebackhide__ = True
        self._timeline.advance(seconds)

    @noted_call
    def settle(self) -> None:
        """Let everything happen that happens now, such as the reaction to a message; no virtual time passes.

        On the wall clock nobody knows when a reaction is complete: it waits for a tenth of a second.
        """
        __tracebackhide__ = True
        self._timeline.settle()

    @noted_call
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
        lacking: list[NoMessage] = []

        def holds() -> Value | None:
            lacking.clear()
            try:
                return condition()
            except NoMessage as error:
                lacking.append(error)
                return None

        def too_late(since_ns: int) -> StepTimeout:
            asked = {"it asks for": [str(error) for error in lacking]}
            return self._account.timeout("the condition did not hold", since_ns, asked, *(one.hint for one in lacking))

        return self._timeline.wait(holds, timeout, too_late)

    @noted_call
    def wait_for_log(self, match: str, timeout: float, *, program: Program | None = None) -> LogRecord | OutputLine:
        """Let time pass until a program has logged or written something, and return that; what is there already counts.

        Args:
            match: A regular expression that is found in the text of a log record, or in a line of output.
            timeout: Seconds to wait at most.
            program: Whose text it is; None for any program's.

        Raises:
            StepTimeout: Nothing of that kind came in time.
            ValueError: It is not a regular expression.
            ProgramFailed: A program has failed meanwhile.
        """
        __tracebackhide__ = True
        process, seen = None if program is None else _refuse_no_program(program).name, 0
        pattern = compiled_match(match)

        def look() -> list[LogRecord | OutputLine]:
            nonlocal seen
            since, seen = seen, len(self._observed.everything)
            return self._observed.texts(pattern, process, since)

        def too_late(since_ns: int) -> StepTimeout:
            who = "no program has" if process is None else f"{process} has not"
            return self._account.timeout(f"{who} logged or written {match!r}", since_ns, {})

        return self._timeline.wait(look, timeout, too_late)[0]

    @property
    def advice(self) -> str:
        """What may be meant where a message of the test has no subscription; empty if all have, or nothing is alike."""
        return self._account.advice()

    # --------------------------------------------------------------- acting

    @noted_call
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
        self._offers.publish(publication(absolute_name(topic), message, rate), qos)

    @noted_call
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
        path = next((found for folder in self._near if (found := folder / bag).exists()), Path(bag))
        commands = [*recorded_publications(bag, path, topics, rate)]
        for command in commands:
            self._offers.publish(command, qos)
        return length_of(commands)

    @noted_call
    def stop_publishing(self, topic: str) -> None:
        """End what the test publishes on a topic; its publisher stays."""
        __tracebackhide__ = True
        self._offers.stop_publishing(absolute_name(topic))

    @noted_call
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
        self._offers.serve(absolute_name(name), message_type_name(type, "srv"), function)

    @noted_call
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
        interface = message_type_name(type, "action")
        self._offers.serve_action(ServedAction(absolute_name(name), interface, answer, preempts=preempts))

    @noted_call
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

    @noted_call
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
        return self._calls.call(absolute_name(name), request)

    @noted_call
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
        return self._calls.send_goal(absolute_name(name), goal, cancel_after).wait(timeout)

    @noted_call
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
        return self._calls.send_goal(absolute_name(name), goal)

    @noted_call
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

    @noted_call
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
        return self._offers.simulate(simulation, parameters)

    # --------------------------------------------------------------- looking

    @noted_call
    def received(self, topic: str, type: Any = None) -> list[Received]:  # noqa: A002 - as in rclpy
        """Return the messages that programs have published on a topic so far, with their times.

        Args:
            topic: Its name.
            type: The class that they have to be of; None for any.

        Raises:
            WrongType: A message is of another type.
        """
        __tracebackhide__ = True
        self._timeline.catch_up()
        topic = absolute_name(topic)
        self._log.looked_at[topic] = None
        return Messages(self._observed.received(topic, type), lambda: self._account.silence(topic))

    @noted_call
    def messages(self, topic: str, type: Any = None) -> list[Any]:  # noqa: A002 - as in rclpy
        """Return the messages that programs have published on a topic so far.

        Args:
            topic: Its name.
            type: The class that they have to be of; None for any.

        Raises:
            WrongType: A message is of another type.
        """
        __tracebackhide__ = True
        found, topic = self.received(topic, type), absolute_name(topic)
        return Messages([one.message for one in found], lambda: self._account.silence(topic))

    @noted_call
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

    @noted_call
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
            NoMessage: No program has published on one of the topics, or on any.
            ValueError: The file has another ending or is not a recording, or a tolerance is invalid.
        """
        __tracebackhide__ = True
        if not self._near:
            raise ValueError("record: expected a test of your own programs: a rubric has no recordings to compare with")
        self._timeline.catch_up()
        names = [*map(absolute_name, topics)]
        path, now = self._near[0] / file, self._observed.kept_messages(names)
        if path.suffix != ".jsonl":
            raise ValueError(f"{file}: expected a name that ends with .jsonl: pytest --ros-update writes to this file")
        if unknown := [name for name in names if not self._observed.had_publisher(name)]:
            raise self._account.silence(unknown[0])
        if not names and not now:
            raise NoMessage(f"{file}: no program has published anything by {moment(self._timeline.now_ns)}")
        if self.updates_recordings:
            write_kept(path, now)
            return
        allowed: float | Mapping[str, float] = tolerance
        if isinstance(tolerance, Mapping):
            allowed = {absolute_name(name): value for name, value in tolerance.items()}
        refuse_no_tolerance("time_tolerance", time_tolerance)
        any_time = self._timeline.is_real or math.isinf(time_tolerance)
        late_ns = None if any_time else round(time_tolerance * NS_PER_S)
        compare_with_kept(path, now, names, allowed, late_ns)

    @noted_call
    def rate(self, topic: str, *, last: float | None = None) -> float:
        """Return how many messages a second programs publish on a topic, from the first to the last one.

        Args:
            topic: Its name.
            last: Count only the messages of so many last seconds.

        Returns:
            The rate, 0 for fewer than two messages.
        """
        __tracebackhide__ = True
        self._timeline.catch_up()
        self._log.looked_at[absolute_name(topic)] = None
        since_ns = 0 if last is None else self._timeline.now_ns - round(last * NS_PER_S)
        return self._observed.rate(absolute_name(topic), since_ns)

    @noted_call
    def nodes(self) -> list[str]:
        """Return the full names of the programs' nodes, sorted.

        As in ROS, a node is there until it is destroyed or its program has ended, also after `rclpy.shutdown()`.
        """
        __tracebackhide__ = True
        return sorted(self.graph().nodes)

    @noted_call
    def topics(self) -> dict[str, str]:
        """Return the topics that programs publish on or subscribe to, with their types."""
        __tracebackhide__ = True
        self._timeline.catch_up()
        return self._observed.topics()

    @noted_call
    def services(self) -> dict[str, str]:
        """Return the services that programs offer, with their types; without those that every node has."""
        __tracebackhide__ = True
        self._timeline.catch_up()
        return {end.service: end.type for end in self._observed.graph.ends_of_services("service")}

    @noted_call
    def graph(self) -> GraphSnapshot:
        """Return nodes, publishers, subscriptions, servers and clients of the programs as they are now."""
        __tracebackhide__ = True
        self._timeline.catch_up()
        return self._observed.graph

    @property
    def programs(self) -> list[Program]:
        """Every program that was started."""
        return [*self._programs]

    @property
    def left_out(self) -> list[str]:
        """Sentences about what launch files describe and was not started, in the order in which they were told."""
        return self._programs.left_out

    @contextmanager
    def expects_failure(self, match: str = "") -> Iterator[Failure]:
        """Expect that a program fails in this block: what it raises does not fail the test.

        Args:
            match: A regular expression that is found in the exception, as in `ValueError: too fast`.

        Raises:
            AssertionError: No program has failed, or of something else.
        """
        __tracebackhide__ = True
        with self._programs.expects_failure(match) as failure:
            yield failure

    # ------------------------------------------------------------- recording

    def trace(self) -> AssessedTrace:
        """Return what was observed so far as a trace, as checks of a rubric read it."""
        return self._account.trace()

    def keep(self, folder: Path | str, why: str = "", failed_at: tuple[str, int] | None = None) -> list[Path]:
        """Write what happened so far into a folder, and return the paths: an MCAP file, and a page that plays the run.

        Args:
            folder: Where; it is created if it is not there.
            why: What the page says above the run.
            failed_at: Path and line at which the test has failed, which the page shows on its time line.
        """
        from grader.world.keeping import keep  # noqa: PLC0415 - takes long, and most tests pass

        place = Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        return keep(self._recorded_in(), self.trace(), self._drawn, place, why, self._side_of_test(failed_at))

    def _side_of_test(self, failed_at: tuple[str, int] | None = None) -> SideOfTest:
        """Return what the test itself has done so far."""
        faults = [(program.root, program.fault) for program in self.programs if program.fault is not None]
        return SideOfTest(
            calls=tuple(self._log.calls),
            omitted=self._log.count - len(self._log.calls),
            ends=tuple((t_ns, end) for end, t_ns in self._log.ends.items()),
            looked_at=tuple(self._log.looked_at),
            failed_at=failed_at,
            faults_at=tuple((str(root / fault.file), fault.line) for root, fault in faults if fault.file),
            sketches=tuple(self._simulations.sketches()),
        )

    def _recorded_in(self) -> RecordingSession:
        """Return the session that a run is kept with; raises ValueError for a test of a rubric, which has none."""
        if not isinstance(self.session, RecordingSession):
            raise ValueError("keep: expected a test of your own programs: grade keeps what a rubric's tests record")
        return self.session

    def situation(self) -> dict[str, Any]:
        """Return what is known of the run so far as plain values, as `failure.json` of a failed test has it.

        Times are in seconds since the test began.
        """
        return self._account.situation(clock=self._plan.clock, seed=self._drawn, faults=list(self.faults))

    def _repr_html_(self) -> str:
        """Return the run so far as a notebook shows it: a page in the page that plays it."""
        from grader.world.keeping import page_of  # noqa: PLC0415 - as above

        page = html.escape(page_of(self._recorded_in(), self.trace(), self._drawn, "", self._side_of_test()))
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
        return not self._timeline.is_real

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
        """Sentences about what the test has asked for in vain, and, once the world is closed, about how programs ran.

        In vain are parts of launch files, parameters and remappings that have no effect. A program may have run as it
        would not with `ros2 run`, which does not find a module beside it by its plain name.
        """
        return list(dict.fromkeys((*self._programs.remarks(), *self._run.notes)))

    @property
    def full(self) -> str:
        """The limit that ended the recording, as a sentence; empty if none did."""
        return self._run.full

    @property
    def problem(self) -> str:
        """Why what happened may be untrue, once the world is closed; empty if it is not."""
        clock, unsuitable = "the wall clock" if self._timeline.is_real else "virtual time", self._run.unsuitable
        return f"{clock} does not suit these programs: {unsuitable}" if unsuitable else ""

    def finish(self) -> None:
        """Let the programs come up that were started last, so that none fails unnoticed.

        Raises:
            ProgramFailed: One has failed.
        """
        __tracebackhide__ = True
        self._timeline.catch_up()

    def close(self) -> None:
        """End all programs, and the run; what was observed can still be looked at."""
        self._timeline.close()
