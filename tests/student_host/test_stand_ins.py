"""Names of a package that is not installed can be imported, and not used."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

STAND_INS = "from grader.student_host.shadows import install_stand_ins; install_stand_ins()\n"


def run(program: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", STAND_INS + textwrap.dedent(program)], capture_output=True, text=True, check=False
    )


def test_an_import_that_is_not_used_costs_nothing() -> None:
    """Tutorials import AddTwoInts and then use Trigger."""
    program = """
        from example_interfaces.srv import AddTwoInts
        import example_interfaces.msg
        from example_interfaces.action import Fibonacci as F
        print(AddTwoInts.__name__, example_interfaces.msg.Int64.__module__)
    """
    assert run(program).stdout == "AddTwoInts example_interfaces.msg\n"


@pytest.mark.parametrize("use", ["AddTwoInts()", "AddTwoInts.Request()", "check_for_type_support(AddTwoInts)"])
def test_using_a_stand_in_fails_as_the_import_would_have(use: str) -> None:
    """The cause that a student reads is the package that is missing."""
    program = f"""
        from rclpy.type_support import check_for_type_support
        from example_interfaces.srv import AddTwoInts
        {use}
    """
    assert run(program).stderr.splitlines()[-1] == "ModuleNotFoundError: No module named 'example_interfaces'"


def test_what_the_package_never_had_is_not_there() -> None:
    """A misspelt name fails at its import, as with the real package."""
    assert "cannot import name 'AddThreeInts'" in run("from example_interfaces.srv import AddThreeInts").stderr
    assert "No module named 'example_interfaces.srvs'" in run("import example_interfaces.srvs").stderr


def test_what_is_installed_goes_first(tmp_path: Path) -> None:
    """A real package, or a folder of the student's own, hides the stand-in."""
    (tmp_path / "example_interfaces").mkdir()
    (tmp_path / "example_interfaces" / "srv.py").write_text("AddTwoInts = 'the real one'")
    (tmp_path / "example_interfaces" / "__init__.py").touch()
    program = (
        f"import sys; sys.path.append({str(tmp_path)!r})\nfrom example_interfaces.srv import AddTwoInts as A\nprint(A)"
    )
    assert run(program).stdout == "the real one\n"
