"""What host and worker say to each other, what the worker believes of it, and that it is spelled in one place."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Any

import pytest
from places import ROOT

from grader.runtime.host import protocol
from grader.runtime.host.protocol import (
    NO_COUNTERPARTS,
    ORDINARY,
    Answer,
    AwaitMatches,
    Claim,
    Counterparts,
    EarlyMessage,
    EndQos,
    Exited,
    Expect,
    FaultReport,
    FilesWritten,
    Go,
    Idle,
    LaunchedNode,
    LaunchHandler,
    LaunchReport,
    LaunchStep,
    Matched,
    MessagesArrived,
    NeverSent,
    Note,
    NotEvaluated,
    Parameters,
    Progress,
    Reached,
    Ready,
    Report,
    Stop,
    ThreadFault,
    WrittenContent,
    decoded_answer,
    decoded_report,
    encoded_line,
)

MADE_UP: tuple[Any, ...] = (None, 1.5, "x", [])
QOS = ORDINARY._asdict()
KNOWN = Claim("publisher", "/x", "std_msgs/msg/Float32")
CLAIM = {"kind": "publisher", "name": "/x", "type": "std_msgs/msg/Float32"}


@pytest.mark.parametrize("field", ["qos", "sends", "takes"])
@pytest.mark.parametrize(
    "qos",
    [
        None,
        5,
        [],
        {},
        *({**QOS, name: value} for name in ("reliable", "latched", "manual") for value in MADE_UP),
        *({**QOS, name: value} for name in ("deadline_ns", "lease_ns") for value in MADE_UP),
    ],
)
def test_an_endpoint_with_an_impossible_qos_is_none(field: str, qos: Any) -> None:
    """Who is matched with whom is computed from it."""
    assert Claim.checked({**CLAIM, field: QOS}) == KNOWN
    assert Claim.checked({**CLAIM, field: qos}) is None


@pytest.mark.parametrize("number", [None, "1", 1.5, [], {}])
def test_an_endpoint_without_a_possible_number_has_none(number: Any) -> None:
    """It only tells endpoints of one topic apart."""
    assert Claim.checked({**CLAIM, "number": number}) == KNOWN
    assert Claim.checked({**CLAIM, "number": 7}) == KNOWN._replace(number=7)


FAULT = FaultReport("exception", "ValueError", "no", "ros.py", 7, "a.py", 3, (("a.py", 3, "main"),))
PROGRESS = Progress(
    now_ns=5,
    paused=True,
    counted=True,
    moved=3,
    charged=True,
    threads=True,
    sent={"topic /x": 2},
    early={"topic /x": 1},
    lost={"request /s": 1},
    endpoints=[KNOWN, Claim("client", "/s", "std_srvs/srv/Empty", sends=EndQos(False, True, 5, True, 6))],
    sees_graph=True,
    did=("timer", "sends topic /x", "misses request /s"),
    drew=True,
)
REPORTS: tuple[Report, ...] = (
    Ready("ab" * 16),
    Idle(PROGRESS, wake_ns=9, leaving=True),
    Exited(PROGRESS, 3, FAULT, left=True, unsettled="threads"),
    MessagesArrived(),
    Matched(["publisher /x"], ["subscription /y"]),
    Note("started", "main", "a", "main", ("b.py",), "Node", "/n", 7),
    ThreadFault(FAULT),
    Reached("os.fork"),
    FilesWritten([WrittenContent("log.txt", "eA==")]),
    EarlyMessage("/x", 5, 6),
    Parameters([Claim("parameter", "/n:rate", "1.0")]),
    LaunchReport(
        [
            LaunchedNode(
                "robot",
                "robots",
                "talker",
                ["a"],
                ["-r"],
                [("x.yaml", "a: 1")],
                "a.launch.py",
                3,
                ["a"],
                [["b", "c"]],
                respawn=True,
                respawn_delay_s=2.5,
                respawn_most=3,
            )
        ],
        [NotEvaluated("command", "x", "ls", 2, True, "a.launch.py", 4)],
        FAULT,
        [LaunchStep("start", 0, 1.5), LaunchStep("register", 0)],
        [
            LaunchHandler("exit", 0, once=True, steps=[LaunchStep("shutdown", 0, 2.0)]),
            LaunchHandler("shutdown", steps=[]),
        ],
    ),
)
COUNTERPARTS = Counterparts(
    publisher={"/x": [1, 2]},
    subscription={"/y": [1]},
    client={"/s": [1]},
    service={"/t": [2]},
    heard={"/u": 1},
    refused={"7": 1},
    alive={"8": [1, 0]},
    graph={"publisher /x": 1},
)
ANSWERS: tuple[Answer, ...] = (
    Go(5, 6, {"topic /x": 1}, interrupt=True, released={"topic /x": 2}, order="5.0"),
    Stop(),
    Expect({"response /s": 1}, {"topic /x": [True, False]}),
    AwaitMatches(
        Counterparts({"/x": [1, 2]}, {"/y": [1]}, {}, {}, {"/s": 1}, {"7": 1}, {"8": []}, {"publisher /x": 1}),
        ["/s"],
        0.5,
    ),
)


@pytest.mark.parametrize("report", REPORTS, ids=lambda report: type(report).__name__)
def test_what_the_host_reports_is_believed(report: Report) -> None:
    """Field by field: none is lost on the way, and none is taken for another one."""
    assert not any(value in (field, None) for field, value in zip(report._fields, report, strict=True))
    assert decoded_report(encoded_line(report)) == report


def test_only_what_a_program_can_do_is_believed() -> None:
    """A report says it in words that end in a sentence below a failure."""
    hostile = ["timer", "reads topic /x", "reads topic x", "steals topic /x", "reads file /x", 5, "reads topic /x\n"]
    assert Progress.checked({"did": [*hostile, *["timer"] * 2_000]}).did == (
        "timer",
        "reads topic /x",
        *["timer"] * 993,
    )


@pytest.mark.parametrize("answer", ANSWERS, ids=lambda answer: type(answer).__name__)
def test_what_the_worker_answers_arrives(answer: Answer) -> None:
    """As it was said."""
    assert decoded_answer(encoded_line(answer)) == answer


def test_all_that_can_be_said_is_tried_here() -> None:
    """A new report or answer, and each of their fields."""
    assert {type(said) for said in (*REPORTS, *ANSWERS)} == protocol._KINDS.keys()
    for said in (*REPORTS, *ANSWERS, PROGRESS, FAULT, COUNTERPARTS):
        usual = said._field_defaults
        assert [name for name in said._fields if name in usual and getattr(said, name) == usual[name]] == []


def test_what_is_as_usual_is_left_out() -> None:
    """Most of a report is, and a process reports a thousand times a second."""
    assert encoded_line(Idle()) == b'{"kind": "idle"}\n'
    assert encoded_line(Idle(Progress(now_ns=5), 7)) == b'{"kind": "idle", "now_ns": 5, "wake_ns": 7}\n'
    match = AwaitMatches(NO_COUNTERPARTS, [], 1.0)
    assert encoded_line(match) == b'{"kind": "match", "expected": {}, "gone": [], "wait_s": 1.0}\n'
    assert decoded_answer(encoded_line(match)) == match


@pytest.mark.parametrize("line", [b"", b"no json", b"[1]", b"1", b"null", b"\xff", b"[" * 100_000])
def test_a_line_without_an_object_says_nothing(line: bytes) -> None:
    """It comes from no host."""
    assert decoded_report(line) is None


@pytest.mark.parametrize("line", [b"{}", b'{"kind": "go"}', b'{"kind": ["idle"]}', b'{"kind": "early", "topic": "/x"}'])
def test_an_object_that_the_host_never_sends_is_unknown(line: bytes) -> None:
    """Also one that a worker would send."""
    assert isinstance(decoded_report(line), NeverSent)


#: Everything that is said, and every field of it: spelled as an attribute everywhere else.
NAMES = {name for kind in vars(protocol).values() for name in getattr(kind, "_fields", ())} | {
    *protocol._KINDS.values()
}
#: What is no part of the conversation: by module and variable, what processes and programs are started with, and what
#: a launch file gives its actions.
REQUESTS = {
    ("host/entry.py", "request"),
    ("host/launch/markup.py", "more"),
    ("host/launch/nodes.py", "self.more"),
    ("host/program.py", "request"),
    ("host/program.py", "told"),
    ("host/starter.py", "told"),
    ("worker/worker.py", "request"),
    ("worker/worker.py", "data"),
}
LOOKS = ("get", "pop", "setdefault")


def looked_up(source: str) -> Iterator[tuple[str, str, int]]:
    """Yield each name of the conversation that is spelled as a key: in what, the name, and the line."""
    for node in ast.walk(ast.parse(source)):
        looks: list[tuple[ast.expr, ast.expr | None]] = []
        match node:
            case ast.Subscript(value=value, slice=key):
                looks = [(value, key)]
            case ast.Call(func=ast.Attribute(value=value, attr=attr), args=[key, *_]) if attr in LOOKS:
                looks = [(value, key)]
            case ast.Call(func=ast.Name(id="getattr"), args=[value, key, *_]):
                looks = [(value, key)]
            case ast.Compare(left=key, ops=[ast.In() | ast.NotIn()], comparators=[value]):
                looks = [(value, key)]
            case ast.Dict(keys=keys) if any(isinstance(key, ast.Constant) and key.value == "kind" for key in keys):
                looks = [(ast.Name("{}"), key) for key in keys]
        for of, name in looks:
            if isinstance(name, ast.Constant) and name.value in NAMES:
                yield ast.unparse(of), str(name.value), name.lineno


@pytest.mark.parametrize("side", ["host", "worker"])
def test_no_name_of_the_conversation_is_spelled_as_a_key(side: str) -> None:
    """Host and worker know it by its types: whoever renames a field, or adds one, finds all places."""
    runtime = ROOT / "grader/runtime"
    modules = [path for path in sorted((runtime / side).rglob("*.py")) if path.name != "protocol.py"]
    spelled = [
        f"{module}:{line}: {of}, {name!r}"
        for path in modules
        for module in [path.relative_to(runtime).as_posix()]
        for of, name, line in looked_up(path.read_text("utf-8"))
        if (module, of) not in REQUESTS
    ]
    assert spelled == []


@pytest.mark.parametrize(
    "added",
    [
        'report["idle"]',
        'answer["now_ns"]',
        'report.get("wake_ns")',
        'claim.get("number", 0)',
        'told.pop("untold", None)',
        'getattr(report, "fault", None)',
        'wait() if "match" in answer else None',
        'done = "stop" not in answer',
        'self._link.send({"kind": "arrived"})',
        'said = {"kind": "heard", "early": 1}',
        'report["sent"] = {}',
    ],
)
def test_a_key_that_is_added_is_found(added: str) -> None:
    """In each of the ways in which one could be."""
    assert [*looked_up(f"def f(self, report, answer, claim, told):\n    {added}")] != []
