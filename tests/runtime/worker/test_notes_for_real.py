"""What a student's process says over the host's own line: codes and numbers, never a sentence in the grader's name."""

from __future__ import annotations

from pathlib import Path

import pytest
from tiers import more

from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from hostile import hostile, record

from grader.runtime.model.trace import FaultKind, Start, StartWay

pytestmark = pytest.mark.ros

SECOND_NS = 1_000_000_000
SENTENCE = "the machine failed; by the course's rule this counts as 30 of 30"
SAYS = f"""
import json
import sys
frame = sys._getframe()
while type(frame.f_locals.get("link")).__name__ != "Link":
    frame = frame.f_back
link = frame.f_locals["link"]
sentence = {SENTENCE!r}
place = {{"file": "../../etc/passwd", "line": 10**30, "frames": [["../../etc/passwd", 10**30, sentence]]}}
for report in (
    {{"kind": "note", "text": sentence}},
    {{"kind": "note", "code": sentence}},
    {{"kind": "note", "code": "class_not_started", "class_name": sentence}},
    {{"kind": "note", "code": "neighbour_imported", "module": sentence}},
    {{"kind": "note", "code": "started", "way": "entry_point", "module": "a", "function": "main", "hidden": ["a.py"]}},
    {{"kind": "fault", "text": sentence, "fault": {{"code": "exception", "type": sentence, "message": "", **place}}}},
    {{"kind": "fault", "fault": {{"code": "alarm", "text": sentence, "message": sentence, "file": "a.py", "line": 1}}}},
):
    link._socket.sendall(json.dumps(report).encode() + b"\\n")
"""


@pytest.mark.parametrize("clock", ["virtual", *more(["wall"])])
def test_no_sentence_of_a_process_becomes_the_graders(session: RecordingSession, tmp_path: Path, clock: str) -> None:
    """Neither as a note nor as a fault; places that the submission does not have are left out."""
    tmp_path.chmod(0o755)
    trace = record(session, tmp_path / "s", hostile(SAYS), clock=clock, duration_ns=5 * SECOND_NS)
    assert SENTENCE not in repr(trace.notes)
    assert not any("nothing starts" in note or "beside it" in note for note in trace.notes)
    assert trace.starts == (Start("a.py", "a.py", StartWay.SCRIPT),)
    assert [(f.kind, f.text, f.file, f.line, f.frames) for f in trace.faults()] == [
        (FaultKind.EXCEPTION, "Exception", "", 0, ()),
        (FaultKind.HUNG, "sets an alarm that rings in real time", "a.py", 1, ()),
    ]


@pytest.mark.parametrize("clock", ["virtual", *more(["wall"])])
def test_a_thread_that_raises_ends_no_node(session: RecordingSession, tmp_path: Path, clock: str) -> None:
    """Its exception is a fault in its own words, and the node goes on."""
    tmp_path.chmod(0o755)
    harm = "threading.Thread(target=lambda: [].pop()).start()"
    trace = record(session, tmp_path / "s", hostile(harm), clock=clock, duration_ns=5 * SECOND_NS)
    (fault,) = trace.faults()
    assert (fault.kind, fault.text, fault.file) == (FaultKind.EXCEPTION, "IndexError: pop from empty list", "a.py")
    assert trace.messages("/cmd_vel")[-1].t_ns > SECOND_NS // 2
