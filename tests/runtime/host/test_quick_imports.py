"""Loading type supports imports no generator, and hides nothing of it from a program that wants it."""

import subprocess
import sys
import textwrap

import pytest

pytest.importorskip("rclpy", reason="needs rclpy")


def said(program: str) -> str:
    """Return what a program says in a new process, without the variables of this one that start others."""
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_a_message_can_be_used_without_the_generator() -> None:
    """Neither of the generator's parsers is imported."""
    program = """
        import sys
        from grader.runtime.host.quick_imports import import_without_needless
        import_without_needless("rosidl_generator_py")
        from std_msgs.msg import Float32
        Float32.__import_type_support__()
        print(Float32._CREATE_ROS_MESSAGE is not None, {"lark", "em"} & {*sys.modules})
    """
    assert said(program) == "True set()"


def test_time_machine_imports_no_tests() -> None:
    """It has a plugin for pytest, which is a fifth of a second of processor time where it is installed."""
    program = """
        import sys
        from grader.runtime.host.quick_imports import import_without_needless
        time_machine = import_without_needless("time_machine")
        with time_machine.travel(0, tick=False):
            import time
            print(time.time(), "pytest" in sys.modules)
    """
    assert said(program) == "0.0 False"


def test_what_was_left_out_can_still_be_imported() -> None:
    """A program may want to generate classes itself, or to test itself."""
    program = """
        from grader.runtime.host.quick_imports import NEEDLESS, import_without_needless
        for package in (*NEEDLESS, *NEEDLESS):
            import_without_needless(package)
        from rosidl_generator_py.generate_py_impl import generate_py
        import pytest
        print(callable(generate_py), import_without_needless("time_machine").__name__)
    """
    assert said(program) == "True time_machine"
