"""Reading a student's file: safe for any text, and exact about numbers, code and places."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from diagnosis_samples import RECORDINGS, RIGHT, line_of, lost, report, silent, spoilt
from hypothesis import given
from hypothesis import strategies as st
from work import calls_in

from grader.grading.judging.diagnosis import placed
from grader.grading.judging.diagnosis.wiring import constant_value, goes_to, made
from grader.grading.judging.source import LONGEST_SOURCE, chain, last_line, read_source
from grader.grading.submissions.sources import read_sources
from grader.runtime.model.limits import MAX_SOURCE_BYTES
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import AssessedTrace, FaultKind

FILE = "velocity_publisher.py"
DEEP = 3_000


def silent_trace() -> AssessedTrace:
    return RECORDINGS["silent"][1]().trace("alone")


def wrong_traces() -> list[AssessedTrace]:
    """Recordings that bring as many causes as possible to look at the source."""
    recordings = [
        RECORDINGS["silent"][1](),
        RECORDINGS["paced"][1](10),
        RECORDINGS["paced"][1](400),
        RECORDINGS["bursts"][1](2, 0.05),
        RECORDINGS["once"][1](),
        RECORDINGS["stopped"][1](),
        RECORDINGS["elsewhere"][1]("/cmdvel"),
        RECORDINGS["elsewhere"][1]("/cmd_vel", "std_msgs/msg/String"),
        RECORDINGS["moving"][1]((0.1, 0, 0.1), (0.5, 0, 0)),
        RECORDINGS["printing"][1](),
    ]
    texts = [
        "AttributeError: 'NoneType' object has no attribute 'pose'",
        "AttributeError: 'VelocityPublisher' object has no attribute 'pub'",
        "AssertionError: The 'x' field must be of type 'float'",
        "NameError: name 'self' is not defined",
        "TypeError: tick() takes 0 positional arguments but 1 was given",
        "TypeError: Node.__init__() missing 1 required positional argument: 'node_name'",
        "rclpy.exceptions.NotInitializedException: rclpy.init() has not been called",
        "RecursionError: maximum recursion depth exceeded",
    ]
    for text in texts:
        frames = (f"{FILE}:1 in <module>", f"{FILE}:9 in __init__", f"{FILE}:15 in tick")
        recordings.append(silent(1.0).fault(0.5, FaultKind.EXCEPTION, text, 15, FILE, frames))
    stuck = (FaultKind.HUNG, "did not return", 15, FILE, (f"{FILE}:15 in tick",))
    recordings += [silent(1.0).exited(0.5, process=FILE), silent(1.0).fault(0.5, *stuck)]
    return [rec.trace("alone") for rec in recordings]


WRONG = wrong_traces()


def tokens() -> st.SearchStrategy[str]:
    """Pieces of programs, put together at random: some of them parse."""
    pieces = sorted({row + "\n" for text in RIGHT.values() for row in text.splitlines()})
    more = [
        "        while True:\n",
        "            time.sleep(0.1)\n",
        "        return\n",
        "x = y = x\n",
        "\tpass\n",
        "\x00",
    ]
    return st.lists(st.sampled_from([*pieces, *more]), max_size=40).map("".join)


@given(text=st.one_of(st.text(max_size=300), tokens()), which=st.integers(0, len(WRONG) - 1))
def test_no_source_makes_diagnosis_raise(text: str, which: int) -> None:
    """Neither noise nor programs torn to pieces."""
    report(FILE, {"alone": WRONG[which]}, {FILE: text})


HOSTILE = {
    "one long line": "x = '" + "a" * (1 << 20) + "'",
    "deep brackets": "(" * DEEP + ")" * DEEP,
    "deep lists": "x = " + "[" * 90 + "]" * 90,
    "a long chain": "x = a" + ".b" * DEEP,
    "a long sum": "x = 1" + " + 1" * DEEP,
    "many signs": "x = " + "-" * DEEP + "1",
    "a huge number": "self.create_timer(" + "9" * 4000 + ", self.tick)",
    "a power tower": "self.create_timer(10**10**10**10, self.tick)",
    "a division by zero": "self.create_timer(1 / 0, self.tick)",
    "names in a circle": "a = b\nb = a\nself.create_timer(a, self.tick)",
    "functions in a circle": "def tick():\n    tock()\ndef tock():\n    tick()\nn.create_timer(1, tick)\nn.publish()",
    "null bytes": "import rclpy\x00",
    "a byte order mark": "\ufeff" + RIGHT[FILE],
    "lone surrogates": "x = '\ud800'",
    "bad escapes": "x = '\\d'\nif x is 'y': pass",
    "many timers": "self.create_timer(0.1, self.tick)\n" * 900,
    "many prints": "print('x')\n" * 3_000,
    "many functions": "".join(f"def f{k}():\n    self.get_logger().info('x')\n" for k in range(800)),
    "many loops": "".join(f"while self.a{k}:\n    time.sleep(0.1)\n    p.publish(m)\n" for k in range(500)),
    "nothing": "",
}


@pytest.mark.breadth(4, 8)
@pytest.mark.parametrize("name", sorted(HOSTILE))
def test_hostile_sources_cost_little(name: str) -> None:
    """Whatever the text, explaining a recording takes no more than two million calls, about half a second."""
    for trace in WRONG[::6]:
        assert calls_in(report, FILE, {"alone": trace}, {FILE: HOSTILE[name]}) < 2_000_000


def test_an_ordinary_file_costs_a_hundredth_of_that() -> None:
    """Parsing and all causes together: rules ask once for what several of them need."""
    text = spoilt(FILE, [["create_timer(0.05", "create_timer(0.1"]])
    trace = RECORDINGS["paced"][1](10).trace("alone")
    report(FILE, {"alone": trace}, {FILE: RIGHT[FILE]})  # what is read once, such as rubrics, is read now
    assert calls_in(report, FILE, {"alone": trace}, {FILE: text}) < 20_000


def test_an_empty_file_is_called_empty() -> None:
    """Rather than one whose node does not spin."""
    rec = silent(1.0).exited(0.0, process=FILE)
    rec.items = rec.items[-1:]
    (verdict,) = lost(report(FILE, {"alone": rec.trace("alone")}, {FILE: "\n\n"}))
    assert (verdict.evidence["diagnosis"], verdict.hint) == (
        "empty_file",
        "the file is empty: hand in the one that holds your node",
    )


@pytest.mark.parametrize("limited", [True, False])
def test_a_period_is_not_too_long_for_what_a_limit_cut_short(limited: bool) -> None:
    """A timer of any period may have no turn in it."""
    rec = silent(0.1 if limited else 1.0)
    if limited:
        rec.mark(0.1, "limit", "more than 500 nodes, publishers or subscriptions at once: the rest was ignored")
    text = spoilt(FILE, [["create_timer(0.05", "create_timer(5.0"]])
    verdict = report(FILE, {"alone": rec.trace("alone")}, {FILE: text}).verdicts[0]
    assert ("before the first call" in verdict.hint) is not limited
    assert ("stay below the limit" in verdict.hint) is limited


# --- numbers --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("code", "value"),
    [
        ("0.05", 0.05),
        ("1 / 20", 0.05),
        ("-0.1", -0.1),
        ("1.0 / RATE", 0.1),
        ("period", 0.5),
        ("self.period", 0.25),
        ("float('0.1')", None),
        ("float(2)", 2.0),
        ("self.get_parameter('rate').value", 40.0),
        ("self.get_parameter('rate').get_parameter_value().double_value", 40.0),
        ("self.declare_parameter('other', 3.0).value", 3.0),
        ("self.twice", None),
        ("changed", None),
        ("given", 0.2),
        ("1 / 0", None),
        ("True", None),
        ("unknown", None),
        ("math.pi", 3.141592653589793),
        ("10 ** 10", None),
    ],
)
def test_constants_are_worth_what_the_text_says(code: str, value: float | None) -> None:
    """Names count where they are assigned once; what is changed or unknown is worth nothing."""
    text = f"""
