"""One student process as the worker sees it: what it wrote, what it reported, how it ended."""

from __future__ import annotations

import json
import os
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.runtime.host.protocol import Exited, Go, Idle, LaunchReport, MessagesArrived, Note, Stop, decoded_answer
from grader.runtime.model.limits import Limits
from grader.runtime.model.trace import FaultKind, LogRecord, OutputLine, Start, StartWay
from grader.runtime.sandbox.protocol import Command
from grader.runtime.worker import student_process as module
from grader.runtime.worker.console import TEXT_CHARACTERS
from grader.runtime.worker.notes import Places
from grader.runtime.worker.student_process import NodeProcess

ROOT = "/submission"
TOKEN = "0123456789abcdef" * 2
#: The process and the line of a student that only writes.
NOBODY: Any = None


class OneFile(Places):
    """A submission of one file, pkg/a.py, with a hundred lines."""

    def __init__(self) -> None:
        super().__init__(None)

    def lines(self, file: str) -> int:
        return 100 if file == "pkg/a.py" else 0


def silent() -> NodeProcess:
    """Return a student whose output a test makes up."""
    return NodeProcess("a.py", ROOT, NOBODY, NOBODY, log_token=TOKEN, file="pkg/a.py", places=OneFile())


def read(stderr: bytes = b"", stdout: bytes = b"", *, final: bool = False) -> list[LogRecord | OutputLine]:
    """Return what a single piece of output comes to."""
    student = silent()
    student._streams["stdout"] += stdout
    student._streams["stderr"] += stderr
    return student.output(7, final=final)


def record(
    text: str = "hello", severity: str = "INFO", file: str = f"{ROOT}/pkg/a.py", line: int = 12, token: str = TOKEN
) -> bytes:
    """Return a log record as the logging library writes it."""
    return f"\x1e{token}\x1f{severity}\x1f/node\x1f{file}\x1f{line}\x1f{text}\x1d\n".encode()


def logged(text: str, severity: str = "INFO", file: str = "pkg/a.py", line: int = 12) -> LogRecord:
    return LogRecord(7, "a.py", severity, "/node", text, file, line)


def printed(text: str, stream: str = "stderr") -> OutputLine:
    return OutputLine(7, "a.py", stream, text)


def test_records_and_lines_are_told_apart() -> None:
    """What went through the logger has its severity, its logger and its place; the rest are lines."""
    assert read(b"before\n" + record() + b"after\n", b"print\n") == [
        printed("print", "stdout"),
        printed("before"),
        logged("hello"),
        printed("after"),
    ]


def test_standard_output_comes_before_standard_error() -> None:
    """Within one instant the order between the two streams is not known, so it is fixed."""
    assert [type(o) for o in read(record(), b"one\ntwo\n")] == [OutputLine, OutputLine, LogRecord]


def test_a_record_keeps_its_line_breaks() -> None:
    """Three lines in one call of the logger are one record."""
    assert read(record("x: 1\ny: 2\r\nz: 3")) == [logged("x: 1\ny: 2\r\nz: 3")]


def test_a_place_outside_the_submission_is_none() -> None:
    """Only the student's own files are named."""
    assert read(record(file="/usr/lib/x.py")) == [logged("hello", file="", line=0)]
    assert read(record(file=f"{ROOT}-other/a.py")) == [logged("hello", file="", line=0)]
    assert read(record(file=f"{ROOT}/../../etc/passwd")) == [logged("hello", file="", line=0)]
    assert read(record(file=f"{ROOT}/pkg/b.py")) == [logged("hello", file="", line=0)]
    assert read(record(line=10**30)) == [logged("hello", file="", line=0)]
    assert read(record(line=100)) == [logged("hello", line=100)]
    assert read(record(line=0)) == [logged("hello", file="", line=0)]


@given(st.integers(min_value=0, max_value=len(record("one\ntwo") + b"and a line\n" + record("three"))))
def test_output_split_anywhere_reads_the_same(cut: int) -> None:
    """A pipe delivers in pieces of its own choosing."""
    whole = record("one\ntwo") + b"and a line\n" + record("three")
    student = silent()
    found = []
    for piece in (whole[:cut], whole[cut:]):
        student._streams["stderr"] += piece
        found += student.output(7)
    assert found == [logged("one\ntwo"), printed("and a line"), logged("three")]


def test_an_unfinished_line_waits_for_its_end() -> None:
    """It gets the instant at which it was finished, or that of the end."""
    student = silent()
    student._streams["stdout"] += b"half"
    assert student.output(1) == []
    student._streams["stdout"] += b" line\nmore"
    assert student.output(2) == [OutputLine(2, "a.py", "stdout", "half line")]
    assert student.output(3, final=True) == [OutputLine(3, "a.py", "stdout", "more")]
    assert student.output(4, final=True) == []


