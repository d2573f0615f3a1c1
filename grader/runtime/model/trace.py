"""Traces: everything observed in one run, in order; the only input of judging.

Times are integer nanoseconds since the scenario started. Within one instant, observations are in the order
`(t_ns, phase, source, seq)`, with stimuli before the actions of students' nodes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Mapping
from dataclasses import field, fields
from enum import Enum
from typing import Any, TypeVar

from grader.runtime.model.author_files import AuthorMistake
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import seconds
from grader.runtime.model.worlds import Sketch


class ClockKind(str, Enum):
    """Which clock the student's nodes ran on."""

    VIRTUAL = "virtual"
    WALL = "wall"


class FaultKind(str, Enum):
    """What went wrong in a student's process, before the stop signal."""

    SYNTAX_ERROR = "syntax_error"  # the file could not be compiled
    EXCEPTION = "exception"  # an uncaught exception ended the process or one of its threads
    EXITED = "exited"  # the process ended by itself
    HUNG = "hung"  # it used up its processor time, or blocked outside the virtual clock
    KILLED = "killed"  # a signal or a limit ended it


class StartWay(str, Enum):
    """How a student's file was started."""

    SCRIPT = "script"  # as `python3 FILE`
    MODULE = "module"  # as `python3 -m MODULE`, with its package
    MAIN = "main"  # the module was imported and its main() called, as `ros2 run` does
    ENTRY_POINT = "entry_point"  # as `ros2 run` does what setup.py names


@dataclass(frozen=True, slots=True)
class Start:
    """How one process was started."""

    process: str  # file name of the student process
    file: str  # the file that ran, relative to the submission
    way: StartWay  # the way of starting
    target: str = ""  # `MODULE` or `MODULE:FUNCTION`; empty for a script
    # Files and folders of the submission that are imported instead of a module of Python or ROS
    hidden: tuple[str, ...] = ()
    arguments: str = ""  # what the program was given on its command line, as it is typed
    launched_by: str = ""  # the launch file that started it, with its line; empty for the scenario itself

    @property
    def words(self) -> str:
        """The way of starting, as a phrase that follows `run`."""
        way = {
            StartWay.SCRIPT: f"as `python3 {self.file}`",
            StartWay.MODULE: f"as `python3 -m {self.target}`",
            StartWay.MAIN: f"as `ros2 run` would: {self.target}()",
            StartWay.ENTRY_POINT: f"as `ros2 run` does: the entry point {self.target}",
        }[self.way]
        given = f" with {self.arguments}" if self.arguments else ""
        return f"{way}{given}{f', started by {self.launched_by}' if self.launched_by else ''}"


def main_not_called(file: str, line: int = 0) -> str:
    """Return the note on a file in which nothing calls main(), with the line of main; 0 leaves it out."""
    place = f"{file}:{line}" if line else file
    problem = f"{place}: nothing calls main(), so `python3 {file}` would do nothing"
    return f"{problem}; add: if __name__ == '__main__': main()"


def same_node_name(name: str) -> str:
    """Return the note on a name that the nodes of two processes have."""
    return f"two nodes have the name {name}, and ROS cannot tell them apart: give each a name of its own"


@dataclass(frozen=True, slots=True)
class Message:
    """One message that a student's node published."""

    t_ns: int  # when it was published
    topic: str  # absolute name
    type: str  # e.g. `geometry_msgs/msg/Twist`
    value: Mapping[str, Any]  # fields as plain JSON values, nested by name; NaN and infinities are floats
    cdr: bytes = b""  # the bytes as they came over the wire
    # Whether it was sent as soon as its publisher existed, before any subscription could have discovered it, and not
    # transient local: outside of the grader nobody would have heard it
    before_discovery: bool = False


@dataclass(frozen=True, slots=True)
class Delivery:
    """One message that the grader published to the student's nodes; `value` and `type` as for Message."""

    t_ns: int
    topic: str
    type: str
    value: Mapping[str, Any]
    cdr: bytes = b""


