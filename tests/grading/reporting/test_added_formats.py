"""Report formats of other packages: found by their metadata, used like the grader's own, and never at a mark's cost."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from added_packages import files_of, grade, installed, made_importable, register
from click.testing import CliRunner, Result
from report_samples import hostile, middling

from grader.cli.completion import complete_output
from grader.cli.main import app
from grader.grading.app.doctor import _added
from grader.grading.model.entry_points import FORMATS as GROUP
from grader.grading.reporting.audience import ANYBODY
from grader.grading.reporting.delivery import Output, deliver, early_delivery, prepared_outputs
from grader.grading.reporting.formats import FORMATS, PageLayout, added_formats, format_of, rendered
from grader.runtime.model.errors import EnvironmentFault

LAYOUT = PageLayout(100, colour=False)
GOOD = """
from grader.api import Format

ROW = Format(lambda report: f"{report.name} {float(report.score):g}", ".mine")
"""
FAILS = """
from grader.api import Format

def render(report):
    {body}

ROW = Format(render, ".mine", {options})
"""
#: What a package may do wrong -> its module, and what the message says.
UNUSABLE = {
    "import raises": ("1 / 0", "cannot be imported: ZeroDivisionError: division by zero"),
    "import quits": ("raise type('Quit', (BaseException,), dict())('done')", "cannot be imported: Quit: done"),
    "import exits": ("raise SystemExit(0)", "cannot be imported: SystemExit: 0"),
    "no such name": ("", "cannot be imported: AttributeError"),
    "no module": ("import not_there", "cannot be imported: ModuleNotFoundError: No module named 'not_there'"),
    "syntax": ("def", "cannot be imported: SyntaxError"),
    "no format": ("ROW = print", "expected a Format of grader.api, found builtin_function_or_method"),
    "unknown need": (FAILS.format(body="pass", options="needs=('sources',)"), "needs: expected a tuple of layout"),
    "needs a text": (FAILS.format(body="pass", options="needs='layout'"), "found 'layout'"),
    "no renderer": ("from grader.api import Format\nROW = Format('mine_module:gone', '.x')", "mine_module:gone cannot"),
    "nasty error": (
        "class E(Exception):\n  def __str__(self): raise ValueError\nraise E",
        "cannot be imported: E",
    ),
    "nasty text": (r"raise ValueError('\x1b[2J\n\u202e')", r"ValueError: \x1b[2J\n\u202e"),
}
#: What a renderer may do wrong, and what the message says.
WRONG = {
    "raises": ("raise KeyError('x')", "failed: KeyError: 'x'"),
    "quits": ("raise type('Quit', (BaseException,), dict())('done')", "failed: Quit: done"),
    "exits": ("raise SystemExit(0)", "failed: SystemExit: 0"),
    "no text": ("return 7", "expected a text, found int"),
    "recursion": ("return render(report)", "failed: RecursionError"),
    "asks for more": ("return report.sources", "failed: AttributeError"),
}


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder that is searched for packages, and forget what was found in it before."""
    folder = tmp_path / "packages"
    folder.mkdir()
    made_importable(folder, monkeypatch)
    format_of.cache_clear()
    monkeypatch.delitem(sys.modules, "mine_module", raising=False)
    return folder


def run(*arguments: str, code: int) -> Result:
    done = CliRunner().invoke(app, [*arguments], prog_name="grade")
    assert done.exit_code == code, done.output
    return done


def test_it_is_found_rendered_and_delivered_like_any_other(package: Path, tmp_path: Path) -> None:
    """To a file or standard output, by its name."""
    register(package, GROUP, {"mine": "mine_module:ROW"}, GOOD)
    assert added_formats() == ["mine"]
    outputs = prepared_outputs([Output("mine", tmp_path / "report.mine")])
    deliver(middling(), outputs[:1])
    text = (tmp_path / "report.mine").read_text(encoding="utf-8")
    assert text == f"{middling().name} {float(middling().score):g}" == rendered("mine", middling(), LAYOUT, ANYBODY)


