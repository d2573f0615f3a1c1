"""The optional members of a check of one's own: each is used, and without it the documented value applies."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar

import pytest

from grader.api import NODE_GRAPH, Check, Drawing, Finding, Plot, Roles, Trace, TraceBuilder, met, not_met
from grader.course.authoring.checking import check_rubric
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.judging.plots import chart_of, shows_graph
from grader.grading.model.exercise import has_member, of_beginning, reads_sources, roles_of, texts_under
from grader.grading.rubrics.exercise_checks import known_checks
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.submission import StudentFile, Submission

FLOAT = "std_msgs/msg/Float32"
FLOW = TraceBuilder("pump.py", stop_s=2.0).messages("/flow", FLOAT, {"data": 1.5}, rate_hz=10).trace()


@dataclass(frozen=True)
class Plain:
    """Anything."""

    topic: str = "/flow"

    def judge(self, trace: Trace) -> Finding:
        return met("well")


@dataclass(frozen=True)
class Derived(Check):
    """A check that names the protocol as its base."""

    expected: str = "a parameter of this name"

    def judge(self, trace: Trace) -> Finding:
        return met("well")


@dataclass(frozen=True)
class Drawn(Plain):
    """A check with a drawing."""

    def drawing(self, trace: Trace) -> Any:
        return Drawing((Plot(self.topic),), title="The flow")


@dataclass(frozen=True)
class Graph(Plain):
    """A check about the graph."""

    drawing: ClassVar[str] = NODE_GRAPH


def test_without_a_member_the_documented_value_applies() -> None:
    """For a class that stands alone as for one that derives from the protocol."""
    for check in (Plain(), Derived()):
        assert not reads_sources(check)
        assert of_beginning(check) is check
        assert not has_member(check, "drawing")
        assert roles_of(type(check)) == Roles()
    assert has_member(Derived(), "expected")
    assert not has_member(Plain(), "expected")


def test_a_drawing_is_used_in_place_of_the_general_chart() -> None:
    """Or the graph of nodes and topics."""
    general, own = chart_of(Plain(), FLOW), chart_of(Drawn(), FLOW)
    assert general is not None
    assert own is not None
    assert (general.title, own.title) == ("Messages published on /flow", "The flow")
    assert chart_of(Graph(), FLOW) is None
    assert [shows_graph(check) for check in (Plain(), Drawn(), Graph())] == [False, False, True]


def test_a_drawing_of_another_kind_is_a_mistake() -> None:
    """Grading reports it as one of the author's."""

    @dataclass(frozen=True)
    class Wrong(Plain):
        def drawing(self, trace: Trace) -> Any:
            return [1]

    with pytest.raises(TypeError, match="drawing returned a list, expected a Drawing, a Chart or None"):
        chart_of(Wrong(), FLOW)


ROLES = '''\
from dataclasses import dataclass, fields
from typing import ClassVar

from grader.api import Finding, Roles, Trace, met, not_met


@dataclass(frozen=True)
class Flows:
    """Something comes out."""

    ROLES
    outlet: str

    def judge(self, trace: Trace) -> Finding:
        return met("it flows") if trace.messages(self.outlet) else not_met("nothing comes out")


CHECKS = {"flows": Flows}
'''
RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: pump, number: "7", title: A pump}
files: [pump.py]
checks: [pump_checks.py]
scenarios: [{id: alone, processes: [pump.py], observe: {duration: 2 s}}]
criteria: [{id: flows, title: Flows, points: 1, scenario: alone, check: {flows: {outlet: /flow}}}]
"""
SOURCE = """\
class Pump(Node):
    def __init__(self):
        self.out = self.create_publisher(Float32, "/flux", 10)
        self.create_timer(0.1, self.tick)

    def tick(self):
        self.out.publish(Float32())
