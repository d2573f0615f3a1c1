"""The conversation between a student's process and the worker: every report, answer and claim, and their checks.

The host in the process reports, and the worker answers. Both send lines of JSON over a socket that the process
inherits: an object with the `kind` of what is said, and the fields of its type that are not as usual. The types lie in
the host's folder because a sandboxed process sees nothing else of the grader.

The host believes the worker. The worker believes nothing: the program can write to the same socket. So `decoded_report`
builds each report by the `checked` of its type: a field that is not what it should be is as if it had not been sent,
and what is not a report becomes `NeverSent`. What a field says is not checked here where that takes the submission or
the plan: that a file has a line, or that a limit explains an end.

A new field is written here, and where it is set and read.
"""

# No `from __future__ import annotations`: `typing` would compile the annotation of each field.
import json
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

#: The most messages that are believed to be sent between two reports, and how many endpoints and parameters.
MOST_SENT, MOST_CLAIMS = 1_000_000, 1_000
#: The longest name of a topic or service, and of a node with its namespace: RMW_TOPIC_MAX_NAME_LENGTH, and below the
#: sum of RMW_NAMESPACE_MAX_LENGTH and RMW_NODE_NAME_MAX_NAME_LENGTH of rmw.
LONGEST, LONGEST_NODE = 247, 300
# As text: the host, which never checks, need not compile them when it starts.
#: The rules of rmw_validate_full_topic_name: absolute, no empty part, no part that begins with a digit.
_NAME = r"(?:/[A-Za-z_][A-Za-z0-9_]*)+"
#: Types and parameters; anything else that a process reports as a name is never shown.
_TYPE, _PARAMETER = r"[A-Za-z0-9_]+(?:/[A-Za-z0-9_]+){1,2}", r"[^\s]{1,150}"

#: What a field of counts holds by default.
NONE: Mapping[str, int] = {}


def is_name(name: Any) -> bool:
    """Return whether a value is the absolute name of a topic or a service that ROS accepts."""
    return isinstance(name, str) and len(name) <= LONGEST and re.fullmatch(_NAME, name) is not None


def is_node_name(name: Any) -> bool:
    """Return whether a value is the absolute name of a node."""
    return isinstance(name, str) and len(name) <= LONGEST_NODE and re.fullmatch(_NAME, name) is not None


def counts(data: Any) -> Mapping[str, int]:
    """Return the number of messages by channel, without entries that are not valid channels or counts."""
    if not isinstance(data, dict):
        return NONE
    channels = {name: count for name, count in data.items() if is_name(str(name).partition(" ")[2])}
    return {
        str(name): min(count, MOST_SENT) for name, count in channels.items() if isinstance(count, int) and count > 0
    }


# ------------------------------------------------------------------------------------------------------------- claims


class EndQos(NamedTuple):
    """The QoS that decides who is matched: what a writer offers, or what a reader asks for."""

    reliable: bool
    latched: bool  # whether it is transient-local
    deadline_ns: int  # 0 if there is none
    manual: bool  # whether liveliness is manual by topic
    lease_ns: int = 0  # of liveliness; 0 if there is none

    @classmethod
    def checked(cls, data: Any) -> "EndQos | None":
        """Return what a process reports; None if it is not complete."""
        if not isinstance(data, dict):
            return None
        reliable, latched, manual = data.get("reliable"), data.get("latched"), data.get("manual")
        deadline_ns, lease_ns = data.get("deadline_ns"), data.get("lease_ns", 0)
        if not (isinstance(reliable, bool) and isinstance(latched, bool) and isinstance(manual, bool)):
            return None
        if not (isinstance(deadline_ns, int) and isinstance(lease_ns, int)):
            return None
        return cls(reliable, latched, deadline_ns, manual, lease_ns)


#: The QoS of an end that asks for nothing special.
ORDINARY = EndQos(reliable=True, latched=False, deadline_ns=0, manual=False)