@dataclass(frozen=True, slots=True)
class Request:
    """One request of a service call between the grader and a student's node."""

    t_ns: int  # when the grader sent or received it
    service: str  # absolute name
    type: str  # e.g. `std_srvs/srv/Trigger`
    number: int  # pairs it with its response; counts from 1 within a service and a sender
    sender: str  # `grader` for a call to a student's server, `student` for a call of a student's client
    client: int  # number of the grader's client, from 1; 0 for a student's client
    value: Mapping[str, Any]  # fields as plain JSON values, as for Message
    cdr: bytes = b""  # the bytes, if they are known


@dataclass(frozen=True, slots=True)
class Response:
    """One response of a service call; attributes as for Request, with the same number as its request.

    The sender is the server: `student` for a response of a student's server.
    """

    t_ns: int
    service: str
    type: str
    number: int
    sender: str
    client: int
    value: Mapping[str, Any]
    cdr: bytes = b""


@dataclass(frozen=True, slots=True)
class LogRecord:
    """One record written through an rclpy logger."""

    t_ns: int  # when it was written
    process: str  # file name of the student process, e.g. `scan_listener.py`
    severity: str  # DEBUG, INFO, WARN, ERROR or FATAL
    logger: str  # logger name, usually the node's
    text: str  # the message; may hold line breaks
    file: str = ""  # where it was logged, relative to the submission; empty if unknown
    line: int = 0  # line in that file, from 1; 0 if unknown


@dataclass(frozen=True, slots=True)
class OutputLine:
    """One line that a process wrote to `stdout` or `stderr` without the logger."""

    t_ns: int
    process: str
    stream: str
    text: str


@dataclass(frozen=True, slots=True)
class Endpoint:
    """One publisher or subscription in the live graph."""

    kind: str  # `publisher` or `subscription`
    topic: str  # absolute name
    type: str  # message type
    node: str  # fully qualified node name, e.g. `/scan_listener`
    participant: int  # number of the DDS participant in order of appearance, one for each process; -1 is the grader
    reliability: str  # `reliable` or `best_effort`
    durability: str  # `volatile` or `transient_local`
    depth: int = 0  # history depth, 0 if unknown
    deadline_ns: int = 0  # offered or requested deadline, 0 for none
    liveliness: str = "automatic"  # `automatic` or `manual_by_topic`
    lease_ns: int = 0  # offered or requested lease of the liveliness, 0 for none


@dataclass(frozen=True, slots=True)
class UnmetPolicy:
    """A QoS policy that keeps messages from passing."""

    policy: str  # the name of its parameter in rclpy, e.g. `deadline`
    offered: str  # by the publisher, in words, e.g. `no deadline`
    requested: str  # by the subscription, in words, e.g. `a deadline of 0.5 s`
    value: str  # what the subscription requests without the name of the policy, e.g. `0.5 s`


def first_unmet(publisher: Endpoint, subscription: Endpoint) -> UnmetPolicy | None:
    """Return the first QoS policy that keeps messages from passing; None if none does.

    The rules are those of ROS 2 for "request versus offered" policies, as in the documentation of its QoS settings.
    """
    if (publisher.reliability, subscription.reliability) == ("best_effort", "reliable"):
        return UnmetPolicy("reliability", "best_effort reliability", "reliable messages", "reliable")
    if (publisher.durability, subscription.durability) == ("volatile", "transient_local"):
        return UnmetPolicy("durability", "volatile durability", "transient_local durability", "transient_local")
    if not keeps_within(publisher.deadline_ns, subscription.deadline_ns):
        return _unmet_time("deadline", "deadline", publisher.deadline_ns, subscription.deadline_ns)
    if (publisher.liveliness, subscription.liveliness) == ("automatic", "manual_by_topic"):
        return UnmetPolicy("liveliness", "automatic liveliness", "manual_by_topic liveliness", "manual_by_topic")
    if not keeps_within(publisher.lease_ns, subscription.lease_ns):
        name = "liveliness_lease_duration"
        return _unmet_time(name, "liveliness lease", publisher.lease_ns, subscription.lease_ns)
    return None


