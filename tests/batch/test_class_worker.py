"""What grading one submission comes to in its process: whose fault it is decides, and nothing of ours is a mark."""

import pytest

from grader.batch import worker
from grader.batch.keys import Conditions
from grader.batch.standing import State
from grader.batch.tasks import Task
from grader.model.errors import EnvironmentFault, HarnessError, SubmissionError

CONDITIONS = Conditions("0", (("a", "sha256:1"),), "", None, "auto", "auto")


def attempt(tmp_path, monkeypatch, error):
    """Return what an attempt comes to in which grading ends with an error."""

    def grade(request, progress, hear):
        raise error

    monkeypatch.setattr(worker, "grade", grade)
    into = tmp_path / f"into {len(list(tmp_path.iterdir()))}"
    task = Task("x", "label", tmp_path, into, (), (), None, CONDITIONS, 1, False, 60.0)
    return worker.attempt(task, lambda step: None)


@pytest.mark.parametrize(
    ("error", "state", "problem"),
    [
        (SubmissionError("x: expected a .py file", "add one"), State.REFUSED, "x: expected a .py file"),
        (HarnessError("worker: gone", "again"), State.FAILED, "worker: gone"),
        (EnvironmentFault("no ROS"), State.FAILED, "no ROS"),
        (OSError(28, "No space left on device"), State.FAILED, "the result cannot be written: No space left on device"),
        (ZeroDivisionError("ours"), State.FAILED, "the grader failed: ZeroDivisionError: ours"),
        (RecursionError("deep"), State.FAILED, "the grader failed: RecursionError: deep"),
        (MemoryError(), State.FAILED, "the grader failed: MemoryError: "),
    ],
)
def test_an_error_is_told_by_who_must_act(tmp_path, monkeypatch, error, state, problem):
    """Only what is wrong with the submission itself refuses it and has a key; all else is tried again."""
    standing = attempt(tmp_path, monkeypatch, error)
    assert (standing.state, standing.problem) == (state, problem)
    assert bool(standing.key) == (state is State.REFUSED)
    assert standing.usage["peak_bytes"] > 1 << 20


def test_the_same_reason_to_refuse_has_the_same_key(tmp_path, monkeypatch):
    """A submission that cannot be used is looked at again only when something changed."""
    one = attempt(tmp_path, monkeypatch, SubmissionError("x: found none"))
    same = attempt(tmp_path, monkeypatch, SubmissionError("x: found none"))
    other = attempt(tmp_path, monkeypatch, SubmissionError("x: found two"))
    assert one.key == same.key != other.key