class Claim(NamedTuple):
    """An endpoint, a node or a parameter of a process: the host claims all of them whenever one is new or has gone."""

    kind: str  # `publisher`, `subscription`, `client`, `service`, `node` or `parameter`
    name: str  # absolute; of a parameter `NODE:PARAMETER`
    type: str  # the ROS type; empty for a node, the value of a parameter as text
    number: int = 0  # of a publisher or subscription, from 1: tells those of one topic apart; 0 if it has none
    qos: EndQos = ORDINARY  # of a publisher or a subscription
    sends: EndQos = ORDINARY  # with which a client or a server sends
    takes: EndQos = ORDINARY  # and with which it receives

    @classmethod
    def checked(cls, data: Any) -> "Claim | None":
        """Return what a process claims; None if it is not the complete description of something."""
        if not isinstance(data, dict):
            return None
        kind, name, interface = (data.get(key) for key in ("kind", "name", "type"))
        if not (isinstance(kind, str) and isinstance(name, str) and isinstance(interface, str)):
            return None
        if not _is_named(kind, name, interface):
            return None
        if kind in ("node", "parameter"):
            return cls(kind, name, interface)
        number = data.get("number")
        qos, sends, takes = (
            EndQos.checked(data[key]) if key in data else ORDINARY for key in ("qos", "sends", "takes")
        )
        if qos is None or sends is None or takes is None:
            return None
        return cls(kind, name, interface, number if isinstance(number, int) else 0, qos, sends, takes)


def _is_named(kind: str, name: str, interface: str) -> bool:
    """Return whether something of a kind can have a name and a type."""
    if kind == "parameter":
        node, _, parameter = name.partition(":")
        return is_node_name(node) and re.fullmatch(_PARAMETER, parameter) is not None
    if kind == "node":
        return is_node_name(name)
    return is_name(name) and re.fullmatch(_TYPE, interface) is not None


def _claims(data: Any, most: int | None = None) -> list[Claim | None] | None:
    return [Claim.checked(one) for one in data[:most]] if isinstance(data, list) else None


# -------------------------------------------------------------------------------------------------- parts of reports


#: The most frames of an exception that are read.
FRAMES = 20


class FaultReport(NamedTuple):
    """What ended a program, or one of its threads: an uncaught exception, or that the watchdog gave it up."""

    code: str = ""  # `exception`, `syntax_error`, `faults.GRADERS`, or one of those of the watchdog
    type: str = ""  # of an exception: its class as tracebacks show it
    message: str = ""  # of an exception: its text on one line
    module: str = ""  # where the grader's own code failed: a file of the host
    at: int = 0  # and its line
    file: str = ""  # the student's innermost frame: a path in the submission
    line: int = 0
    frames: Sequence[tuple[str, int, str]] = ()  # the student's own: file, line, function; outermost first

    @classmethod
    def checked(cls, data: Any) -> "FaultReport":
        """Return what a process reports."""
        if not isinstance(data, dict):
            return cls()
        listed = data.get("frames")
        frames = [tuple(one) for one in listed[:FRAMES] if isinstance(one, list)] if isinstance(listed, list) else []
        return cls(
            _text(data.get("code")),
            _text(data.get("type")),
            _text(data.get("message")),
            _text(data.get("module")),
            _number(data.get("at")) or 0,
            _text(data.get("file")),
            _number(data.get("line")) or 0,
            tuple(one for one in frames if tuple(map(type, one)) == (str, int, str)),
        )


class Progress(NamedTuple):
    """What has happened in a process since its last report; a part of `Idle` and `Exited`.

    The counts only tell the worker when an instant is settled, and the marks of work which of its own measurements
    belong to a pause: no verdict depends on what a process says.
    """

    now_ns: int | None = None  # its virtual time, since 1970; None on the wall clock
    paused: bool = False  # whether a pause, or the period of a timer, began
    counted: bool = False  # whether one did after no look at a clock, so that it is counted from the end of the work
    moved: int = 0  # how often it let time pass without asking
    charged: bool = False  # whether it waits for as long as it has worked
    threads: bool = False  # whether another thread than the first ran
    sent: Mapping[str, int] = NONE  # by channel, such as `topic /x`: how many messages it has sent
    early: Mapping[str, int] = (
        NONE  # the first ones of these, sent before anybody could have discovered their publisher
    )
    lost: Mapping[str, int] = NONE  # by channel: how many announced messages did not arrive in time
    endpoints: Sequence[Claim | None] | None = (
        None  # all that it has, if any changed; checked, None for what is invalid
    )
    sees_graph: bool = False  # with endpoints: whether its program queries the graph
    # Where the order is drawn, what the program has done: `timer`, or a verb and a channel, such as `reads topic /x`.
    did: Sequence[str] = ()
    drew: bool = False  # and whether a look of an executor has found less than was ready

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "Progress":
        """Return what a process reports."""
        return cls(
            _whole(data.get("now_ns")),
            bool(data.get("paused")),
            bool(data.get("counted")),
            _whole(data.get("moved")) or 0,
            bool(data.get("charged")),
            bool(data.get("threads")),
            counts(data.get("sent")),
            counts(data.get("early")),
            counts(data.get("lost")),
            # One more than are believed, so that it shows.
            _claims(data.get("endpoints"), MOST_CLAIMS + 1),
            data.get("sees_graph") is True,
            tuple(one for one in _list(data.get("did"))[:MOST_DONE] if _is_done(one)),
            data.get("drew") is True,
        )


