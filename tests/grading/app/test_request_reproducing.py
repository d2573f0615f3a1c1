"""What gives a report again: the command with every option that matters, and digests."""

import time
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

from click.testing import CliRunner
from tracing import ODOMETRY

from grader.cli import main
from grader.grading.app.bags import recording_digest
from grader.grading.app.grade import read_exercises
from grader.grading.app.request import GradeRequest, command_words, reproduction
from grader.runtime.stimuli.recorded import Recording, TimedMessage


def test_the_seed_is_named_even_if_nobody_asked_for_one() -> None:
    """Without it a changed file would be tried with other values."""
    assert command_words(GradeRequest("./ada"), 7) == ("grade", "./ada", "--seed", "7")


def test_every_option_that_the_result_depends_on_comes_back() -> None:
    """The command, given to the command line, asks for the same."""
    asked = GradeRequest(
        submission="./ada lovelace",
        exercises=("b", "a"),
        rubrics=(Path("r 1.yaml"), Path("r2.yaml")),
        seed=7,
        bags=((ODOMETRY, Path("bag")), ("/scan", Path("a b")), ("sensor_msgs/msg/Imu", Path("c"))),
        clock="wall",
        isolation="none",
        time_budget_s=20.5,
    )
    heard: list[GradeRequest] = []

    class Hearing:
        def opened_early(self, *_: object) -> AbstractContextManager[None]:
            return nullcontext()

        def opened(self, *_: object) -> NoReturn:
            raise AssertionError

        def grade_once(self, request: GradeRequest, *_: object, **__: object) -> NoReturn:
            heard.append(request)
            raise KeyboardInterrupt

    invocation = main.Invocation(time.monotonic(), Hearing)
    CliRunner().invoke(main.app, list(command_words(asked, 7))[1:], obj=invocation)
    assert heard == [asked]


def test_a_path_is_taken_for_nothing_else() -> None:
    """Neither for an option nor for the name of a command."""
    assert command_words(GradeRequest("-x"), 1)[1] == "./-x"
    assert command_words(GradeRequest("observe"), 1)[1] == "./observe"
    assert command_words(GradeRequest("."), 1)[1] == "."
    assert command_words(GradeRequest("/a/b"), 1)[1] == "/a/b"


def test_every_rubric_has_its_digest() -> None:
    """A changed rubric gives another report, and one sees which it was."""
    exercises = read_exercises(GradeRequest("x"))
    found = reproduction(GradeRequest("x"), exercises, "", 7)
    assert found.rubrics == tuple((e.id, e.digest) for e in exercises)
    assert found.recording == ""


def test_the_digest_of_a_recording_is_that_of_what_is_played() -> None:
    """Any other time, byte or topic gives another one."""
    message = TimedMessage(5, b"ab", {})
    recording = Recording("/odom", ODOMETRY, (message, replace(message, t_ns=9)))
    digests = {
        recording_digest(recording),
        recording_digest(replace(recording, topic="/o")),
        recording_digest(replace(recording, messages=recording.messages[:1])),
        recording_digest(replace(recording, messages=(message, replace(message, t_ns=10)))),
        recording_digest(replace(recording, messages=(message, replace(message, t_ns=9, cdr=b"ac")))),
    }
    assert len(digests) == 5
