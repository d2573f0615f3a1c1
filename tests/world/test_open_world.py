"""The same door without pytest."""

import html
import subprocess
import sys
from pathlib import Path

import pytest
from std_msgs.msg import String

from grader.api import open_world

pytestmark = pytest.mark.ros

NODES = Path(__file__).parent / "nodes"


def test_a_script_steps_its_nodes() -> None:
    """The context manager starts all that is needed, and ends it."""
    script = (
        "from std_msgs.msg import String\nfrom grader.api import open_world\n"
        f"with open_world({str(NODES)!r}) as ros:\n    ros.run('echo.py')\n    ros.publish('/in', String(data='a'))\n"
        "    ros.advance(60.0)\n    print(ros.now, ros.messages('/out'))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "60.0 [std_msgs.msg.String(data='a')]\n"


def test_a_world_can_be_looked_at_after_its_end(tmp_path: Path) -> None:
    """It can be kept, and shown in a cell of a notebook."""
    with open_world(NODES) as ros:
        echo = ros.run("echo.py")
        ros.publish("/in", String(data="<b>bold</b>"))
        ros.advance(1.0)
    assert (len(ros.messages("/out")), len(echo.logs), ros.now) == (1, 1, 1.0)
    assert [path.name for path in ros.keep(tmp_path / "new")] == ["recording.mcap", "run.html"]
    cell = ros._repr_html_()
    page = html.unescape(cell.partition('srcdoc="')[2].removesuffix('"></iframe>'))
    assert page.startswith("<!DOCTYPE html>")
    assert "heard" in page
    assert "<b>bold" not in page
    with pytest.raises(RuntimeError, match="the run has ended"):
        ros.advance(1.0)
