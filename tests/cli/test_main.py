"""The command line: arguments, destinations, exit codes, and every way a run can end."""

import json
import os
import re
import shutil
import subprocess
import sys
import time
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import click
import pytest
from cli_samples import a_report
from click.testing import CliRunner, Result
from places import ROOT
from tracing import ODOMETRY

import grader
from grader.cli import interactive, main
from grader.grading.app.request import GradeRequest
from grader.grading.model.exercise import Outcome
from grader.grading.model.report import Report
from grader.grading.rubrics.builtin import builtin_exercises
from grader.runtime.model import errors


class Session:
    """Stands in for the run: remembers the request, returns or raises what it was told to."""

    def __init__(self) -> None:
        self.requests: list[GradeRequest] = []
        self.result: Report | BaseException = a_report()
        self.pictures = True
        self.opened_for: list[GradeRequest] = []
        self.saves: Callable[[Path], Iterator[bool]] = lambda path: iter(())

    def opened_early(self, *_: object) -> AbstractContextManager[None]:
        return nullcontext()

    def opened(self, request: GradeRequest, progress: object) -> AbstractContextManager[Any]:
        self.opened_for.append(request)
        return nullcontext()

    def grade_once(
        self, request: GradeRequest, progress: Callable[[str], None], *_: object, pictures: bool, session: object
    ) -> Report:
        self.requests.append(request)
        self.pictures = pictures
        progress("exercise 1: alone")
        if isinstance(self.result, BaseException):
            raise self.result
        return self.result

    def call(self, *arguments: str, app: main.CommandLine = main.app, started: float | None = None) -> Result:
        """Call the command line with this session."""
        given = main.Invocation(time.monotonic() if started is None else started, lambda: self, self.saves)
        return CliRunner().invoke(app, list(arguments), prog_name="grade", obj=given)


@pytest.fixture
def run_session() -> Session:
    return Session()


def grade(*arguments: str, **kwargs: Any) -> Result:
    return CliRunner().invoke(main.app, list(arguments), prog_name="grade", **kwargs)


def test_the_everyday_form_prints_the_text_report(run_session: Session) -> None:
    """A path and nothing else is enough."""
    result = run_session.call("ada")
    assert result.exit_code == 0
    assert result.stdout.startswith("ada: 10 of 10 points\n")
    assert result.stderr == ""
    assert run_session.requests == [GradeRequest(submission="ada")]


def test_every_option_reaches_the_session(run_session: Session) -> None:
    """What is asked for is what is graded; a repeated exercise is graded once."""
    options = ["--exercise", "b", "--exercise", "a", "--exercise", "b", "--seed", "5", "--recording", f"{ODOMETRY}=bag"]
    options += ["--rubric", "r1.yaml", "--rubric", "r2.yaml", "--clock", "wall", "--isolation", "none", "--no-progress"]
    options += ["--time-budget", "20"]
    result = run_session.call(*options, "ada")
    assert result.exit_code == 0, result.output
    assert run_session.requests == [
        GradeRequest(
            submission="ada",
            exercises=("b", "a"),
            rubrics=(Path("r1.yaml"), Path("r2.yaml")),
            seed=5,
            bags=((ODOMETRY, Path("bag")),),
            clock="wall",
            isolation="none",
            time_budget_s=20,
        )
    ]


def test_options_may_follow_the_submission(run_session: Session) -> None:
    """Order does not matter."""
    assert run_session.call("ada", "--seed", "5").exit_code == 0
    assert run_session.requests[0].seed == 5


@pytest.mark.parametrize(
    ("outcomes", "options", "code"),
    [
        ((Outcome.MET, Outcome.MET), (), 0),
        ((Outcome.MET, Outcome.PARTLY), (), 1),
        ((Outcome.MET, Outcome.NOT_MET), (), 1),
        ((Outcome.MET, Outcome.BLOCKED), (), 1),
        ((Outcome.MET, Outcome.UNDECIDED), (), 3),
        ((Outcome.MET, Outcome.PARTLY), ("--min-score", "75"), 0),
        ((Outcome.MET, Outcome.PARTLY), ("--min-score", "75.1"), 1),
        ((Outcome.NOT_MET,), ("--min-score", "0"), 0),
        ((Outcome.MET, Outcome.MET), ("--min-score", "100"), 0),
        ((Outcome.MET, Outcome.UNDECIDED), ("--min-score", "10"), 3),
        ((Outcome.MET, Outcome.PARTLY, Outcome.MET), ("--min-score", "83.3"), 0),
        ((Outcome.MET, Outcome.PARTLY, Outcome.MET), ("--min-score", "83.34"), 1),
    ],
)
def test_the_exit_code_says_how_it_went(
    run_session: Session, outcomes: tuple[Outcome, ...], options: tuple[str, ...], code: int
) -> None:
    """0 all met or the share reached, 1 not, 3 undecided whatever the share."""
    run_session.result = a_report(*outcomes)
    result = run_session.call("ada", *options)
    assert result.exit_code == code
    assert "points" in result.stdout