#: The most that one report tells of what was done.
MOST_DONE = 1_000


def _is_done(data: Any) -> bool:
    """Return whether a value says what a program can do: run a timer, or something with a channel."""
    if not isinstance(data, str):
        return False
    verb, _, channel = data.partition(" ")
    kind, _, name = channel.partition(" ")
    known = verb in ("reads", "sends", "finds", "misses") and kind in ("topic", "request", "response")
    return data == "timer" or (known and is_name(name))


#: The most files that are kept of those that a program wrote.
MOST_WRITTEN = 20


class WrittenContent(NamedTuple):
    """A small file that a program wrote."""

    name: str  # relative to the folder that it was found in
    content: str  # in base64


#: The most handlers of events that a launch file registers, and the most that is done at once.
MOST_HANDLERS = 100


class LaunchStep(NamedTuple):
    """What a launch file does when it begins, or when one of its event handlers is called."""

    act: str = ""  # `start` a node, `register` an event handler, or `shutdown`
    number: int = 0  # of the node or of the handler
    delay_s: float = 0.0  # after the launch file began, or after the event

    @classmethod
    def checked(cls, data: Any) -> "LaunchStep | None":
        """Return what a process reports; None if a launch file cannot do it."""
        if not isinstance(data, dict) or data.get("act") not in ("start", "register", "shutdown"):
            return None
        return cls(data["act"], _number(data.get("number")) or 0, _delay_s(data.get("delay_s")))


class LaunchHandler(NamedTuple):
    """An event handler of a launch file, with what it does."""

    event: str = ""  # of a node: `start`, each `exit`, `complete` once it is not started again; or `shutdown`
    node: int = -1  # the number of the node; -1 for any
    once: bool = False  # whether it is called for the first event only
    steps: Sequence[LaunchStep] = ()

    @classmethod
    def checked(cls, data: Any) -> "LaunchHandler":
        """Return what a process reports; a handler of no event is never called."""
        if not isinstance(data, dict):
            return cls()
        node = _number(data.get("node", -1))
        # a handler of a node that cannot be is one of no event, not of any node
        event = _text(data.get("event")) if node is not None else ""
        return cls(event, -1 if node is None else node, data.get("once") is True, _steps(data.get("steps")))


def _steps(data: Any) -> list[LaunchStep]:
    found = (LaunchStep.checked(one) for one in _list(data)[:MOST_HANDLERS])
    return [one for one in found if one is not None]


class LaunchedNode(NamedTuple):
    """A node that a launch file describes."""

    package: str = ""  # of its program; empty if the launch file does not say
    near: str = ""  # the package of the submission that this one seems to be a misspelling of
    executable: str = ""
    arguments: Sequence[str] = ()
    ros_arguments: Sequence[str] = ()  # what follows `--ros-args`
    parameter_files: Sequence[Sequence[str]] = ()  # name and text of each
    file: str = ""  # where it is described: a path in the submission, or the name of a file of the rubric
    line: int = 0
    parameters: Sequence[str] = ()  # the names of those that the launch file gives this node by name
    remappings: Sequence[Sequence[str]] = ()  # old and new name of each that it gives this node
    respawn: bool = False  # whether it is started again when it has ended
    respawn_delay_s: float = 0.0  # how long after its end
    respawn_most: int = -1  # how often at most; -1 without a limit

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "LaunchedNode":
        """Return what a process reports."""
        most = _number(data.get("respawn_most", -1))
        files = [one for one in _list(data.get("parameter_files")) if isinstance(one, list) and len(one) == 2]
        return cls(
            _text(data.get("package")),
            _text(data.get("near")),
            _text(data.get("executable")),
            list(map(_text, _list(data.get("arguments")))),
            list(map(_text, _list(data.get("ros_arguments")))),
            [(_text(name), _text(text)) for name, text in files],
            _text(data.get("file")),
            _number(data.get("line")) or 0,
            list(map(_text, _list(data.get("parameters")))),
            [list(map(_text, one)) for one in _list(data.get("remappings")) if isinstance(one, list) and len(one) == 2],
            data.get("respawn") is True,
            _delay_s(data.get("respawn_delay_s")),
            -1 if most is None else most,
        )