def unmet_policy(publisher: Endpoint, subscription: Endpoint) -> tuple[str, str] | None:
    """Return the first QoS policy that keeps messages from passing, as offered and as requested; None if none does.

    The rules are those of ROS 2 for "request versus offered" policies, as in the documentation of its QoS settings.
    """
    unmet = first_unmet(publisher, subscription)
    return None if unmet is None else (unmet.offered, unmet.value)


def unusual_request(subscription: Endpoint) -> UnmetPolicy | None:
    """Return the first QoS policy that a subscription requests and a publisher by default does not offer."""
    return first_unmet(Endpoint("publisher", subscription.topic, "", "", -1, "reliable", "volatile"), subscription)


def keeps_within(offered_ns: int, requested_ns: int) -> bool:
    """Return whether a publisher's deadline or lease is as short as a subscription requests; 0 stands for none."""
    return requested_ns == 0 or 0 < offered_ns <= requested_ns


def _unmet_time(policy: str, name: str, offered_ns: int, requested_ns: int) -> UnmetPolicy:
    offered = f"a {name} of {seconds(offered_ns):g} s" if offered_ns else f"no {name}"
    value = f"{seconds(requested_ns):g} s"
    return UnmetPolicy(policy, offered, f"a {name} of {value}", value)


@dataclass(frozen=True, slots=True)
class ServiceEnd:
    """One server or client of a service in the live graph, without those that every node has."""

    kind: str  # `service` or `client`
    service: str  # absolute name
    type: str  # e.g. `std_srvs/srv/Trigger`
    node: str  # fully qualified node name
    reliability: str = "reliable"  # as for an endpoint of a topic; of requests, and as a rule of responses as well
    durability: str = "volatile"

    @property
    def unusual(self) -> str:
        """The policy that no end with the default QoS fits, in words; empty if there is none.

        Requests go one way and responses the other, so both ends must be alike.
        """
        if self.reliability != "reliable":
            return f"{self.reliability} reliability"
        return f"{self.durability} durability" if self.durability != "volatile" else ""


#: The service of an action by which a client sends its goal.
_GOAL_SERVICE = "/_action/send_goal"


def offered_as(service: str) -> tuple[str, str] | None:
    """Return kind and name of what a service stands for: of an action it is the one that takes goals.

    The kind is `service` or `action`. None for the other services of an action, and for hidden ones.
    """
    if service.endswith(_GOAL_SERVICE):
        return "action", service.removesuffix(_GOAL_SERVICE)
    return None if "/_" in service else ("service", service)


@dataclass(frozen=True, slots=True)
class GraphSnapshot:
    """The live ROS graph at one moment, without the grader's own nodes; endpoints and services sorted."""

    t_ns: int
    nodes: tuple[str, ...]
    endpoints: tuple[Endpoint, ...]
    services: tuple[ServiceEnd, ...] = ()

    def ends_of_topics(self, kind: str, topic: str | None = None) -> list[Endpoint]:
        """Return each `publisher` or `subscription`, of one topic if that is given."""
        return [end for end in self.endpoints if end.kind == kind and topic in (None, end.topic)]

    def ends_of_services(self, kind: str, service: str | None = None) -> list[ServiceEnd]:
        """Return each `service` or `client`, of one service if that is given."""
        return [end for end in self.services if end.kind == kind and service in (None, end.service)]