def test_the_help_and_the_shell_know_it(package: Path) -> None:
    """For `grade` and `grade rejudge`; nothing of the package is imported for that."""
    register(package, GROUP, {"mine": "mine_module:ROW", "no name": "mine_module:ROW"}, "1 / 0")
    for command in ([], ["rejudge"]):
        told = " ".join(run(*command, "--help", code=0).output.split())
        assert "classroom, mine)" in told
    found = complete_output(None, None, "mi")  # type: ignore[arg-type]
    assert [item.value for item in found] == ["mine=report.mine"]


def test_a_misspelt_name_is_answered_with_the_nearest(package: Path, tmp_path: Path) -> None:
    """Also with that of a package."""
    register(package, GROUP, {"spreadsheet": "mine_module:ROW"}, GOOD)
    done = run(str(tmp_path), "-o", "spredsheet=x", code=2)
    assert "'spredsheet' is not a format; did you mean spreadsheet?" in done.output
    assert "did you mean html?" in run(str(tmp_path), "-o", "htlm=x", code=2).output


@pytest.mark.parametrize("mistake", UNUSABLE)
def test_one_that_cannot_be_used_is_refused_before_grading(package: Path, tmp_path: Path, mistake: str) -> None:
    """Exit code 2, and a message with package, entry point and a fix; the other formats work."""
    module, said = UNUSABLE[mistake]
    register(package, GROUP, {"mine": "mine_module:ROW"}, module)
    error, hint = run(str(tmp_path), "-o", f"mine={tmp_path / 'x'}", code=2).stderr.splitlines()
    assert "the format 'mine' of mine 1.0" in error
    assert said in error
    assert re.fullmatch("hint: update (mine|the package), or uninstall it", hint)
    assert rendered("json", middling(), LAYOUT, ANYBODY)
    (fact,) = _added()
    assert "the format 'mine' of mine 1.0" in fact.value
    assert fact.remedy


@pytest.mark.parametrize("mistake", WRONG)
def test_one_that_fails_costs_no_other_report(package: Path, tmp_path: Path, mistake: str) -> None:
    """All others are delivered, then the message names the package."""
    body, said = WRONG[mistake]
    register(package, GROUP, {"mine": "mine_module:ROW"}, FAILS.format(body=body, options=""))
    outputs = prepared_outputs([Output("mine", tmp_path / "x"), Output("json", tmp_path / "report.json")])
    with pytest.raises(EnvironmentFault, match=r"the format 'mine' of mine 1\.0") as error:
        deliver(middling(), outputs)
    assert said in error.value.message
    assert "ask for another format" in error.value.hint
    assert json.loads((tmp_path / "report.json").read_bytes())["score"]
    assert not (tmp_path / "x").exists()