def test_json_prints_the_report_and_nothing_else(run_session: Session) -> None:
    """Standard output can be piped into a parser."""
    result = run_session.call("ada", "--json")
    assert json.loads(result.stdout)["schema"] == "grader/report/v1"
    assert result.stderr == ""


def test_reports_go_to_files_as_well(run_session: Session, tmp_path: Path) -> None:
    """The text is still printed; files are plain and in UTF-8."""
    result = run_session.call("ada", "-o", f"json={tmp_path / 'r.json'}", "--output", f"text={tmp_path / 'r.txt'}")
    assert result.exit_code == 0
    assert json.loads((tmp_path / "r.json").read_bytes())["score"] == 10
    assert "Criterion 0 ±" in (tmp_path / "r.txt").read_text(encoding="utf-8")
    assert "ada: 10 of 10" in result.stdout
    assert sorted(p.name for p in tmp_path.iterdir()) == ["r.json", "r.txt"]


def test_a_dash_prints_that_format_instead(run_session: Session, tmp_path: Path) -> None:
    """One report on standard output, the chosen one."""
    result = run_session.call("ada", "-o", "json=-", "-o", f"text={tmp_path / 'r.txt'}")
    assert json.loads(result.stdout)["score"] == 10


@pytest.mark.parametrize(
    ("arguments", "message", "hint"),
    [
        (("ada", "--watch", "--json"), "--watch prints a report after each save", "grade --help"),
        (("ada", "--watch", "-o", "evidence=x"), "--watch prints a report after each save", "grade --help"),
        (("ada", "bert"), "expected one submission, found 2: ada bert", "grade --help"),
        (("ada", "--sed", "5"), "--seed", "grade --help"),
        (("ada", "--seed", "-1"), "x>=0", "grade --help"),
        (("ada", "--seed", "many"), "'many' is not a valid integer", "grade --help"),
        (("ada", "--clock", "sundial"), "'sundial' is not one of", "grade --help"),
        (("ada", "--isolation", "docker"), "'docker' is not one of", "grade --help"),
        (("ada", "--min-score", "101"), "expected 0 to 100, found 101", "grade --help"),
        (("ada", "--min-score", "nan"), "expected 0 to 100, found nan", "grade --help"),
        (("ada", "-o", "json"), "expected FORMAT=PATH, found 'json'", "grade --help"),
        (("ada", "-o", "jsn=x"), "'jsn' is not a format; did you mean json?", "grade --help"),
        (("ada", "-o", "docx=x"), "there are json, text", "grade --help"),
        (("ada", "--json", "-o", "text=-"), "standard output: expected one report, found more", "to files"),
        (("ada", "-o", "json=x", "-o", "text=./x"), "x: expected one report, found more", "its own file"),
        (("ada", "-o", "json=/proc/none/r"), "/proc/none/r: the json report cannot be written", ""),
        (("ada", "-o", "text=."), "the text report cannot be written: Is a directory", ""),
    ],
)
def test_a_wrong_command_is_one_line_and_nothing_is_graded(
    run_session: Session, arguments: tuple[str, ...], message: str, hint: str
) -> None:
    """Exit code 2, what is wrong, what to do; before any work is done."""
    result = run_session.call(*arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    lines = result.stderr.splitlines()
    assert lines[0].startswith("error: ")
    assert message in lines[0]
    assert (lines[1:] == []) if not hint else (lines[1].startswith("hint: ") and hint in lines[1])
    assert len(lines) <= 2
    assert run_session.requests == []


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.SubmissionError("ada: no such folder", "check the path"), 2),
        (errors.RubricError("r.yaml:1:1: expected points", "add points"), 2),
        (errors.RecordingError("bag: no odometry", "record /odom"), 2),
        (errors.EnvironmentFault("rclpy: not found", "install it"), 2),
        (errors.HarnessError("the worker ended twice", "grade again"), 3),
    ],
)
def test_a_grader_error_is_a_line_and_a_hint(run_session: Session, error: errors.GraderError, code: int) -> None:
    """Whoever must act reads what is wrong and one thing to do."""
    run_session.result = error
    result = run_session.call("ada", "--json")
    assert result.exit_code == code
    assert result.stdout == ""
    assert result.stderr == f"error: {error.message}\nhint: {error.hint}\n"