"""


@pytest.mark.parametrize("declared", [True, False])
def test_roles_open_the_general_hint_rules(tmp_path: Path, *, declared: bool) -> None:
    """They explain why a topic is silent, whatever its parameter is called."""
    roles = 'roles: ClassVar[Roles] = Roles(topics=("outlet",), speaks=("outlet",))' if declared else "pass"
    (tmp_path / "pump_checks.py").write_text(ROLES.replace("ROLES", roles), encoding="utf-8")
    (tmp_path / "pump.yaml").write_text(RUBRIC, encoding="utf-8")
    trace = TraceBuilder("pump.py", stop_s=2.0).messages("/flux", FLOAT, {"data": 1.5}, rate_hz=10).trace()
    submission = Submission("s", "s", Path("s"), "sha256:1", {"pump.py": StudentFile("pump.py", "pump.py")})
    report = judge_exercise(read_rubric(tmp_path / "pump.yaml"), {"alone": trace}, submission, {"pump.py": SOURCE})
    hint = report.verdicts[0].hint
    assert ("publishes on /flux: the task asks for /flow" in hint) == declared


SERVICES = '''\
from dataclasses import dataclass
from typing import ClassVar

from grader.api import Finding, Roles, Trace, explain_no_client, explain_no_server


@dataclass(frozen=True)
class Asks:
    """A client calls."""

    ROLES
    asked: str

    def judge(self, trace: Trace) -> Finding:
        return explain_no_END(trace, self.asked)


CHECKS = {"asks": Asks}
'''


@pytest.mark.parametrize("declared", [True, False])
@pytest.mark.parametrize(
    ("role", "kind", "line", "said"),
    [
        ("calls", "client", 'self.create_client(Trigger, "/fil")', "asks /fil: the task asks for /fill"),
        (
            "serves",
            "service",
            'self.create_service(Trigger, "/fil", self.fill)',
            "offers /fil: the task asks for /fill",
        ),
    ],
)
def test_roles_open_the_hint_rules_about_services(
    tmp_path: Path, role: str, kind: str, line: str, said: str, *, declared: bool
) -> None:
    """A check of one's own gets what is known about clients and servers that go astray."""
    roles = f'roles: ClassVar[Roles] = Roles(services=("asked",), {role}=("asked",))' if declared else "pass"
    own = SERVICES.replace("ROLES", roles).replace("END", "client" if kind == "client" else "server")
    (tmp_path / "pump_checks.py").write_text(own, encoding="utf-8")
    rubric = RUBRIC.replace("check: {flows: {outlet: /flow}}", "check: {asks: {asked: /fill}}")
    (tmp_path / "pump.yaml").write_text(rubric, encoding="utf-8")
    builder = TraceBuilder("pump.py", stop_s=2.0)
    trace = (builder.client if kind == "client" else builder.server)("/fil", "std_srvs/srv/Trigger").trace()
    submission = Submission("s", "s", Path("s"), "sha256:1", {"pump.py": StudentFile("pump.py", "pump.py")})
    source = f"class Pump(Node):\n    def __init__(self):\n        self.end = {line}\n"
    report = judge_exercise(read_rubric(tmp_path / "pump.yaml"), {"alone": trace}, submission, {"pump.py": source})
    assert (said in report.verdicts[0].hint) == declared


@pytest.mark.parametrize("declared", [True, False])
def test_an_input_that_no_stimulus_gives_is_odd(tmp_path: Path, *, declared: bool) -> None:
    """The check says which of its topics the grader has to play."""
    roles = 'roles: ClassVar[Roles] = Roles(given=("outlet",))' if declared else "pass"
    (tmp_path / "pump_checks.py").write_text(ROLES.replace("ROLES", roles), encoding="utf-8")
    (tmp_path / "pump.yaml").write_text(RUBRIC, encoding="utf-8")
    found = [str(one) for one in check_rubric(tmp_path / "pump.yaml").warnings]
    assert any("no stimulus of alone publishes on /flow" in one for one in found) == declared


@pytest.mark.parametrize("role", ["speaks", "hears", "logs", "given"])
def test_a_declared_topic_has_to_be_written_as_one(tmp_path: Path, role: str) -> None:
    """Its form is checked, as that of a parameter with one of the usual names."""
    roles = f'roles: ClassVar[Roles] = Roles({role}=("outlet",))'
    (tmp_path / "pump_checks.py").write_text(ROLES.replace("ROLES", roles), encoding="utf-8")
    (tmp_path / "pump.yaml").write_text(RUBRIC.replace("outlet: /flow", "outlet: flow"), encoding="utf-8")
    with pytest.raises(Exception, match="expected an absolute topic name"):
        read_rubric(tmp_path / "pump.yaml")


def test_every_role_names_a_parameter() -> None:
    """Of the check that declares it: a name that is mistyped would be ignored."""
    for kind in known_checks().values():
        declared: Roles | None = vars(kind).get("roles")
        if declared is not None:
            held = {field.name for field in fields(kind)}
            ends = (*declared.hears, *declared.speaks, *declared.serves, *declared.calls)
            asked = {*ends, *declared.logs, *declared.given}
            assert asked
            assert asked <= held
    assert texts_under(Plain(), "topic", "nothing") == ("/flow",)
    assert not_met("no").facts is None