class NotEvaluated(NamedTuple):
    """Something in a launch file that is not evaluated; the worker has the words for each code."""

    code: str = ""  # a key of `notes._LEFT_OUT`
    name: str = ""  # which one
    text: str = ""  # what it was given
    times: int = 1  # how often it is left out at this place
    ends: bool = False  # whether nothing after it was evaluated
    file: str = ""  # as in `LaunchedNode`
    line: int = 0

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "NotEvaluated":
        """Return what a process reports."""
        return cls(
            _text(data.get("code")),
            _text(data.get("name")),
            _text(data.get("text")),
            _number(data.get("times")) or 0,
            data.get("ends") is True,
            _text(data.get("file")),
            _number(data.get("line")) or 0,
        )


# ------------------------------------------------------------------------------------------ reports: host to worker


class Ready(NamedTuple):
    """Nothing of the student's has run yet: the first report of every process, which waits for an answer."""

    log_token: str = ""  # begins its log records: 32 hexadecimal digits, known to the logging library and the worker

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "Ready":
        """Return what a process reports."""
        token = data.get("log_token")
        return cls(token if isinstance(token, str) and re.fullmatch("[0-9a-f]{32}", token) else "")


class Idle(NamedTuple):
    """In virtual time: nothing is left to do at this instant. The process waits for an answer."""

    progress: Progress = Progress()
    wake_ns: int | None = None  # when it wants to run again, since 1970; None for when something arrives
    leaving: bool = False  # whether a sender is about to be destroyed, so that the answer comes after the arrival

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "Idle":
        """Return what a process reports."""
        return cls(Progress.checked(data), _whole(data.get("wake_ns")), data.get("leaving") is True)


class Exited(NamedTuple):
    """The program has ended: the last report, on both clocks."""

    progress: Progress = Progress()
    code: int | None = None  # its exit code; None if the watchdog has ended it
    fault: FaultReport | None = None  # what ended it; None if it ended by itself
    left: bool = False  # whether its endpoints have left the graph before
    unsettled: str = ""  # why virtual time does not suit it: `threads`, `outside`; empty if nothing is known against it

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "Exited":
        """Return what a process reports."""
        return cls(
            Progress.checked(data),
            _number(data.get("code")),
            FaultReport.checked(data["fault"]) if isinstance(data.get("fault"), dict) else None,
            bool(data.get("left")),
            _text(data.get("unsettled")),
        )


class MessagesArrived(NamedTuple):
    """In virtual time: what `Expect` or `Go` has announced has been received, or has not arrived in time."""

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "MessagesArrived":
        """Return the report."""
        del data
        return cls()


class Matched(NamedTuple):
    """In virtual time, to `AwaitMatches`: the process has waited, and waits for an answer again."""

    missing: Sequence[str] = ()  # `KIND NAME` of the endpoints with too few counterparts; `graph`
    untold: Sequence[str] = ()  # of those whose counterparts the middleware has not all reported

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "Matched":
        """Return what a process reports."""
        return cls(*(list(map(str, _list(data.get(name))[:MOST_UNMATCHED])) for name in ("missing", "untold")))


#: The host never reports more unmatched names than this.
MOST_UNMATCHED = 10_000


class Note(NamedTuple):
    """Something that readers of the report must know; the worker has the words for each code."""

    code: str  # `started`, before any code of the file runs, or a key of `notes.NOTES`
    way: str = ""  # `started`: a value of `StartWay`
    module: str | None = None  # `started`: the dotted name that is run; `neighbour_imported`: what the file imports
    function: str | None = None  # `started`: what is called in it
    hidden: Sequence[str] = ()  # `started`: the files that hide a module
    class_name: str = ""  # `class_not_started`
    node: str = ""  # `other_domain`: its full name
    domain: int | None = None  # `other_domain`

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "Note":
        """Return what a process reports."""
        module, function, hidden = data.get("module"), data.get("function"), data.get("hidden")
        return cls(
            _text(data.get("code")),
            _text(data.get("way")),
            module if isinstance(module, str) else None,
            function if isinstance(function, str) else None,
            tuple(name for name in _list(hidden)[:MOST_HIDDEN] if isinstance(name, str)),
            _text(data.get("class_name")),
            _text(data.get("node")),
            _number(data.get("domain")),
        )


#: The most files that hide modules in one report.
MOST_HIDDEN = 20