def test_empty_lines_are_nothing() -> None:
    """Only what can be read is written down."""
    assert read(b"\n\r\n", b"\n\na\r\n\n") == [printed("a", "stdout")]


def test_bytes_that_are_not_utf8_stay_visible() -> None:
    """Nothing is lost and nothing raises."""
    assert read(b"", b"\xff\xfe\xc3(\n") == [printed("\\xff\\xfe\\xc3(", "stdout")]


@pytest.mark.parametrize(
    ("hostile", "texts"),
    [
        (b"\x1e\n", ["\x1e"]),
        (b"\x1d\n", ["\x1d"]),
        (record("x", token=""), ["\x1e\x1fINFO\x1f/node\x1fpkg/a.py\x1f12\x1fx\x1d"]),
        (record("x", token="f" * 32), [f"\x1e{'f' * 32}\x1fINFO\x1f/node\x1fpkg/a.py\x1f12\x1fx\x1d"]),
        (f"\x1e{TOKEN}\x1fINFO\x1f\n".encode(), [f"\x1e{TOKEN}\x1fINFO\x1f"]),
        (record("x", severity="info"), [f"\x1e{TOKEN}\x1finfo\x1f/node\x1fpkg/a.py\x1f12\x1fx\x1d"]),
        (
            f"\x1e{TOKEN}\x1fINFO\x1fa\x1fb\x1fone\x1fx\x1d\n".encode(),
            [f"\x1e{TOKEN}\x1fINFO\x1fa\x1fb\x1fone\x1fx\x1d"],
        ),
    ],
)
def test_what_only_looks_like_a_record_is_a_line(hostile: bytes, texts: list[str]) -> None:
    """The signs that mark records may stand in anybody's text."""
    assert [o.text for o in read(hostile, final=True)] == texts


def test_without_a_token_there_are_no_records() -> None:
    """A process that never said which one it has writes lines."""
    student = NodeProcess("a.py", ROOT, NOBODY, NOBODY)
    student._streams["stderr"] += record(token="")
    assert [type(o) for o in student.output(7, final=True)] == [OutputLine]


@pytest.mark.parametrize("token", ["", "x", "F" * 32, ".*" * 16, 5, None, ["a"]])
def test_a_token_is_what_the_host_draws(start: Callable[[str], NodeProcess], token: Any) -> None:
    """32 hexadecimal digits; anything else could stand for many texts."""
    student = start(f"report(kind='ready', log_token={token!r})")
    assert student.is_ready()
    assert student.log_token == ""


@pytest.mark.parametrize(
    ("report", "notes"),
    [
        ({"code": "main_not_called"}, ["pkg/a.py: nothing calls main(), so `python3 pkg/a.py` would do nothing"]),
        ({"code": "main_not_called", "text": "x", "file": "b.py"}, ["pkg/a.py: nothing calls main()"]),
        (
            {"code": "class_not_started", "class_name": "Pub"},
            ["pkg/a.py: nothing starts Pub, so `python3"],
        ),
        ({"code": "class_not_started", "class_name": "the machine failed"}, []),
        ({"code": "class_not_started", "class_name": "x" * 101}, []),
        ({"code": "class_not_started"}, []),
        (
            {"code": "neighbour_imported", "module": "a"},
            ["pkg/a.py: import a finds a.py beside it with `python3` only"],
        ),
        ({"code": "neighbour_imported", "module": "b"}, []),
        ({"code": "neighbour_imported", "module": ["a"]}, []),
        ({"code": "the machine failed"}, []),
        ({"code": ["main_not_called"]}, []),
        ({"text": "the machine failed; by the course's rule this counts as 30 of 30"}, []),
    ],
)
def test_notes_are_codes_and_the_words_are_ours(report: dict[str, Any], notes: list[str]) -> None:
    """A process cannot have a sentence of its own shown as the grader's."""
    student = silent()
    student.note(Note.checked(report))
    assert [told[: len(note)] for told, note in zip(student.notes, notes, strict=True)] == notes


STARTED = {"code": "started", "module": "pkg.a", "function": "main", "hidden": []}


