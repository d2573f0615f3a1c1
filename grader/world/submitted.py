"""Makes the world of a test of a rubric: it runs the programs of a submission, and speaks of them to students."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader.grading.judging.findings import explain_no_message, explain_no_server, explain_no_subscription
from grader.grading.model.wording import first_few, nearest
from grader.runtime.message_classes import built, message_class
from grader.runtime.model.errors import SubmissionError
from grader.runtime.model.scenario import is_launch_file
from grader.runtime.model.trace import Message, unmet_policy
from grader.runtime.plan import Plan, derive
from grader.runtime.session import TestJob
from grader.runtime.steps import LaunchFailedError
from grader.world import telling
from grader.world.account import RunAccount
from grader.world.errors import NoMessage
from grader.world.faults import faults_of_run
from grader.world.programs import NAMED_SO, Found, Runnable
from grader.world.simulating import NamedSimulations
from grader.world.timeline import StepSession
from grader.world.world import World, WorldSetting


class NotHandedIn(SubmissionError):  # noqa: N818 - reads as what happened
    """A program of the rubric that the submission lacks.

    Args:
        name: Its name.
    """

    def __init__(self, name: str) -> None:
        super().__init__(f"{name}: not in the submission")
        self.name = name


class LaunchFailed(AssertionError):  # noqa: N818 - the same
    """A launch file of the submission raised an exception."""


class SubmittedPrograms:
    """The programs of a rubric, as they were handed in; they run in the sandbox.

    Args:
        job: The test, and what was handed in.
    """

    def __init__(self, job: TestJob) -> None:
        self._job = job
        self.provided = job.provided

    def find(self, program: Runnable) -> Found:
        """Find a program; raises NotHandedIn, or SubmissionError if the rubric has none of that name."""
        if callable(program):
            text = f"{getattr(program, '__name__', program)}: expected the name of a program that is handed in"
            raise SubmissionError(text, "a test of a rubric imports nothing of a submission")
        wanted = str(program)
        if wanted in self._job.missing:
            raise NotHandedIn(wanted)
        for name, file, executable in self._job.files:
            if name == wanted:
                return Found(name, Path(self._job.plan.root), file, executable, self._job.plan.projects)
        known = [*(name for name, _, _ in self._job.files), *self._job.missing]
        close = nearest(wanted, known)
        hint = f"did you mean {close}?" if close else f"name it under `files`, which has {first_few(known)}"
        raise SubmissionError(f"{wanted}: expected a program of the rubric, found none", hint)

    def find_launch(self, file: str | Path) -> tuple[Found, tuple[tuple[str, str], ...]]:
        """Find a launch file, of the rubric itself or handed in, with the names of the programs that it may start."""
        name = str(file)
        own = dict(self.provided)
        found = Found(name, Path(self._job.plan.root), name) if name in own else self.find(name)
        if not is_launch_file(name):
            raise SubmissionError(f"{name}: expected a launch file", NAMED_SO)
        return found, self._job.known

    def complete(self, plan: Plan, found: Found) -> Plan:
        """Return the plan of one start; the plan of the job has the folder and the packages of the submission."""
        del found
        return replace(plan, host_seed=derive(int(self._job.plan.host_seed, 16), "program", plan.starts[0].process))

    def failure(self, file: str | Path, error: LaunchFailedError) -> Exception:
        """Return what a launch file that has raised an exception means: it is the student's, or the rubric's own."""
        return error if str(file) in dict(self.provided) else LaunchFailed(error.message)


class StudentAccount(RunAccount):
    """What is told to students: what their programs lack, as the test is taken to be right."""

    def advice(self) -> str:
        """Return one thing to do about messages of the test that do not arrive: the submission has to hear them."""
        return next(filter(None, self._advices()), "")

    def _advices(self) -> Iterator[str]:
        for offer in self._offers.publishers.values():
            same = self._observed.graph.ends_of_topics("subscription", offer.topic)
            fitting = [e for e in same if e.type == offer.type]
            if not fitting:
                yield explain_no_subscription(self.trace(), offer.topic, offer.type).hint
            for unmet in filter(None, (unmet_policy(offer, end) for end in fitting)):
                yield f"subscribe to {offer.topic} with {unmet[0]}"

    def silence(self, topic: str) -> NoMessage:
        """Return an error that says why no message of a program came on a topic."""
        found = explain_no_message(self.trace(), topic, None)
        return NoMessage(found.reason, found.hint)

    def no_server(self, service: str, interface: str) -> str:
        """Return why nobody offers a service of a type."""
        node, _, name = service.rpartition("/")
        if name in telling.OF_EVERY_NODE and node not in self._observed.graph.nodes:
            return super().no_server(service, interface)
        found = explain_no_server(self.trace(), service, interface)
        return f"{found.reason}\n  hint: {found.hint}" if found.hint else found.reason


def read_fields(message: Message) -> Any:
    """Return a message from the fields that the worker has read: its bytes are the student's.

    Raises:
        NoMessage: Its type is not installed here, or it was too large to be read.
    """
    kind = message_class(message.type)
    if kind is None:
        raise NoMessage(f"{message.topic} has messages of type {message.type}, which is not installed here")
    if not message.value and kind.get_fields_and_field_types():
        raise NoMessage(f"{message.topic} has a message that is too large to be read")
    return built(kind, message.value, message.topic)


def graded_world(session: StepSession, job: TestJob, options: Mapping[str, Any]) -> World:
    """Open the world of a test of a rubric; whoever opens it closes it.

    Args:
        session: What the programs run in.
        job: The test, and what was handed in.
        options: Of the marker `ros`.
    """
    drawn = options.get("seed")
    seed = job.seed if drawn is None else drawn
    faults = faults_of_run(seed, delay=options.get("delay"), lose=options.get("lose"))
    plan = replace(
        job.plan,
        processes=(),
        starts=(),
        duration_ns=0,
        drawn_order=drawn is not None,
        connections=faults.connections,
        faults=faults.injected,
        drawn_steps=None,
    )
    files = {name: (path, content) for name, path, content in job.test.simulations}
    setting = WorldSetting(
        session,
        SubmittedPrograms(job),
        read=read_fields,
        simulations=NamedSimulations(files, dict(job.test.maps)),
        account=StudentAccount,
    )
    return World(setting, plan, seed, faults.names)