class ThreadFault(NamedTuple):
    """An exception has ended one of the program's threads, which goes on without it."""

    fault: FaultReport

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "ThreadFault":
        """Return what a process reports."""
        return cls(FaultReport.checked(data.get("fault")))


class Reached(NamedTuple):
    """In virtual time: the program raised an event by which it could manipulate its process, for the first time."""

    what: str  # the audit event

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "Reached":
        """Return what a process reports."""
        return cls(str(data.get("what")))


class FilesWritten(NamedTuple):
    """The small files that the program wrote, at its end; no report if there are none."""

    files: Sequence[WrittenContent] = ()

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "FilesWritten":
        """Return what a process reports; whether it may have such names and contents is for the worker to see."""
        files = [one for one in _list(data.get("files"))[:MOST_WRITTEN] if isinstance(one, dict)]
        found = [(one.get("name"), one.get("content")) for one in files]
        texts = [(name, content) for name, content in found if isinstance(name, str) and isinstance(content, str)]
        return cls([WrittenContent(*one) for one in texts])


class EarlyMessage(NamedTuple):
    """On the wall clock: a message was sent before anybody could have discovered its publisher."""

    topic: str
    began_ns: int  # when sending began, by the system clock
    ended_ns: int  # and when it ended

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "EarlyMessage | NeverSent":
        """Return what a process reports."""
        began_ns, ended_ns = data.get("began_ns"), data.get("ended_ns")
        if not (isinstance(began_ns, int) and isinstance(ended_ns, int)):
            return NeverSent()
        return cls(str(data.get("topic")), began_ns, ended_ns)


class Parameters(NamedTuple):
    """On the wall clock: the parameters of all nodes, if any is new. In virtual time they are among the endpoints."""

    claims: Sequence[Claim | None] = ()

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "Parameters":
        """Return what a process reports."""
        return cls(_claims(data.get("claims")) or ())


class LaunchReport(NamedTuple):
    """What a launch file describes: the only report of a process that evaluates one, after `Ready`."""

    nodes: Sequence[LaunchedNode] = ()
    left_out: Sequence[NotEvaluated] = ()
    fault: FaultReport | None = None  # what ended the evaluation; there are no nodes then
    steps: Sequence[LaunchStep] = ()  # what it does when it begins
    handlers: Sequence[LaunchHandler] = ()

    @classmethod
    def checked(cls, data: Mapping[str, Any]) -> "LaunchReport":
        """Return what a process reports."""
        return cls(
            [LaunchedNode.checked(one) for one in _list(data.get("nodes")) if isinstance(one, dict)],
            [NotEvaluated.checked(one) for one in _list(data.get("left_out")) if isinstance(one, dict)],
            FaultReport.checked(data["fault"]) if "fault" in data else None,
            _steps(data.get("steps")),
            [LaunchHandler.checked(one) for one in _list(data.get("handlers"))[:MOST_HANDLERS]],
        )


class NeverSent(NamedTuple):
    """What the host never sends, so that it comes from the program."""


Report: TypeAlias = (
    Ready
    | Idle
    | Exited
    | MessagesArrived
    | Matched
    | Note
    | ThreadFault
    | Reached
    | FilesWritten
    | EarlyMessage
    | Parameters
    | LaunchReport
    | NeverSent
)


# ------------------------------------------------------------------------------------------ answers: worker to host


class Go(NamedTuple):
    """To `Ready` and `Idle`: the process continues. On the wall clock it is told once, and no time."""

    now_ns: int = 0  # virtual time from now on, since 1970
    free_until_ns: int = 0  # before this moment it may let time pass without asking
    arrivals: Mapping[str, int] = NONE  # by channel: the messages that are on their way to it, which it waits for first
    interrupt: bool = False  # whether it receives the stop signal now, as from Ctrl-C
    released: Mapping[str, int] = NONE  # by channel: how many messages that it holds have arrived now
    order: str | None = None  # the name of the step, if it draws what executors find first; None if they find all


class Stop(NamedTuple):
    """To end the run: the process receives the stop signal, and is no longer observed."""


class Expect(NamedTuple):
    """In virtual time, while it waits for an answer: it receives what another one has sent that is about to leave."""

    arrivals: Mapping[str, int]  # as in `Go`
    # By channel, for each message that it takes now: whether it holds it until a `Go` releases it, or loses it.
    held: Mapping[str, Sequence[bool]] = {}


