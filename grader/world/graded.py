"""The program that runs the tests of a rubric on a submission; `grader.runtime.supervisor.test_runs` starts it.

Usage: python -m grader.world.graded FD FILE. It says which tests pytest collects, is told which to run on what, and
then says for each test when it begins and how it has ended. In between it passes on the commands of the test.
"""

from __future__ import annotations

import json
import re
import socket
import sys
from collections.abc import Generator, Iterator, Mapping
from typing import Any

import pytest

from grader.grading.model.wording import first_few
from grader.runtime.model.author_files import error_words, line_of
from grader.runtime.model.errors import GraderError, HarnessError
from grader.runtime.plan import Plan
from grader.runtime.recording.codec import from_json, observation_to_json, to_json
from grader.runtime.session import LentWorker, TestJob, WorkerLostError
from grader.runtime.simulation.loading import SimulationError
from grader.world.errors import NoMessage, ParameterRejected, ProgramFailed, StepTimeout, WrongType
from grader.world.submitted import LaunchFailed, NotHandedIn, graded_world
from grader.world.world import World

#: What `@pytest.mark.ros` takes in a rubric.
OPTIONS = ("seed", "delay", "lose")
#: Modules that rosidl generates: what fails there is a value that no field takes, which the test has written.
_GENERATED = re.compile(r"\w+\.(msg|srv|action)\._\w+")
_WORLD: pytest.StashKey[World] = pytest.StashKey()
_FOUND: pytest.StashKey[dict[str, Any]] = pytest.StashKey()


class SupervisorLine:
    """The connection to the supervisor, through which the worker is reached that it lends."""

    def __init__(self, connection: socket.socket) -> None:
        self._stream = connection.makefile("rw", encoding="utf-8")

    def say(self, what: Mapping[str, Any]) -> None:
        """Say something that nobody answers."""
        self._stream.write(json.dumps(what) + "\n")
        self._stream.flush()

    def ask(self, what: Mapping[str, Any]) -> dict[str, Any]:
        """Return the answer of the supervisor; raises WorkerLostError if it has lost the worker."""
        self.say(what)
        answer: dict[str, Any] = self.listen()
        if "lost" in answer:
            raise WorkerLostError(str(answer["lost"]))
        return answer

    def listen(self) -> dict[str, Any]:
        """Return what the supervisor says next."""
        line = self._stream.readline()
        if not line:
            raise SystemExit(0)
        answer: dict[str, Any] = json.loads(line)
        return answer

    def begin(self, plan: Plan) -> LentWorker:
        """Begin a run in a worker of the supervisor."""
        self.ask({"lend": to_json(plan)})
        return LentWorker(self, self._give_back)

    def exchange(self, told: Mapping[str, Any] | None) -> dict[str, Any]:
        """Tell the worker something, and return what it says."""
        answer: dict[str, Any] = self.ask({"tell": told})["told"]
        return answer

    def _give_back(self, *, usable: bool) -> None:
        self.ask({"back": usable})