def test_one_that_fails_on_standard_output_leaves_the_text_on_standard_error(
    package: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The mark was earned; what reads standard output finds nothing there that it does not understand."""
    register(package, GROUP, {"mine": "mine_module:ROW"}, FAILS.format(body="raise KeyError('x')", options=""))
    with pytest.raises(EnvironmentFault, match="failed: KeyError"):
        deliver(middling(), prepared_outputs([Output("mine")]))
    printed = capfd.readouterr()
    assert printed.out == ""
    assert rendered("text", middling(), PageLayout(80, colour=False), ANYBODY).splitlines()[0] in printed.err


def test_a_partial_report_that_cannot_be_written_ends_no_run(package: Path, tmp_path: Path) -> None:
    """The final one says what is wrong."""
    module = FAILS.format(body="raise KeyError('x')", options="written_early=True")
    register(package, GROUP, {"mine": "mine_module:ROW"}, module)
    write = early_delivery([Output("mine", tmp_path / "x")])
    assert write is not None
    write(middling())


def test_a_text_that_nobody_can_encode_is_written_all_the_same(package: Path, tmp_path: Path) -> None:
    """A lone surrogate of a student's becomes U+FFFD."""
    register(package, GROUP, {"mine": "mine_module:ROW"}, FAILS.format(body=r"return 'a\ud800'", options=""))
    deliver(hostile(), prepared_outputs([Output("mine", tmp_path / "x")])[:1])
    assert (tmp_path / "x").read_text(encoding="utf-8") == "a\ufffd"


def test_students_get_what_they_may_see(package: Path) -> None:
    """The rows of packages mean what those of the grader mean."""
    module = FAILS.format(body="return report.audience.value", options="for_students=True")
    register(package, GROUP, {"mine": "mine_module:ROW"}, module)
    assert rendered("mine", middling(), LAYOUT, ANYBODY) == "student"


@pytest.mark.parametrize("name", FORMATS)
def test_the_names_of_the_graders_own_formats_stay_its_own(package: Path, name: str) -> None:
    """Whatever a package registers; `grade doctor` says that it is in vain, and what to do."""
    register(package, GROUP, {name: "mine_module:ROW"}, "1 / 0")
    assert format_of(name) is FORMATS[name]
    assert added_formats() == []
    (fact,) = _added()
    assert fact.value == f"{name} of mine 1.0 is not used: the grader has its own"
    assert fact.remedy == "give the format of mine another name"


def test_two_packages_with_one_name_are_refused(package: Path, tmp_path: Path) -> None:
    """Which of them is meant is not for the grader to guess."""
    register(package, GROUP, {"mine": "mine_module:ROW"}, GOOD)
    register(package, GROUP, {"mine": "mine_module:ROW"}, GOOD, name="other")
    error, hint = run(str(tmp_path), "-o", "mine=x", code=2).stderr.splitlines()
    assert error == f"error: 'mine' of {GROUP}: expected one package that registers it, found mine 1.0 and other 1.0"
    assert hint == "hint: uninstall all but one of them"


def test_metadata_that_cannot_be_read_are_named(package: Path, tmp_path: Path) -> None:
    """The grader's own formats and the help need none."""
    register(package, GROUP, {"mine": "mine_module:ROW"}, GOOD)
    (package / "mine-1.0.dist-info" / "entry_points.txt").write_bytes(b"[x]\nmine = \xff\xfe\n")
    assert "metadata of an installed package cannot be read" in run(str(tmp_path), "-o", "mine=x", code=2).stderr
    assert "other packages" in [fact.name for fact in _added()]
    run("--help", code=0)


def test_what_asks_for_no_other_format_reads_no_metadata(package: Path) -> None:
    """`grade --version` and the grader's own formats start as fast as before."""
    program = (
        "import sys\nfrom grader.cli.main import app\nfrom grader.cli.outputs import parse_outputs\n"
        "parse_outputs(None, None, ('json=x', 'html=y', 'evidence=z'))\n"
        "app(['--version'], standalone_mode=False)\nprint('importlib.metadata' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False"


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.ros
def test_the_package_of_the_page_works(tmp_path: Path) -> None:
    """Its three files, built and installed by pip, make a badge of a real run."""
    files = files_of("docs/how-to/report-format.md")
    assert len(files) == 3
    packages = installed(files, tmp_path / "package")
    desk = tmp_path / "ada"
    desk.mkdir()
    (desk / "velocity_publisher.py").write_text("import rclpy\nrclpy.init()\n")
    done = grade(".", "--exercise", "1", "-o", "badge=badge.svg", "-o", "evidence=kept", packages=packages, cwd=desk)
    assert done.returncode == 1, done.stderr
    badge = ET.parse(desk / "badge.svg").getroot()
    title = next(badge.iter("{http://www.w3.org/2000/svg}title")).text or ""
    assert re.fullmatch(r"ada: \d+/30 points", title)
    judged = grade("rejudge", "kept", "-o", "badge=-", packages=packages, cwd=desk)
    assert judged.stdout == (desk / "badge.svg").read_text(encoding="utf-8")
    assert "classroom, badge)" in " ".join(grade("--help", packages=packages, cwd=desk).stdout.split())
