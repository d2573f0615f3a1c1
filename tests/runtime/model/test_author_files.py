"""Files of authors: one that runs in one thread is complete when another thread gets it."""

import sys
import threading
from types import ModuleType

import pytest

from grader.runtime.model.author_files import run_author_file

#: Long enough for a thread to return that does not wait; one that waits makes the test this much longer.
ENOUGH_S = 0.2
CONTENT = b"""
import meeting

meeting.begun.set()
meeting.goes_on.wait()
TABLE = {}
"""


def test_no_thread_sees_half_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    """The second thread gets the module of the first one, with all that it defines."""
    meeting = ModuleType("meeting")
    begun, goes_on = threading.Event(), threading.Event()
    vars(meeting).update(begun=begun, goes_on=goes_on)
    monkeypatch.setitem(sys.modules, "meeting", meeting)
    found: list[list[str]] = []

    def look() -> None:
        found.append([name for name in vars(run_author_file("_met", "/rubric/checks.py", CONTENT)) if name == "TABLE"])

    threads = [threading.Thread(target=look) for _ in range(2)]
    threads[0].start()
    begun.wait()
    threads[1].start()
    threads[1].join(ENOUGH_S)
    goes_on.set()
    for thread in threads:
        thread.join()
    assert found == [["TABLE"], ["TABLE"]]
