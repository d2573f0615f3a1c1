"""Judges a criterion that a test of the rubric's author is: the test has judged the run itself."""

from __future__ import annotations

from typing import Any

from grader.grading.judging.findings import faulted, met, not_met
from grader.grading.model.exercise import Finding
from grader.grading.model.wording import quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.trace import Fault, FaultKind, Trace

#: The name of such a criterion's check in reports.
TESTED = "pytest"
#: The most characters of a reason: assertions compare whole lists.
MOST_CHARACTERS = 500


@dataclass(frozen=True, slots=True)
class TestPasses:
    """Whether a test for pytest has passed, as it found while the submission ran.

    Its finding is part of the recording. It is read from there and not found again: a recording has what programs sent,
    and not how they would have reacted to another test.

    Attributes:
        test: What pytest calls it within its file.
    """

    __test__ = False  # no class of tests

    test: str

    def judge(self, trace: Trace) -> Finding:
        """Return what the test has found; raises HarnessError if the recording is not one of a test."""
        tested = trace.tested
        if tested is None:
            raise HarnessError("the recording is not one of a test")
        if tested.passed:
            return met("the test has passed")
        evidence: dict[str, Any] = {"test": self.test}
        if tested.fault is not None:
            return faulted(tested.fault, _consequence(tested.fault), evidence)
        return not_met(quote(tested.reason, MOST_CHARACTERS), evidence, hint=quote(tested.hint, MOST_CHARACTERS))


def _consequence(fault: Fault) -> str:
    return "the file cannot run" if fault.kind is FaultKind.SYNTAX_ERROR else ""
