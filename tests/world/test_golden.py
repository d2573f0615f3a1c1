"""Kept recordings of a test: what differs is named, within tolerances; an option writes them."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.world.errors import NoMessage
from grader.world.golden import KeptMessage, compare_with_kept, difference_from_kept, kept_lines, read_kept
from grader.world.world import World

S = 1_000_000_000


def kept(*values: object, topic: str = "/x", t_ns: int = S) -> list[KeptMessage]:
    """Return messages with one value each, a second apart."""
    return [KeptMessage(t_ns * n, topic, "std_msgs/msg/Any", {"a": [{"b": v}]}) for n, v in enumerate(values, 1)]


fields = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
)


@given(values=st.lists(fields, max_size=4))
def test_a_recording_is_read_as_it_was_written(values: list[object], tmp_path_factory: pytest.TempPathFactory) -> None:
    """With infinities and what is no number, which are equal to themselves here."""
    path = tmp_path_factory.mktemp("kept") / "a.jsonl"
    path.write_text(kept_lines(kept(*values)), encoding="utf-8")
    assert difference_from_kept(read_kept(path), kept(*values), {}, 0) == ""


@pytest.mark.parametrize(
    ("now", "says"),
    [
        (kept(1.0, 2.0), ""),
        (kept(1.0, 2.05), ""),
        (kept(1.0, 2.2), "/x, message 2 (t = 2.000 s): expected of a[0].b 2.0, found 2.2"),
        (kept(1.0, "2"), '/x, message 2 (t = 2.000 s): expected of a[0].b 2.0, found "2"'),
        (kept(1.0, True), "/x, message 2 (t = 2.000 s): expected of a[0].b 2.0, found true"),
        (kept(1.0), "/x: expected 2 messages, found 1"),
        (kept(1.0, 2.0, t_ns=S + 1), "/x, message 1: expected at t = 1,000,000,000 ns, found at t = 1,000,000,001 ns"),
        (kept(1.0, 2.0, topic="/y"), "/x: expected 2 messages, found 0"),
    ],
)
def test_the_first_difference_is_named(now: list[KeptMessage], says: str) -> None:
    """Numbers may differ by the tolerance of their topic; times not at all."""
    assert difference_from_kept(kept(1.0, 2.0), now, {"/x": 0.1}, 0) == says


def test_a_file_that_is_no_recording_is_named_with_its_line(tmp_path: Path) -> None:
    """A line of JSON that is no message, and one that is no JSON."""
    message = '{"t_ns": "1", "topic": "/x", "type": "a/msg/B", "message": {}}'
    for line in ("[1]", "{", '{"a": 1}', message, message.replace('"1"', "true"), "\xff", "<<<<<<< HEAD", " "):
        (tmp_path / "a.jsonl").write_bytes((kept_lines(kept(1)) + line).encode("latin-1"))
        with pytest.raises(
            ValueError, match=r"a\.jsonl:2: expected a message of a kept recording, found .*--ros-upd"
        ) as told:
            read_kept(tmp_path / "a.jsonl")
        assert told.value.__context__ is None  # no traceback of a parser


@pytest.mark.parametrize(
    ("tolerance", "says"),
    [
        (-1.0, "tolerance: expected a number of at least 0, found -1.0"),
        (float("nan"), "tolerance: expected a number of at least 0, found nan"),
        ("0.1", "tolerance: expected a number of at least 0, found '0.1'"),
        ({"/ocunt": 0.1}, r"tolerance: expected a topic of the recording, found /ocunt; did you mean /count\?"),
    ],
)
def test_what_is_no_tolerance_is_refused(tmp_path: Path, tolerance: Any, says: str) -> None:
    """Also where nothing differs: it would hide what differs later, or nothing at all."""
    (tmp_path / "a.jsonl").write_text(kept_lines(kept(1.0, topic="/count")), encoding="utf-8")
    with pytest.raises(ValueError, match=says):
        compare_with_kept(tmp_path / "a.jsonl", kept(1.0, topic="/count"), (), tolerance, 0)


@pytest.mark.ros
def test_nothing_is_compared_with_nothing(ros: World) -> None:
    """A name that no program uses, a file of another kind, and a test that has let no time pass; none is written."""
    ros.updates_recordings = True
    with pytest.raises(NoMessage, match=r"kept\.jsonl: no program has published anything by t = 0\.000 s"):
        ros.record("kept.jsonl")
    ros.run(ECHO)
    with pytest.raises(NoMessage, match="/oot: no program publishes on it; there are /out"):
        ros.record("kept.jsonl", "/oot")
    with pytest.raises(ValueError, match=r"test_golden\.py: expected a name that ends with \.jsonl"):
        ros.record("test_golden.py", "/out")
    with pytest.raises(TypeError, match=r"expected the name of a topic, service, action or node, found \['/out'\]"):
        ros.record("kept.jsonl", ["/out"])  # type: ignore[arg-type]
    assert not (Path(__file__).parent / "kept.jsonl").exists()


TEST = """
from std_msgs.msg import String

def test_it(ros):
    ros.run("echo.py")
    ros.publish("/in", String(data="TEXT"), rate=2.0)
    ros.advance(2.0)
    ros.record("kept/echo.jsonl", "/out")
"""
ECHO = Path(__file__).parent / "nodes/echo.py"


@pytest.mark.ros
def test_an_option_writes_what_is_compared(pytester: pytest.Pytester) -> None:
    """Without a recording the test fails; with the option it is written, and the next run is compared with it."""
    (pytester.path / "echo.py").write_text(ECHO.read_text(encoding="utf-8"), encoding="utf-8")

    def run(text: str, *options: str) -> pytest.RunResult:
        pytester.makepyfile(test_it=TEST.replace("TEXT", text))
        return pytester.runpytest_subprocess("-p", "grader.pytest_plugin", "-p", "no:cacheprovider", *options)

    assert "echo.jsonl: expected a recording, found none; pytest --ros-update writes it" in run("a").stdout.str()
    run("a", "--ros-update").assert_outcomes(passed=1)
    kept_text = (pytester.path / "kept/echo.jsonl").read_text(encoding="utf-8").splitlines()
    assert kept_text[0] == '{"t_ns": 0, "topic": "/out", "type": "std_msgs/msg/String", "message": {"data": "a"}}'
    assert len(kept_text) == 5
    run("a").assert_outcomes(passed=1)
    assert '/out, message 1 (t = 0.000 s): expected of data "a", found "b"' in run("b").stdout.str()
