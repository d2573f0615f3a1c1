"""What a stepped test fails with; each is an AssertionError, so that test runners count a failure and not an error."""

from __future__ import annotations


class ProgramFailed(AssertionError):  # noqa: N818 - reads as what happened
    """A program raised an exception, does not return, or was ended at a limit or by a signal."""


class StepTimeout(AssertionError):  # noqa: N818 - the same
    """What was waited for did not happen in time."""


class ParameterRejected(AssertionError):  # noqa: N818 - the same
    """A node did not accept the value of a parameter."""


class NoMessage(IndexError):  # noqa: N818 - the same
    """A message was asked for that has not arrived, such as the last one of a silent topic."""
