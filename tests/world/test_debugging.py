"""`--ros-debug` opens pdb in a program of a test, at a terminal and through what pytest captures."""

import json
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pexpect
import pytest

pytestmark = pytest.mark.ros

NODE = """\
import rclpy
from std_msgs.msg import Int32

rclpy.init()
node = rclpy.create_node("counts")
out = node.create_publisher(Int32, "/count", 10)
count = 40


def on_timer():
    global count
    count += 1
    if count == 42:
        breakpoint()
    out.publish(Int32(data=count))


node.create_timer(1.0, on_timer)
rclpy.spin(node)
"""

TESTS = """\
def test_values(ros):
    ros.run("counts.py")
    ros.advance(3.0)
    assert [(one.t, one.message.data) for one in ros.received("/count")] == [(1.0, 41), (2.0, 7), (3.0, 8)]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a node that stops at a breakpoint, and a test of it."""
    (tmp_path / "counts.py").write_text(NODE, encoding="utf-8")
    (tmp_path / "test_it.py").write_text(TESTS, encoding="utf-8")
    return tmp_path


def test_pdb_changes_a_value_while_virtual_time_waits(folder: Path) -> None:
    """The terminal that pytest was started at is the debugger's, though pytest captures all three streams."""
    command = [*("-m", "pytest", "-p", "grader.pytest_plugin", "-p", "no:cacheprovider", "--ros-debug", "test_it.py")]
    # no time-out: the end of the process ends the wait as well
    with pexpect.spawn(sys.executable, command, cwd=str(folder), timeout=None, encoding="utf-8") as shell:
        assert shell.expect(["counts.py has stopped, and virtual time with it", pexpect.EOF]) == 0
        assert shell.expect([r"\(Pdb\) ", pexpect.EOF]) == 0
        shell.sendline("count")
        assert shell.expect([r"\r\n42\r\n", pexpect.EOF]) == 0
        shell.sendline("globals()['count'] = 7")
        shell.sendline("c")
        shell.expect(pexpect.EOF)
        text = shell.before
    assert "1 passed" in text, text


def test_a_breakpoint_without_a_debugger_names_the_option(folder: Path) -> None:
    """The program ends with BdbQuit, because pdb has nothing to read."""
    command = [sys.executable, "-m", "pytest", "-p", "grader.pytest_plugin", "-p", "no:cacheprovider", "test_it.py"]
    done = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    told = "counts.py: there is no debugger at its breakpoint; pytest --ros-debug opens one"
    assert told in done.stdout.splitlines(), done.stdout


class Editor:
    """The part of the Debug Adapter Protocol that an editor needs to attach itself and change a value."""

    def __init__(self, connection: socket.socket) -> None:
        self._line = connection.makefile("rwb")
        self._sent = 0

    def ask(self, command: str, **arguments: Any) -> Any:
        self.say(command, **arguments)
        return self.await_message(lambda message: message.get("command") == command)

    def say(self, command: str, **arguments: Any) -> None:
        self._sent += 1
        data = json.dumps({"seq": self._sent, "type": "request", "command": command, "arguments": arguments}).encode()
        self._line.write(b"Content-Length: %d\r\n\r\n%s" % (len(data), data))
        self._line.flush()

    def await_message(self, is_wanted: Callable[[Any], bool]) -> Any:
        while True:
            header = self._line.readline() + self._line.readline()
            message = json.loads(self._line.read(int(header.split()[1])))
            if is_wanted(message):
                return message

    def close(self) -> None:
        self._line.close()


def test_an_editor_attaches_itself_and_virtual_time_waits(folder: Path) -> None:
    """The program waits at its breakpoint until the editor is there, which is outside of its network otherwise."""
    command = [
        *("-m", "pytest", "-p", "grader.pytest_plugin", "-p", "no:cacheprovider"),
        "--ros-debug-port=0",
        "test_it.py",
    ]
    with pexpect.spawn(sys.executable, command, cwd=str(folder), timeout=None, encoding="utf-8") as shell:
        assert shell.expect([r"counts.py waits for a debugger at 127.0.0.1:(\d+),", pexpect.EOF]) == 0, shell.before
        assert shell.match is not None
        with socket.create_connection(("127.0.0.1", int(shell.match[1]))) as connection:
            editor = Editor(connection)
            editor.ask("initialize", adapterID="test", pathFormat="path")
            editor.say("attach", name="test")
            editor.await_message(lambda message: message.get("event") == "initialized")
            editor.say("configurationDone")
            stopped = editor.await_message(lambda message: message.get("event") == "stopped")
            thread = stopped["body"]["threadId"]
            frame = editor.ask("stackTrace", threadId=thread)["body"]["stackFrames"][0]
            assert frame["name"] == "on_timer"
            assert frame["source"]["path"] == str(folder / "counts.py")
            editor.ask("evaluate", expression="globals().update(count=7)", frameId=frame["id"], context="repl")
            editor.ask("continue", threadId=thread)
            editor.ask("disconnect")
            editor.close()
        shell.expect(pexpect.EOF)
        assert "1 passed" in shell.before


def test_without_a_terminal_it_says_so(folder: Path, pytester: pytest.Pytester) -> None:
    """Nobody would answer the debugger: the program would read the end of a file, and end with BdbQuit."""
    arguments = ("-p", "grader.pytest_plugin", "--ros-debug", f"--rootdir={folder}", str(folder))
    found = pytester.runpytest_subprocess(*arguments)
    assert "--ros-debug: expected a terminal, found none" in found.stdout.str()