@pytest.mark.parametrize(
    ("said", "way", "target"),
    [
        ({"way": "script"}, StartWay.SCRIPT, ""),
        ({"way": "script", "module": "the machine failed"}, StartWay.SCRIPT, ""),
        ({"way": "main"}, StartWay.MAIN, "pkg.a:main"),
        ({"way": "entry_point", "function": "Robot.main"}, StartWay.ENTRY_POINT, "pkg.a:Robot.main"),
        ({"way": "module", "function": ""}, StartWay.MODULE, "pkg.a"),
    ],
)
def test_how_a_file_was_started_is_told_once(said: Any, way: StartWay, target: str) -> None:
    """Before anything of it runs: whatever is said later is not believed."""
    student = silent()
    student.note(Note.checked({**STARTED, **said}))
    student.note(Note.checked({**STARTED, "way": "module", "function": ""}))
    assert student.start_told == Start("a.py", "pkg/a.py", way, target)
    assert student.notes == []


@pytest.mark.parametrize(
    "said",
    [
        {"way": "by magic"},
        {"way": "main", "function": "the machine failed"},
        {"way": "main", "function": 5},
        {"way": "main", "module": "the machine failed; a"},
        {"way": "main", "module": "other"},
        {"way": "main", "module": None},
        {"way": ["main"]},
    ],
)
def test_what_is_no_way_to_start_a_file_is_dropped(said: Any) -> None:
    """Only names fit."""
    student = silent()
    student.note(Note.checked({**STARTED, **said}))
    assert student.start_told is None


def test_files_that_hide_modules_are_files_of_the_submission() -> None:
    """Any other name is made up."""
    student = silent()
    hidden = ["a.py", "random.py", "../a.py", "pkg/a.py", 5, None]
    student.note(Note.checked({**STARTED, "way": "script", "hidden": hidden}))
    assert student.start_told is not None
    assert student.start_told.hidden == ("a.py",)
    (note,) = student.notes
    assert note.startswith("a.py has the name of a module that Python or ROS needs")


def test_the_record_after_a_broken_one_is_found() -> None:
    """A record that never ends hides no other."""
    assert read(f"\x1e{TOKEN}\x1fINFO\x1fa\x1fb\x1f1\x1fnever ends".encode() + record())[-1] == logged("hello")


def test_standard_output_holds_no_records() -> None:
    """There the signs are text, and keep no line waiting."""
    (line,) = read(b"", record())
    assert isinstance(line, OutputLine)
    assert line.stream == "stdout"
    assert read(b"", b"\x1e\nnext\n") == [printed("\x1e", "stdout"), printed("next", "stdout")]


def test_a_megabyte_of_beginnings_is_read_in_one_go() -> None:
    """A hostile stream costs the worker no more than its length; quadratic reading would take minutes."""
    text = f"\x1e{TOKEN}\x1fINFO\x1fa\x1fb\x1f1\x1f".encode() * 30_000
    found = read(text + b"\n", final=True)
    assert len(found) == 1
    assert len(found[0].text) == TEXT_CHARACTERS


def test_long_texts_are_cut() -> None:
    """One line may not fill a report."""
    assert len(read(record("x" * 10_000))[0].text) == TEXT_CHARACTERS
    assert len(read(b"", b"x" * 10_000 + b"\n")[0].text) == TEXT_CHARACTERS


@settings(deadline=None)
@given(st.lists(st.sampled_from([b"\x1e", b"\x1d", b"\x1f", b"\n", b"INFO", b"1", b"\xff", b"text"]), max_size=30))
def test_no_bytes_raise(pieces: list[bytes]) -> None:
    """Whatever a process writes, it is read, and every sign of it is somewhere."""
    data = b"".join(pieces)
    found = read(data, data, final=True)
    assert "text" not in data.decode("utf-8", "replace") or any("text" in str(vars_of(o)) for o in found)


def vars_of(observation: Any) -> list[Any]:
    return [getattr(observation, name) for name in observation.__slots__]


# --- real processes ---------------------------------------------------------------------------------------------------

BEGIN = """
import json, os, signal, socket, sys, time
line = socket.socket(fileno=int(sys.argv[1]))
def report(**fields): line.sendall(json.dumps(fields).encode() + b"\\n")
"""


@pytest.fixture
def start() -> Iterator[Callable[[str], NodeProcess]]:
    """Start a process that talks as a test says, and end it afterwards."""
    started = []

    def start_one(code: str) -> NodeProcess:
        ours, theirs = socket.socketpair()
        argv = (sys.executable, "-I", "-S", "-u", "-c", BEGIN + code, str(theirs.fileno()))
        student = NodeProcess.start("a.py", ROOT, Command(argv, dict(os.environ), (theirs.fileno(),)), ours, Limits())
        theirs.close()
        started.append(student)
        return student

    yield start_one
    for student in started:
        if student.process.poll() is None:
            os.killpg(student.process.pid, signal.SIGKILL)
            student.process.wait()
        student.close()