def test_several_mistakes_are_several_lines(run_session: Session) -> None:
    """A rubric's author sees all of them at once; without a hint there is no empty one."""
    run_session.result = errors.RubricError("r.yaml:1:1: one\nr.yaml:2:1: two")
    assert run_session.call("ada").stderr == "error: r.yaml:1:1: one\nerror: r.yaml:2:1: two\n"


def test_an_error_cannot_steer_the_terminal(run_session: Session) -> None:
    """File names of a student end up in messages."""
    run_session.result = errors.SubmissionError("a\x1b[2J\udcff: no", "b\x07")
    assert run_session.call("ada").stderr == "error: a\\x1b[2J\\udcff: no\nhint: b\\x07\n"
    run_session.result = errors.SubmissionError("a\nerror: forged")
    assert run_session.call("ada").stderr == "error: a\\nerror: forged\n"


def test_a_mistake_of_ours_is_no_low_score(run_session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit code 3 and one line; the traceback only for those who ask."""
    run_session.result = KeyError("secret")
    monkeypatch.delenv("GRADER_DEBUG", raising=False)
    result = run_session.call("ada")
    assert result.exit_code == 3
    assert result.stderr == "error: the grader failed: KeyError: 'secret'\nhint: GRADER_DEBUG=1 shows where\n"
    monkeypatch.setenv("GRADER_DEBUG", "1")
    assert "Traceback (most recent call last)" in run_session.call("ada").stderr


@pytest.mark.parametrize("error", [KeyboardInterrupt(), click.Abort()])
def test_an_interrupt_is_one_line(run_session: Session, error: BaseException) -> None:
    """Ctrl-C ends in 130, without a traceback and without a report."""
    run_session.result = error
    result = run_session.call("ada", "--json")
    assert (result.exit_code, result.stdout) == (130, "")
    assert result.stderr == "interrupted: no report was made\n"


def test_an_end_of_input_of_ours_is_no_interrupt(run_session: Session) -> None:
    """Only Ctrl-C is called one."""
    run_session.result = EOFError("worker")
    assert run_session.call("ada").exit_code == 3


def test_a_report_that_cannot_be_written_does_not_keep_the_others_back(
    run_session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk filled up while grading: what can be delivered is."""
    path = tmp_path / "r.json"

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    result = run_session.call("ada", "-o", f"json={path}")
    assert result.exit_code == 2
    assert "ada: 10 of 10" in result.stdout
    assert result.stderr == f"error: {path}: the json report cannot be written: No space left on device\n"
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_said_while_grading_unless_stderr_is_a_terminal(run_session: Session) -> None:
    """Logs of a build server stay clean."""
    assert run_session.call("ada").stderr == ""


def test_help_names_every_option_and_the_exit_codes(run_session: Session) -> None:
    """Both spellings, before and after the submission, show the same."""
    text = run_session.call("--help").stdout
    for word in ("--exercise ID", "--seed N", "--recording", "--json", "FORMAT=PATH", "--rubric", "--min-score P"):
        assert word in text
    for word in (
        "--clock [virtual|wall|auto]",
        "--isolation [auto|bubblewrap-root|",
        "--no-progress",
        "--version",
        "130",
    ):
        assert word in text
    assert run_session.call("-h").stdout == run_session.call("ada", "--help").stdout == text


def test_the_version_is_the_package_s(run_session: Session) -> None:
    """One number, in one place."""
    assert run_session.call("--version").stdout == f"grade {grader.__version__}\n"


@pytest.fixture
def with_batch() -> main.CommandLine:
    """A group like ours with a subcommand beside the everyday one."""

    @click.command()
    @click.argument("folder")
    def batch(folder: str) -> int:
        """Grade a class."""
        click.echo(f"batch {folder}")
        return 1

    app = main.CommandLine(main.app.default, name="grade", context_settings=main.app.context_settings)
    app.add_command(batch)
    return app


def test_a_subcommand_fits_beside_the_everyday_form(run_session: Session, with_batch: main.CommandLine) -> None:
    """Its name as the first argument calls it; its return value is the exit code; help lists it."""
    result = CliRunner().invoke(with_batch, ["batch", "hw"])
    assert (result.stdout, result.exit_code) == ("batch hw\n", 1)
    assert "Grade a class." in CliRunner().invoke(with_batch, ["--help"]).stdout
    assert "FOLDER" in CliRunner().invoke(with_batch, ["batch", "--help"]).stdout


@pytest.mark.parametrize("arguments", [["./batch"], ["--json", "batch"], ["--", "batch"]])
def test_a_folder_named_like_a_subcommand_is_graded(
    run_session: Session, with_batch: main.CommandLine, arguments: list[str]
) -> None:
    """Only the bare first word is a command."""
    assert run_session.call(*arguments, app=with_batch).exit_code == 0
    assert Path(run_session.requests[0].submission) == Path("batch")


@pytest.mark.parametrize(
    "files",
    [
        {"odom_subscriber.py": ""},
        {"src/pkg/pkg/fan_controller.py": ""},
        {"package.xml": "", "pkg/fan_controller.py": ""},
        {"my_node.py": "import rclpy"},
    ],
)
def test_the_current_folder_is_graded_if_it_holds_an_exercise(
    run_session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, files: dict[str, str]
) -> None:
    """A folder of files, a workspace, a package, or a node under another name."""
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    assert run_session.call().exit_code == 0
    assert [request.submission for request in run_session.requests] == ["."]


def test_elsewhere_the_command_alone_shows_examples(
    run_session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A home folder is not graded because a homework lies somewhere in it."""
    (tmp_path / "homework").mkdir()
    (tmp_path / "homework" / "odom_subscriber.py").touch()
    (tmp_path / "notes.py").write_text("print(1)")
    monkeypatch.chdir(tmp_path)
    result = run_session.call()
    assert (result.exit_code, result.stdout, run_session.requests) == (2, "", [])
    assert result.stderr.startswith("error: expected a submission: this folder holds no exercise file, such as ")
    assert "grade homework --exercise 1" in result.stderr


@pytest.mark.parametrize(("display", "asked"), [(":0", True), ("", False)])
@pytest.mark.parametrize("named", [False, True])
def test_open_shows_the_page_in_a_browser(
    run_session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, display: str, asked: bool, named: bool
) -> None:
    """In the current folder unless named; without a display it says where the page is, and what to do."""
    opened: list[str] = []

    def open_(url: str) -> bool:
        opened.append(url)
        return True

    monkeypatch.setattr(webbrowser, "open", open_)
    for name in ("BROWSER", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.chdir(tmp_path)
    result = run_session.call("ada", "--open", *(["-o", "html=page.html"] if named else []))
    page = tmp_path / ("page.html" if named else "grade-report.html")
    assert result.exit_code == 0
    assert list(tmp_path.iterdir()) == [page]
    assert run_session.pictures is True
    assert opened == ([page.as_uri()] if asked else [])
    note = [] if asked else ["note: no browser could be opened here; open the page in one, on any computer"]
    assert result.stderr.splitlines() == [f"page: {page}", *note]


def test_watch_grades_after_each_save_until_it_is_interrupted(run_session: Session, tmp_path: Path) -> None:
    """One session for all; an error is said and waited out; the exit code is that of the last report."""

    def three(path: Path) -> Iterator[bool]:
        yield False
        run_session.result = errors.SubmissionError("no file", "save one")
        yield True
        run_session.result = a_report(Outcome.NOT_MET)
        yield True
        raise KeyboardInterrupt

    run_session.saves = three
    result = run_session.call(str(tmp_path), "--watch")
    assert (result.exit_code, len(run_session.opened_for), len(run_session.requests)) == (1, 1, 3)
    assert result.stdout.count("points\n") == 2
    assert result.stderr.splitlines().count("error: no file") == 1
    assert result.stderr.count("watching for the next save") == 3


def test_the_time_shown_is_the_time_since_the_start_of_the_process(run_session: Session) -> None:
    """Imports and the end of the session count, because the user waited for them."""
    result = run_session.call("ada", started=time.monotonic() - 3600)
    assert re.search(r"graded \./ada in 36\d\d\.\d s", result.stdout)


def replaced(folder: Path) -> None:
    shutil.move(folder, folder.with_name("old"))
    folder.mkdir()


@pytest.mark.parametrize(
    ("change", "watched"),
    [
        (lambda folder: (folder / "a.py").write_text("x = 2"), "."),
        (lambda folder: (folder / "tmp").write_text("x = 2") and (folder / "tmp").replace(folder / "a.py"), "."),
        (lambda folder: (folder / "tmp").write_text("x = 2") and (folder / "tmp").replace(folder / "a.py"), "a.py"),
        (lambda folder: (folder / "a.py").unlink(), "a.py"),
        (lambda folder: (folder / "pkg" / "b.py").touch(), "."),
        (replaced, "."),
    ],
)
def test_a_save_is_noticed_however_it_is_made(tmp_path: Path, change: Callable[[Path], object], watched: str) -> None:
    """Written in place, renamed to it, removed, new, in a folder that is replaced; once each, and again later."""
    folder = tmp_path / "in"
    (folder / "pkg").mkdir(parents=True)
    (folder / "a.py").write_text("x = 1")
    saved = interactive.saves(folder / watched)
    assert next(saved) is False
    change(folder)
    assert next(saved) is True
    (folder / "a.py").write_text("x = 3")
    assert next(saved) is True
    saved.close()


@pytest.mark.parametrize(
    ("name", "only", "counts"),
    [
        ("a.py", None, True),
        ("grade-report.html", None, False),
        ("4913", None, False),
        ("b.py", "a.py", False),
        ("hw.zip", "hw.zip", True),
    ],
)
def test_only_programs_are_a_reason_to_grade_again(name: str, only: str | None, counts: bool) -> None:
    """Not the page that grading itself writes, nor what editors leave behind."""
    assert interactive.is_reason(name, only) is counts


# --- whole processes -------------------------------------------------------------------------------------------------

CHILD = """
import sys
sys.path.insert(0, {folder!r})
from contextlib import nullcontext
from cli_samples import a_report
from grader.cli import main
from grader.cli.interactive import process_start
class Stub:
    def opened_early(self, *_):
        return nullcontext()
    def grade_once(self, request, progress, *_, **__):
        progress("exercise 1: \\x1b[31malone")
        sys.stdin.readline()
        return a_report()
main.app(prog_name="grade", obj=main.Invocation(process_start(), Stub))
"""


def process(*arguments: str, **kwargs: Any) -> subprocess.Popen[bytes]:
    code = CHILD.format(folder=str(Path(__file__).parent))
    command = [sys.executable, "-c", code, *arguments]
    kwargs.setdefault("stdin", subprocess.DEVNULL)
    return subprocess.Popen(command, stderr=kwargs.pop("stderr", subprocess.PIPE), **kwargs)


@pytest.mark.slow
@pytest.mark.parametrize("option", ["--json", "--no-progress"])
def test_a_reader_that_had_enough_is_no_problem(option: str) -> None:
    """`grade ada | head -1` ends quietly and with its own exit code."""
    child = process("ada", option, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert child.stdout is not None
    child.stdout.close()
    _, complaint = child.communicate(b"\n", timeout=600)
    assert complaint == b""
    assert child.returncode == 0


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
def test_a_full_disk_behind_standard_output_is_said() -> None:
    """The report is lost, and nobody takes the exit code for a success."""
    with Path("/dev/full").open("wb") as full:
        child = process("ada", stdout=full)
        _, complaint = child.communicate(timeout=600)
    assert complaint == b"error: standard output: the text report cannot be written: No space left on device\n"
    assert child.returncode == 2


@pytest.mark.slow
def test_an_ascii_terminal_still_gets_the_numbers() -> None:
    """Signs that it cannot show give way to plain ones."""
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    out, complaint = process("ada", stdout=subprocess.PIPE, env=environment).communicate(timeout=600)
    assert complaint == b""
    assert b"Criterion 0 +/-" in out


@pytest.mark.slow
def test_a_terminal_sees_progress_and_colours() -> None:
    """On a terminal the step is named, escaped, and gone again; the report is coloured."""
    leader, follower = os.openpty()
    environment = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "FORCE_COLOR")}
    environment["TERM"] = "xterm"
    child = process("ada", stdout=follower, stderr=follower, env=environment)
    os.close(follower)
    seen = b""
    try:
        while chunk := os.read(leader, 65536):
            seen += chunk
    except OSError:  # Linux says so when the other side is closed
        pass
    os.close(leader)
    assert child.wait(timeout=600) == 0
    assert b"\x1b[1;32mada: 10 of 10 points" in seen
    assert b"exercise 1: \\x1b[31malone" in seen
    assert b"\x1b[31malone" not in seen


@pytest.mark.slow
def test_help_starts_light() -> None:
    """Neither rich nor pydantic nor ROS nor the vocabulary of reports is imported before they are needed."""
    code = (
        "import sys\nfrom grader.cli import main\n"
        "try: main.app(['--help'])\nexcept SystemExit: pass\n"
        "heavy = {'rich', 'pydantic', 'rosbags', 'ruamel', 'rclpy', 'numpy', 'fractions'}\n"
        "heavy |= {'grader.runtime.model.trace'}\n"
        "sys.exit(', '.join(sorted(heavy & set(sys.modules))) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_grading_by_a_rubric_that_ships_needs_no_reader_of_rubrics() -> None:
    """Its compiled form does: pydantic and the models of rubrics take longer to import than all that grading needs."""
    code = (
        "import sys\nfrom grader.cli import main\n"
        "try: main.app([sys.argv[1], '--exercise', '1', '--no-progress'])\nexcept SystemExit: pass\n"
        "print(*sorted({'pydantic', 'grader.grading.rubrics.model'} & set(sys.modules)), file=sys.stderr)"
    )
    builtin_exercises()  # so that the compiled form is there
    command = [sys.executable, "-c", code, str(ROOT / "student_template")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "Exercise 1" in done.stdout
    assert done.stderr.strip() == ""


def test_a_subcommand_is_imported_when_it_is_used() -> None:
    """Grading does not wait for the modules of a class, and each subcommand is there all the same."""
    code = (
        "import sys\nfrom grader.cli import main\n"
        "try: main.app(['--version'])\nexcept SystemExit: pass\n"
        "early = [name for name in main.app.names if f'grader.cli.{name}' in sys.modules]\n"
        "context = main.click.Context(main.app)\n"
        "there = [main.app.get_command(context, name).name for name in main.app.list_commands(context)]\n"
        "print(early, there == sorted(main.app.names), len(there))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    # The everyday command completes words as well
    assert (done.stdout.splitlines()[-1], done.stderr) == ("['completion'] True 12", "")


@pytest.mark.parametrize("name", ["rubric", "upload", "export", "interfaces"])
def test_a_command_with_subcommands_alone_shows_its_help(name: str) -> None:
    """As help is laid out, on standard error, and with the exit code of a command that cannot be used."""
    result = grade(name)
    assert (result.stdout, result.exit_code) == ("", 2)
    assert result.stderr.startswith(f"Usage: grade {name} [OPTIONS] COMMAND")
    assert "\n\nCommands:\n" in result.stderr


def test_pictures_are_drawn_where_a_report_shows_them(run_session: Session, tmp_path: Path) -> None:
    """Drawing takes about as long as judging, and text shows none."""
    run_session.call("ada")
    assert run_session.pictures is False
    run_session.call("ada", "-o", f"html={tmp_path / 'r.html'}")
    assert run_session.pictures is True


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (("batch", "in"), "grade batch --help lists the options"),
        (("rubric", "check", "--nope"), "grade rubric check --help lists the options"),
        (("--nope",), "grade --help lists the options"),
    ],
)
def test_a_wrong_option_leads_to_the_help_of_its_command(arguments: tuple[str, ...], hint: str) -> None:
    """Not to that of another one."""
    result = grade(*arguments)
    assert (result.exit_code, result.stderr.splitlines()[-1]) == (2, f"hint: {hint}")