@dataclass(frozen=True, slots=True)
class Fault:
    """A student's process raised, hung or exited; after the stop signal only if the scenario checks the shutdown."""

    t_ns: int  # time of the fault
    process: str  # file name of the student process
    kind: FaultKind
    text: str  # one line, e.g. `AttributeError: 'NoneType' object has no attribute 'pose'` or `exited with code 0`.
    # File of the innermost frame that is the student's own, relative to the submission; empty if unknown
    file: str = ""
    line: int = 0  # its line, from 1; 0 if unknown
    frames: tuple[str, ...] = ()  # the student's own frames, outermost first, as `file:line in function`
    # The exit code of a process that ended by itself; None for any other fault, or if it is not known
    exit_code: int | None = None
    # Name of the signal that ended the process, e.g. `SIGSEGV`; empty if there was none, or a limit explains it.
    signal: str = ""
    # Version of the Python that could not compile the file, e.g. `(3, 12)`; None for any other fault.
    python: tuple[int, int] | None = None

    @property
    def exception(self) -> str:
        """Name of the type of an exception or syntax error, which begins its text; empty for other faults."""
        return self.text.partition(":")[0] if self.kind in (FaultKind.EXCEPTION, FaultKind.SYNTAX_ERROR) else ""

    def said(self, pattern: str) -> re.Match[str] | None:
        """Search Python's text of an exception or syntax error for a pattern; None for other faults."""
        by_python = self.kind in (FaultKind.EXCEPTION, FaultKind.SYNTAX_ERROR)
        return re.search(pattern, self.text) if by_python else None


@dataclass(frozen=True, slots=True)
class Offer:
    """What a process reports to offer or use besides topics; shown in reports, but never judged."""

    t_ns: int  # when it reported this
    process: str  # file name of the student process
    kind: str  # `service`, `client` or `parameter`
    name: str  # absolute name; for a parameter `/node:name`
    detail: str  # service type, or the parameter's value


@dataclass(frozen=True, slots=True)
class Mark:
    """An event of the scenario itself.

    Names: `stream_starts` and `stream_stops` (detail: the topic of the stimulus), `server_starts` and `server_stops`
    (detail: the service of the grader's server), `process_starts` (detail: a process that starts late), `exited`
    (detail: a process that was allowed to exit, and did with code 0), `stop_signal` (detail: the process that received
    it), `stopped` (detail: a process that ended with code 0 or by that signal after it), `limit` (detail: a sentence),
    `simulation_hears` (detail: a topic and a message type that a simulation of the rubric takes there),
    `action_starts` (detail: an action that the grader offers, and its type).
    """

    t_ns: int
    name: str
    detail: str = ""


Kind = TypeVar("Kind")
Known = TypeVar("Known")
Carried = TypeVar("Carried", Message, Delivery)
Observation = Message | Delivery | Request | Response | LogRecord | OutputLine | GraphSnapshot | Fault | Offer | Mark


@dataclass(frozen=True, slots=True)
class NewerPython:
    """What ended a program is right in the Python of the ROS release, and unknown to the older one that runs here."""

    process: str  # file name of the student process
    file: str  # the file that needs it, relative to the submission
    line: int  # where it was found, from 1; 0 if unknown
    needs: tuple[int, int]  # the oldest version of Python that has it
    here: tuple[int, int]  # the version that the program ran on
    release: str  # the ROS release, e.g. `jazzy`
    python: tuple[int, int]  # the version that the release runs on
    name: str = ""  # what the standard library has since then, e.g. `itertools.batched`; empty for syntax

    @property
    def sentence(self) -> str:
        """What is lacking, and whose fault it is not."""
        place = f"{self.file}:{self.line}" if self.line else self.file or self.process
        needs, here, python = (".".join(map(str, version)) for version in (self.needs, self.here, self.python))
        what = f"{self.name} came with" if self.name else "this is valid since"
        runs = f"ROS 2 {self.release} runs on Python {python}, the grader here on Python {here}"
        return f"{place}: {what} Python {needs}; {runs}, which is not the program's fault"


@dataclass(frozen=True, slots=True)
class OtherNumpy:
    """Programs run with another major version of numpy here than on the ROS release."""

    here: str  # e.g. `2.4`
    wanted: str  # that of the release, e.g. `1.26`
    release: str  # the ROS release, e.g. `jazzy`

    @property
    def sentence(self) -> str:
        """What differs."""
        return (
            f"the program uses numpy, of which ROS 2 {self.release} has {self.wanted} and this machine {self.here}: "
            "types and values of results differ (NEP 50)"
        )