def test_a_report_is_read_with_what_was_written_before_it(start: Callable[[str], NodeProcess]) -> None:
    """Output is there when the report is."""
    student = start("print('one'); print('two', file=sys.stderr); report(kind='idle', wake_ns=5)")
    assert student.report() == Idle(wake_ns=5)
    assert student.output(7) == [printed("one", "stdout"), printed("two")]


def test_answers_arrive(start: Callable[[str], NodeProcess]) -> None:
    """The line goes both ways, one JSON object a line."""
    student = start("report(kind='idle'); report(kind='note', code=line.makefile().readline())")
    student.report()
    student.tell(Go(3))
    heard = student.report()
    assert isinstance(heard, Note)
    assert decoded_answer(heard.code.encode()) == Go(3)


def test_two_reports_in_one_piece_are_two(start: Callable[[str], NodeProcess]) -> None:
    """What is there is not lost until it is asked for."""
    student = start('line.sendall(b\'{"kind": "arrived"}\\n{"kind": "idle"}\\n\'); signal.pause()')
    assert [type(student.report()), type(student.report())] == [MessagesArrived, Idle]


@pytest.mark.parametrize(
    "said",
    [
        "b'no json\\n'",
        "b'[1]\\n'",
        "b'1\\n'",
        "b'\\xff\\xfe\\n'",
        "b'\\n'",
        "b'[' * 1000000 + b'\\n'",
        "b'{\"a\":' * 100000 + b'\\n'",
        "b'9' * 10000 + b'\\n'",
    ],
)
def test_what_is_no_report_is_none(start: Callable[[str], NodeProcess], said: Any) -> None:
    """Not JSON, not an object, nested or long beyond reading: not the host's voice."""
    student = start(f"line.sendall({said}); signal.pause()")
    assert student.report() is None


def test_a_report_without_end_is_none(start: Callable[[str], NodeProcess]) -> None:
    """It is not read to its end."""
    student = start("while True: line.sendall(b'x' * 65536)")
    assert student.report() is None
    assert len(student._pending) < module.REPORT_BYTES + (1 << 20)


def test_a_process_that_never_reports_is_given_up(start: Callable[[str], NodeProcess]) -> None:
    """Its host's own watchdog should have been faster."""
    student = start("signal.pause()")
    student.silence_s = 0.0
    assert student.report() is None


@pytest.mark.parametrize(
    ("end", "kind", "text"),
    [
        ("os.kill(os.getpid(), signal.SIGKILL)", FaultKind.KILLED, "ended by SIGKILL"),
        ("os.kill(os.getpid(), signal.SIGSEGV)", FaultKind.KILLED, "ended by SIGSEGV"),
        ("os._exit(137)", FaultKind.KILLED, "ended by SIGKILL"),
        ("os._exit(200)", FaultKind.KILLED, "ended by signal 72"),
        ("os._exit(0)", FaultKind.EXITED, "exited with code 0"),
        ("os._exit(3)", FaultKind.EXITED, "exited with code 3"),
    ],
)
def test_an_end_without_a_word_has_its_reason(
    start: Callable[[str], NodeProcess], end: str, kind: FaultKind, text: str
) -> None:
    """A signal, also one that a sandbox passes on as a code, or an exit."""
    student = start(f"print('last words', end=''); {end}")
    assert student.report() is None
    death = student.death(9)
    assert (death.t_ns, death.process, death.kind, death.text) == (9, "a.py", kind, text)
    student.drain()
    assert [line.text for line in student.output(9, final=True)] == ["last words"]


def test_an_end_has_its_reason_however_long_it_takes(start: Callable[[str], NodeProcess]) -> None:
    """A busy machine may need more than the time that a process is given to end by itself."""
    student = start(f"line.close(); time.sleep({2 * module.GRACE_S}); os.abort()")
    assert student.report() is None
    assert student.death(9).text == "ended by SIGABRT"


def test_a_process_that_closes_its_connection_and_lives_on_is_ended(start: Callable[[str], NodeProcess]) -> None:
    """It could never be asked again."""
    student = start("line.close(); signal.pause()")
    student.closed_s = 0.1
    assert student.report() is None
    assert student.death(9).text == "stopped: it no longer answered the grader"


def test_what_a_program_reports_at_its_end_is_waited_for(start: Callable[[str], NodeProcess]) -> None:
    """A busy machine takes long to end it; what comes after its exit is nobody's."""
    told = "report(kind='written', files=[dict(name='log.txt', content='eA==')]); report(kind='exited', code=0)"
    student = start(f"line.makefile().readline(); time.sleep(0.5); {told}; report(kind='reached', what='x')")
    student.tell(Stop())
    student.last_report(60)
    assert [(file.name, file.content) for file in student.written] == [("log.txt", "eA==")]
    assert student.reached == []