class Plugin:
    """What pytest calls."""

    def __init__(self, line: SupervisorLine) -> None:
        self._line = line
        self._jobs: dict[str, TestJob] = {}
        self._mistake: dict[str, Any] = {}

    def pytest_configure(self, config: pytest.Config) -> None:
        """Describe the markers."""
        config.addinivalue_line("markers", "points(N, hint=TEXT, needs=ID): what the test is worth")
        config.addinivalue_line("markers", "ros(seed=N, delay={topic: (least, most)}, lose={topic: share}): of `ros`")

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(
        self, collector: pytest.Collector
    ) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
        """Note why the file cannot be collected."""
        report = yield
        if report.failed and not self._mistake:
            excinfo = getattr(getattr(report, "call", None), "excinfo", None)
            error = getattr(excinfo, "value", None)
            cause = getattr(error, "__cause__", None) or getattr(error, "__context__", None) or error
            self._mistake = _mistake(cause or RuntimeError("pytest cannot collect the file"), str(collector.path))
        return report

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Say what was collected, and keep what is to be run."""
        told: dict[str, Any] = {"mistake": self._mistake} if self._mistake else {"collected": [*map(_name, items)]}
        self._line.say(told)
        asked = self._line.listen()["tests"]
        self._jobs = {name: from_json(TestJob, job) for name, job in asked.items()}
        items[:] = [item for item in items if _name(item) in self._jobs]

    @pytest.fixture
    def ros(self, request: pytest.FixtureRequest) -> Iterator[World]:
        """The world in which a test runs the programs of a submission."""
        node: Any = request.node
        options: dict[str, Any] = {}
        for marker in reversed(list(node.iter_markers("ros"))):
            unknown = [name for name in marker.kwargs if name not in OPTIONS]
            if unknown or marker.args:
                found = unknown[0] if unknown else repr(marker.args[0])
                raise ValueError(f"@pytest.mark.ros in a rubric: expected {first_few(OPTIONS)} by name, found {found}")
            options |= marker.kwargs
        world = graded_world(self._line, self._jobs[_name(node)], options)
        node.stash[_WORLD] = world
        yield world
        world.close()

    @pytest.fixture
    def ros_session(self) -> Any:
        """Not for a rubric: each of its tests has a recording of its own."""
        raise ValueError("ros_session: each test of a rubric has a recording of its own: use the fixture `ros`")

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Say when a test begins, and how it has ended."""
        name = _name(item)
        self._line.say({"begin": name})
        item.stash[_FOUND] = {}
        result = yield
        found = item.stash[_FOUND] or {"tested": {"passed": True}}
        self._line.say({"end": name, **found})
        return result

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Note what the first part of a test has found that has not passed."""
        report = yield
        if call.excinfo is not None and not item.stash[_FOUND]:
            item.stash[_FOUND] = _found_by(item, call.when, call.excinfo)
        return report


def _name(item: Any) -> str:
    """Return what pytest calls a test within its file."""
    name: str = item.nodeid.partition("::")[2]
    return name


def _found_by(item: pytest.Item, when: str, failure: pytest.ExceptionInfo[BaseException]) -> dict[str, Any]:
    """Return what a failure means: a verdict on the submission, a mistake of the test, or a problem of the grader."""
    error = failure.value
    world = item.stash.get(_WORLD, None)
    if isinstance(error, SimulationError):
        one = error.mistake
        return {"mistake": {"file": one.file, "line": one.line, "text": one.text}}
    if isinstance(error, HarnessError):
        return {"problem": error.message}
    if (found := _of_programs(error, world)) is not None:
        return {"tested": {"passed": False, **found}}
    judged = isinstance(error, (AssertionError, pytest.fail.Exception)) and not _is_generated(failure)
    if when != "call" or not judged:
        return {"mistake": _mistake(error, str(item.path), when)}
    advice = world.advice if world is not None else ""
    return {"tested": {"passed": False, "reason": _said(error, failure), "hint": advice}}


def _of_programs(error: BaseException, world: World | None) -> dict[str, Any] | None:
    """Return what programs did that ended a test, in whichever part of it; None if it was no program."""
    if world is not None and world.full:
        return {"reason": world.full}
    if isinstance(error, NotHandedIn):
        return {"missing": [error.name]}
    if isinstance(error, ProgramFailed) and error.fault is not None:
        return {"reason": error.fault.text, "fault": observation_to_json(error.fault)}
    if isinstance(error, (StepTimeout, NoMessage)):
        return {"reason": error.reason, "hint": error.hint}
    if isinstance(error, WrongType):
        return {"reason": str(error), "hint": world.advice if world is not None else ""}
    return {"reason": str(error)} if isinstance(error, (ParameterRejected, LaunchFailed)) else None


def _is_generated(failure: pytest.ExceptionInfo[BaseException]) -> bool:
    """Return whether a message did not take a value: a class of messages asserts that, and the test has written it."""
    return _GENERATED.fullmatch(str(failure.traceback[-1].frame.f_globals.get("__name__", ""))) is not None


def _said(error: BaseException, failure: pytest.ExceptionInfo[BaseException]) -> str:
    """Return the message of an assertion; without one, what pytest says of it in one line, or the assertion itself."""
    text = str(getattr(error, "msg", None) or error)
    if not text.strip():
        return str(failure.traceback[-1].statement).strip()
    message, _, _ = text.partition("\nassert ")
    return message.partition("\n")[0] if message.startswith("assert ") else message


def _mistake(error: BaseException, path: str, when: str | None = None) -> dict[str, Any]:
    """Return the place and the words of a mistake in the file of tests."""
    if isinstance(error, pytest.skip.Exception):
        return {"line": line_of(error, path, 0), "text": "the test was skipped, so that nothing is judged"}
    where = "" if when in (None, "call") else f"in a fixture ({when}): "
    hint = f"; {error.hint}" if isinstance(error, GraderError) and error.hint else ""
    if isinstance(error, AttributeError) and hasattr(getattr(error, "obj", None), "get_fields_and_field_types"):
        hint = "; name the type that the messages have to be of, as in ros.messages(topic, Twist)"
    return {"line": line_of(error, path, 0), "text": f"{where}{type(error).__name__}: {error_words(error)}{hint}"[:500]}


def main() -> None:
    """Run the tests of a file."""
    line = SupervisorLine(socket.socket(fileno=int(sys.argv[1])))
    arguments = ["-p", "no:cacheprovider", "-p", "no:faulthandler", "--import-mode=importlib", "-c", "pytest.ini"]
    pytest.main([*arguments, "--rootdir=.", sys.argv[2]], plugins=[Plugin(line)])


if __name__ == "__main__":
    main()