@dataclass(frozen=True, slots=True)
class WrittenFile:
    """A small file that a program wrote beside itself, as its process reports it; no check reads it."""

    process: str
    name: str  # relative to the submission, or to the working directory
    content: str  # base64


@dataclass(frozen=True, slots=True)
class Tested:
    """What a test of the rubric's author has found in its own run."""

    passed: bool
    reason: str = ""  # why it has not passed: the message of the assertion; may hold text of the student's
    hint: str = ""  # one thing to do, if the run itself shows it
    fault: Fault | None = None  # the failure of a program that ended the test
    missing: tuple[str, ...] = ()  # files that it runs and the submission lacks


@dataclass(frozen=True, slots=True)
class BagContents:
    """What a recording holds that a student has handed in."""

    file: str  # its file or folder, relative to the submission
    # Every topic of the recording, read or not, with its type and how many messages there are
    topics: tuple[tuple[str, str, int], ...] = ()
    # Of each topic that was read: its name, how many different messages it has, and a digest of all of them in their
    # order, without the times at which they were recorded and stamped
    contents: tuple[tuple[str, int, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Trace:
    """What was recorded of one scenario: all that checks, hint rules and charts read."""

    scenario: str
    clock: ClockKind  # which clock the nodes ran on
    stop_ns: int  # when observation ended; the window is [0, stop_ns). Later observations followed the stop signal.
    observations: tuple[Observation, ...]
    # Sentences that readers must know (entry without a guard, a limit reached, lost messages)
    notes: tuple[str, ...] = ()
    starts: tuple[Start, ...] = ()  # how each process was started
    # What a launch file asks for and the grader cannot do, as sentences: what is not met may be due to it
    left_out: tuple[str, ...] = ()
    # Programs beside the student's own that were not started, as sentences, each with the one topic, service or action
    # that it would use, empty where that is not known: what is not met may be due to what they send or answer
    unstarted: tuple[tuple[str, str], ...] = ()
    written: tuple[WrittenFile, ...] = ()  # of programs that ended in time
    other_numpy: OtherNumpy | None = None  # what numpy programs run with, if it is not that of the ROS release
    newer: tuple[NewerPython, ...] = ()  # what programs ended of, and would not where the release's own Python runs
    drawn: tuple[Sketch, ...] = ()  # the pictures of the simulations that took part, as they were at the end
    # What the test has found whose run this is; None for a scenario that checks judge
    tested: Tested | None = None
    # The recording that the student has handed in and that was read for this trace; None if programs ran
    bag: BagContents | None = None
    _known: dict[Hashable, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    def once(self, key: Hashable, work: Callable[[], Known]) -> Known:
        """Cache a value that is computed from this trace, for the lifetime of the trace.

        The key identifies the computation and its parameters. The work is a pure function whose result does not
        refer to the trace.
        """
        if key not in self._known:
            self._known[key] = work()
        known: Known = self._known[key]
        return known

    def of(self, kind: type[Kind]) -> tuple[Kind, ...]:
        """Return the observations of a kind, in order."""
        found: tuple[Kind, ...] = self.once("kinds", self._by_kind).get(kind, ())
        return found

    def _by_kind(self) -> dict[type, tuple[Any, ...]]:
        sorted_out: dict[type, list[Observation]] = {}
        for observation in self.observations:
            sorted_out.setdefault(type(observation), []).append(observation)
        return {kind: tuple(found) for kind, found in sorted_out.items()}

    def messages(self, topic: str | None = None) -> tuple[Message, ...]:
        """Return the messages published by student nodes, on one topic or on all."""
        return self._on(Message, topic)

    def deliveries(self, topic: str) -> tuple[Delivery, ...]:
        """Return the messages that the grader published on a topic."""
        return self._on(Delivery, topic)

    def _on(self, kind: type[Carried], topic: str | None) -> tuple[Carried, ...]:
        if topic is None:
            return self.of(kind)
        return self.once((kind, topic), lambda: tuple(o for o in self.of(kind) if o.topic == topic))

    def requests(self, service: str, sender: str) -> tuple[Request, ...]:
        """Return the requests of a service that `student` or `grader` sent."""
        return tuple(o for o in self.of(Request) if (o.service, o.sender) == (service, sender))

    def responses(self, service: str, sender: str) -> tuple[Response, ...]:
        """Return the responses of a service that `student` or `grader` sent."""
        return tuple(o for o in self.of(Response) if (o.service, o.sender) == (service, sender))

    def records(self, process: str | None = None) -> tuple[LogRecord, ...]:
        """Return the records written through rclpy loggers, by one process or by all."""
        return tuple(o for o in self.of(LogRecord) if process in (None, o.process))

    def lines(self, process: str | None = None) -> tuple[OutputLine, ...]:
        """Return the lines written without the logger, by one process or by all."""
        return tuple(o for o in self.of(OutputLine) if process in (None, o.process))

    def faults(self, process: str | None = None) -> tuple[Fault, ...]:
        """Return the faults, of one process or of all."""
        return tuple(o for o in self.of(Fault) if process in (None, o.process))

    def graphs(self) -> tuple[GraphSnapshot, ...]:
        """Return the snapshots of the live graph, one for each change."""
        return self.of(GraphSnapshot)

    def marks(self, name: str, detail: str | None = None) -> tuple[Mark, ...]:
        """Return the marks with a name, and with a detail if one is given."""
        return tuple(o for o in self.of(Mark) if o.name == name and detail in (None, o.detail))

    def endpoints(self, kind: str, topic: str | None = None) -> tuple[Endpoint, ...]:
        """Return every `publisher` or `subscription` that was ever in the graph, each once, in order of appearance."""
        return tuple(dict.fromkeys(end for graph in self.graphs() for end in graph.ends_of_topics(kind, topic)))

    def service_ends(self, kind: str, service: str | None = None) -> tuple[ServiceEnd, ...]:
        """Return every `service` or `client` that was ever in the graph, each once, in order of appearance."""
        return tuple(dict.fromkeys(end for graph in self.graphs() for end in graph.ends_of_services(kind, service)))


@dataclass(frozen=True, slots=True)
class AssessedTrace(Trace):
    """A trace with what the grader thinks of it: whether it can be judged, on which clock, and what to record again.

    No check can read that: it is handed what was `recorded`.
    """

    clock_reason: str = ""  # why virtual time is not suitable for these nodes; empty if it is
    harness_problem: str = ""  # a failure of the grader or the machine that prevents judging; empty if there was none
    # Whether what the submission does may be why there is a harness problem
    suspected: bool = False
    # Audit events of suspicious actions, as the processes report them: a reason for a check, not evidence
    reached: tuple[str, ...] = ()
    # On the wall clock, how long the thread of the nodes that waited most waited for processors that others used; in
    # virtual time, how much less time an idle machine may need for the nodes' work, where that is counted
    most_starved_ns: int = 0
    # How long all threads of the nodes and of the grader's worker together waited for them: nothing is recorded later
    # than that because the machine was busy
    all_starved_ns: int = 0
    # Why no check on the wall clock came to a result; empty if one did, or none was due. The result is then not final.
    unchecked: str = ""
    # Whether a wait for the middleware timed out, so that something may be missing: a reason to record again
    incomplete: bool = False
    # The mistake in a simulation of the rubric's author that prevents judging, as `harness_problem` does; None without
    author_mistake: AuthorMistake | None = None
    # In virtual time, whether the work of a node before its pauses may slow it down: a reason to record again
    may_drift: bool = False

    @property
    def recorded(self) -> Trace:
        """The trace alone; always the same object, so that what is cached in it is found again."""
        return self.once("recorded", self._without_assessment)

    def _without_assessment(self) -> Trace:
        return Trace(**{field.name: getattr(self, field.name) for field in fields(Trace) if field.init})

    @staticmethod
    def unremarkable(trace: Trace) -> AssessedTrace:
        """Return a trace of which the grader thinks nothing in particular."""
        return AssessedTrace(**{field.name: getattr(trace, field.name) for field in fields(Trace) if field.init})