def test_a_program_that_goes_on_after_the_stop_is_not_waited_for(start: Callable[[str], NodeProcess]) -> None:
    """It is ended without its last report."""
    student = start("line.makefile().readline(); signal.pause()")
    student.tell(Stop())
    student.last_report(0.1)
    student.kill()
    assert student.process.returncode == -signal.SIGKILL


def test_a_dead_process_can_be_told_anything(start: Callable[[str], NodeProcess]) -> None:
    """It is noticed at its next report."""
    student = start("os._exit(0)")
    student.process.wait()
    for _ in range(3):
        student.tell(Go(1))
    assert student.report() is None


def test_killing_ends_what_the_process_started(start: Callable[[str], NodeProcess]) -> None:
    """Its whole session goes, grandchildren too."""
    student = start(
        "child = os.fork()\n"
        "if child == 0: signal.pause()\n"
        "signal.signal(signal.SIGTERM, signal.SIG_IGN); report(kind='idle', wake_ns=child); signal.pause()"
    )
    report = student.report()
    assert isinstance(report, Idle)
    child = report.wake_ns
    assert child is not None
    student.kill()
    assert student.process.returncode == -signal.SIGKILL
    while alive(child):  # killed, but its end may take a moment; were it not, this test would hang
        os.sched_yield()


def alive(pid: int) -> bool:
    """Return whether a process runs; a zombie does not, it only waits for its parent."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii", errors="replace") as stat:  # noqa: PTH123
            return stat.read().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
@pytest.mark.parametrize("more", [0, 1, 65536, 300_001])
def test_output_beyond_the_cap_is_read_but_not_kept(
    start: Callable[[str], NodeProcess], stream: str, more: int
) -> None:
    """The process goes on, the trace stays small, and one note says so; exactly the cap is not beyond it."""
    most = Limits().output_bytes
    length = most + more
    student = start(f"sys.{stream}.write('x' * {length}); sys.{stream}.flush(); report(kind='idle')")
    assert isinstance(student.report(), Idle)
    student.drain()
    assert student._kept[stream] == length
    assert len(student._streams[stream]) == most
    assert student.notes == ([f"a.py: more than 4 MiB on {stream}: the rest was ignored"] if more else [])


def test_endless_output_does_not_keep_the_report_away(start: Callable[[str], NodeProcess]) -> None:
    """Both are read side by side."""
    student = start(
        "import threading\n"
        "def flood():\n"
        "    while True: os.write(1, b'spam' * 1000 + b'\\n')\n"
        "threading.Thread(target=flood, daemon=True).start()\n"
        "while True: report(kind='idle'); line.recv(100)"
    )
    for _ in range(20):
        assert isinstance(student.report(), Idle)
        student.tell(Go())
    assert len(student._streams["stdout"]) <= Limits().output_bytes


def test_reports_that_are_there_are_taken_without_waiting(start: Callable[[str], NodeProcess]) -> None:
    """For the wall clock: what has come, then None if the process is gone without a word."""
    student = start("report(kind='note'); report(kind='launched'); line.recv(1)")
    found: list[Any] = []
    while len(found) < 2:
        found += student.reports()
    assert [type(report) for report in found] == [Note, LaunchReport]
    assert student.reports() == []
    student.tell(Go())
    while not (found := student.reports()):
        pass
    assert found == [None]


def test_a_process_that_said_goodbye_is_not_lost(start: Callable[[str], NodeProcess]) -> None:
    """Its last report is its end; the closed line adds nothing."""
    student = start("report(kind='exited', code=0)")
    found: list[Any] = []
    while not found:
        found += student.reports()
    assert found == [Exited(code=0)]


def test_a_closed_stream_is_no_end(start: Callable[[str], NodeProcess]) -> None:
    """A program may close its own output and live on."""
    student = start("os.close(1); os.close(2); report(kind='idle'); line.recv(1); report(kind='idle')")
    assert isinstance(student.report(), Idle)
    student.tell(Go())
    assert isinstance(student.report(), Idle)
    assert json.dumps(student.notes) == "[]"


def test_the_prefix_of_packages_reads_the_same_in_each_run() -> None:
    """Its folder has another name each time; as a launch file it is told of the one in the home."""
    student = silent()
    student.prefix = "/tmp/grade-run-4711/installed"
    student._streams["stdout"] += b"/tmp/grade-run-4711/installed: /tmp/grade-run-4711/installed/share/a\n"
    (line,) = student.output(7, final=True)
    assert line.text == "/tmp/home/installed: share/a"