RATE = 10
class N:
    def __init__(self, given=0.2):
        period = 0.5
        changed = 1
        changed += 1
        self.period = period / 2
        self.declare_parameter('rate', 40.0)
        self.twice = 1
        self.call({code})
    def other(self):
        self.twice = 2
"""
    source = read_source("n.py", text)
    (call,) = source.calls("call")
    found = constant_value(source, call.args[0])
    assert (found.value if found else None) == value


def test_the_origin_of_a_constant_is_where_it_is_written_down() -> None:
    """That is the line a student has to change."""
    source = read_source("n.py", "RATE = 10\n\nnode.create_timer(1.0 / RATE, f)\n")
    found = constant_value(source, made(source, "timer")[0].period)
    assert found is not None
    assert source.place(found.origin).line == 1


# --- code -----------------------------------------------------------------------------------------------------------


def test_code_is_quoted_on_one_line() -> None:
    """Several lines are joined, umlauts before it do not shift it, and long code is cut."""
    source = read_source("n.py", "grüße = 'äöü'; f(a,\n      b)\n" + "g(" + "x, " * 200 + ")\n")
    first, second = source.calls("f", "g")
    assert source.code(first) == "f(a, b)"
    assert source.code(second).endswith("…")
    assert len(source.code(second)) == 70


@pytest.mark.parametrize(
    ("code", "dotted"),
    [("self.get_logger().info", "self.get_logger().info"), ("a[0].b", ""), ("a", "a"), ("f()", "f()")],
)
def test_dotted_names(code: str, dotted: str) -> None:
    """Calls are part of them; anything else ends them."""
    statement = ast.parse(code).body[0]
    assert isinstance(statement, ast.Expr)
    assert chain(statement.value) == dotted


@pytest.mark.parametrize(
    ("written", "topic", "same"),
    [
        ("/cmd_vel", "/cmd_vel", True),
        ("cmd_vel", "/cmd_vel", True),
        ("cmd_vel", "/robot/cmd_vel", True),
        ("~/cmd_vel", "/node/cmd_vel", True),
        ("/vel", "/cmd_vel", False),
        (None, "/cmd_vel", False),
    ],
)
def test_topics_as_written_and_on_the_wire(written: str | None, topic: str, same: bool) -> None:
    """Namespaces and private names come before what is written."""
    assert goes_to(written, topic) is same


def test_a_long_file_is_not_parsed() -> None:
    """It keeps the lines that are looked at."""
    source = read_source("n.py", "x = 1\n" * (LONGEST_SOURCE // 4))
    assert source.tree is None
    assert source.line(1) == "x = 1"
    assert last_line(ast.Pass()) == 0


# --- notes ----------------------------------------------------------------------------------------------------------

NOTE = f"{FILE}: nothing calls main(), so `python3 {FILE}` would do nothing; add: if __name__ == '__main__': main()"
ONE = Submission("s", "s", Path("s"), "sha256:1", {FILE: StudentFile(FILE, FILE)})


def test_a_missing_guard_names_the_line_of_main() -> None:
    """The rest of the note stays."""
    text = spoilt(FILE, [["if __name__ == '__main__':\n    main()\n", ""]])
    (note,) = placed((NOTE,), ONE, {FILE: text})
    assert note == NOTE.replace(f"{FILE}:", f"{FILE}:{line_of(text, 'def main')}:", 1)


@pytest.mark.parametrize(
    "guard", ["if __name__ == '_main_':", "if __name__ == 'main':", "if '__name__' == '__main__':"]
)
def test_a_misspelt_guard_is_quoted(guard: str) -> None:
    """With its line and the right one."""
    text = spoilt(FILE, [["if __name__ == '__main__':", guard]])
    (note,) = placed((NOTE,), ONE, {FILE: text})
    assert note.startswith(f"{FILE}:{line_of(text, guard)}: '{guard[:-1]}' is never true")
    assert note.endswith("write: if __name__ == '__main__':")


def test_other_notes_stay() -> None:
    """Those about other files too."""
    notes = ("random.py hides a module", "other.py: nothing calls main(), so nothing happens")
    assert placed(notes, ONE, {FILE: RIGHT[FILE]}) == notes


# --- reading --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (b"x = 1\r\ny = 2\r\n", "x = 1\ny = 2\n"),
        (b"\xef\xbb\xbfx = 1\n", "x = 1\n"),
        ("# -*- coding: latin-1 -*-\n# ü\n".encode("latin-1"), "# -*- coding: latin-1 -*-\n# ü\n"),
        (b"# coding: nonsense\n", None),
        (b"\xff\xfe\n", None),
        (b"#" * (MAX_SOURCE_BYTES + 1), None),
    ],
)
def test_sources_are_read_as_python_reads_them(tmp_path: Path, content: bytes, text: str | None) -> None:
    """What cannot be read so is left out."""
    (tmp_path / "pkg").mkdir()
    (tmp_path / "pkg" / FILE).write_bytes(content)
    files = {FILE: StudentFile(FILE, f"pkg/{FILE}"), "odom_subscriber.py": StudentFile("odom_subscriber.py", None)}
    submission = Submission("s", "s", tmp_path, "sha256:1", files)
    assert read_sources(submission) == ({FILE: text} if text is not None else {})
