"""What a stepped test fails with: AssertionErrors, so that test runners count a failure and not an error."""

from __future__ import annotations

from grader.runtime.model.trace import Fault


class ProgramFailed(AssertionError):  # noqa: N818 - reads as what happened
    """A program raised an exception, does not return, or was ended at a limit or by a signal.

    Attributes:
        fault: What happened to it.
    """

    def __init__(self, text: str = "", fault: Fault | None = None) -> None:
        super().__init__(text)
        self.fault = fault


class StepTimeout(AssertionError):  # noqa: N818 - the same
    """What was waited for did not happen in time.

    Attributes:
        reason: What that was, and the likely cause, in one line.
        hint: One thing to do; empty if nothing is very likely right.
    """

    def __init__(self, text: str = "", reason: str = "", hint: str = "") -> None:
        super().__init__(text)
        self.reason = reason or text
        self.hint = hint


class ParameterRejected(AssertionError):  # noqa: N818 - the same
    """A node did not accept the value of a parameter."""


class WrongType(AssertionError):  # noqa: N818 - the same
    """A program and the test use one name with different types, or with QoS that never fits: nothing would arrive."""


class NoMessage(IndexError):  # noqa: N818 - the same
    """A message was asked for that has not arrived, such as the last one of a silent topic.

    Attributes:
        reason: Why there is none, in one line.
        hint: One thing to do; empty if nothing is very likely right.
    """

    def __init__(self, reason: str = "", hint: str = "") -> None:
        super().__init__(f"{reason}\n  hint: {hint}" if hint else reason)
        self.reason = reason
        self.hint = hint


class RecordingDiffers(AssertionError):  # noqa: N818 - the same
    """What programs published is not what a kept recording has; the message names the first difference."""


class NoTransform(LookupError):  # noqa: N818 - the same
    """Nothing says where a frame is in another one; the message names the link that is missing.

    Attributes:
        reason: Why there is none, in one line.
        hint: One thing to do; empty if nothing is very likely right.
    """

    def __init__(self, reason: str = "", hint: str = "") -> None:
        super().__init__(f"{reason}\n  hint: {hint}" if hint else reason)
        self.reason = reason
        self.hint = hint
