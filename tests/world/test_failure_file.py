"""A failed test leaves a file of JSON that follows its schema; and the site tells assistants how to test a node."""

import json
import re
import shlex
from pathlib import Path

import jsonschema
import pytest
from places import ROOT

SCHEMA = json.loads((ROOT / "grader" / "world" / "failure.schema.json").read_text(encoding="utf-8"))
NODE = """
import rclpy
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("echo")
out = node.create_publisher(String, "/out", 10)

def heard(message):
    node.get_logger().info("heard")
    out.publish(String(data=message.data.upper()))

node.create_subscription(String, "/in", heard, 10)
node.create_subscription(String, "/never", heard, 10)
rclpy.spin(node)
"""
TEST = """
import pytest
from std_msgs.msg import String

@pytest.mark.ros(seed=4, between={"/out": {"lose": 0.0}})
def test_it_answers(ros):
    ros.run("echo.py")
    ros.publish("/in", String(data="hello"))
    ros.advance(1.0)
    assert ros.messages("/out")[-1].data == "hello"
"""


@pytest.mark.ros
def test_a_failed_test_is_told_as_json(pytester: pytest.Pytester) -> None:
    """Where, why, who waits for whom, what was published, the seed, and the command that repeats it."""
    (pytester.path / "echo.py").write_text(NODE, encoding="utf-8")
    pytester.makepyfile(test_it=TEST)
    result = pytester.runpytest_subprocess("-p", "grader.pytest_plugin", "-p", "no:cacheprovider", "--ros-no-shrink")
    result.assert_outcomes(failed=1)
    path = next(line for line in result.outlines if line.endswith("failure.json"))
    told = json.loads(Path(path).read_text(encoding="utf-8"))
    jsonschema.validate(told, SCHEMA)
    assert told["test"] == "test_it.py::test_it_answers"
    assert told["error"]["type"] == "AssertionError"
    assert (Path(told["place"]["file"]).name, told["place"]["line"]) == ("test_it.py", 9)
    assert (told["t_s"], told["seed"], told["faults"]) == (1.0, 4, ["lose /out"])
    assert told["waiting"] == ["/echo listens to /never, where nobody publishes"]
    assert [(one["topic"], one["by"], one["messages"]) for one in told["published"]] == [
        ("/in", "test", 1),
        ("/out", "program", 1),
    ]
    assert [one["text"] for one in told["logs"]] == ["heard"]
    assert told["repeat"] == ["pytest", "test_it.py::test_it_answers", "--ros-seed", "4"]
    assert [Path(file).name for file in told["files"]] == ["recording.mcap", "run.html"]


def test_the_page_for_assistants_names_what_is_there() -> None:
    """Three commands, with options and files that exist, and links to pages that do."""
    text = (ROOT / "docs" / "llms.txt").read_text(encoding="utf-8")
    commands = [shlex.split(line) for line in re.findall(r"^    ((?:pip|grade|pytest) .*)$", text, re.MULTILINE)]
    assert [command[0] for command in commands] == ["pip", "grade", "pytest"]
    for path in re.findall(r"`(grader/[\w/.]+)`", text):
        assert (ROOT / path).is_file()
    for page in re.findall(r"\]\(([\w/-]+\.md)[#)]", text):
        assert (ROOT / "docs" / page).is_file()