class Counterparts(NamedTuple):
    """How many counterparts the endpoints of a process are to have."""

    # By name, for each endpoint that has any.
    publisher: Mapping[str, Sequence[int]] = {}
    subscription: Mapping[str, Sequence[int]] = {}
    client: Mapping[str, Sequence[int]] = {}
    service: Mapping[str, Sequence[int]] = {}
    heard: Mapping[str, int] = NONE  # by service: how many servers get requests of its client that they cannot answer
    # By the number of an endpoint, as text: how many counterparts its QoS has not fitted so far
    refused: Mapping[str, int] = NONE
    # By the number of a subscription with a lease, as text: how many of its publishers live, and how many have been
    # silent for the lease; empty if some have to show by hand that they live, which only the middleware times
    alive: Mapping[str, Sequence[int]] = {}
    graph: Mapping[str, int] | None = None  # by kind and name: what the graph holds; None if its program does not look


NO_COUNTERPARTS = Counterparts()


class AwaitMatches(NamedTuple):
    """In virtual time, while it waits for an answer: it waits until its endpoints have their counterparts."""

    expected: Counterparts
    gone: Sequence[str]  # the services whose servers its clients are to see no more
    wait_s: float  # at most so long, in real seconds


Answer: TypeAlias = Go | Stop | Expect | AwaitMatches

# ------------------------------------------------------------------------------------------------------- on the wire

#: How each is called; a report of another kind is `NeverSent`.
_REPORTS: Mapping[Any, str] = {
    Ready: "ready",
    Idle: "idle",
    Exited: "exited",
    MessagesArrived: "arrived",
    Matched: "matched",
    Note: "note",
    ThreadFault: "fault",
    Reached: "reached",
    FilesWritten: "written",
    EarlyMessage: "early",
    Parameters: "parameters",
    LaunchReport: "launched",
}
_ANSWERS: Mapping[Any, str] = {Go: "go", Stop: "stop", Expect: "expect", AwaitMatches: "match"}
_KINDS = {**_REPORTS, **_ANSWERS}
_CHECKS: Mapping[str, Callable[[Mapping[str, Any]], Report]] = {kind: said.checked for said, kind in _REPORTS.items()}
_ANSWERED: Mapping[str, Callable[..., Answer]] = {kind: said for said, kind in _ANSWERS.items()}


def encoded_line(said: Report | Answer) -> bytes:
    """Return the line that says a report or an answer."""
    return json.dumps({"kind": _KINDS[type(said)], **unusual_fields(said)}).encode() + b"\n"


def decoded_report(line: bytes | str) -> Report | None:
    """Return the report that a line from a student's process says; None if it says nothing."""
    try:
        data = json.loads(line if isinstance(line, str) else line.decode())
    except (ValueError, RecursionError):
        return None
    return checked_report(data) if isinstance(data, dict) else None


def checked_report(data: Mapping[str, Any]) -> Report:
    """Return what an object from a student's process reports."""
    kind = data.get("kind")
    check = _CHECKS.get(kind) if isinstance(kind, str) else None
    return NeverSent() if check is None else check(data)


def decoded_answer(line: bytes) -> Answer:
    """Return the answer that a line from the worker says."""
    data = json.loads(line)
    kind = data.pop("kind")
    if kind == _ANSWERS[AwaitMatches]:
        data["expected"] = Counterparts(**data["expected"])
    return _ANSWERED[kind](**data)


def unusual_fields(said: Any) -> dict[str, Any]:
    """Return the fields that are not as usual, as plain values; those of `Progress` stand beside the others."""
    usual: Mapping[str, Any] = said._field_defaults
    found: dict[str, Any] = {}
    for name, value in zip(said._fields, said, strict=True):
        if name in usual and value == usual[name]:
            continue
        if isinstance(value, Progress):
            found.update(unusual_fields(value))
        elif hasattr(value, "_fields"):
            found[name] = unusual_fields(value)
        elif isinstance(value, (list, tuple)):
            found[name] = [unusual_fields(one) if hasattr(one, "_fields") else one for one in value]
        else:
            found[name] = value
    return found


def _text(value: Any) -> str:
    return value if isinstance(value, str) else ""


def _number(value: Any) -> int | None:
    """Return a value that is a whole number, and no truth value."""
    return value if type(value) is int else None


def _whole(value: Any) -> int | None:
    return value if isinstance(value, int) else None


def _delay_s(value: Any) -> float:
    """Return a delay; longer than any run is never, and NaN fails both comparisons."""
    return float(value) if isinstance(value, (int, float)) and 0 < value < 1e6 else 0.0


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []
