"""The errors of the grader, by who has to act, and the exit codes of the command line.

    GraderError
      · RubricError           the author of the rubric
      · SubmissionError       the student, or who gave the path
      · HarnessError          nobody but the project: the grader or the machine failed during a run
      · EnvironmentFault      the administrator of the machine, which lacks something
      and who gave what cannot be used:
      · RecordingError        a recording to play
      · EvidenceError         evidence
      · ClassError            an input of a class, or its result folder
      · VariantError          the student whose variant is asked for
      · KeyFileError          a key

A crash of a student's program is not an exception but a Fault in the trace.
"""

from __future__ import annotations

ALL_MET, NOT_ALL_MET, UNUSABLE, UNDECIDED, INTERRUPTED = 0, 1, 2, 3, 130


class GraderError(Exception):
    """A problem with a place and a fix.

    The message is one line, `where: what was expected, what was found`. The hint is one thing to do, without the word
    "hint"; empty if there is none.
    """

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint


class RubricError(GraderError):
    """A rubric cannot be used; its author has to fix it."""


class SubmissionError(GraderError):
    """A submission cannot be used; the student, or the user who gave the path, has to act."""


class RecordingError(GraderError):
    """A recording to play cannot be used; whoever gave it, the user or the author of the rubric, has to act."""


class EvidenceError(GraderError):
    """Evidence cannot be used; the user who gave it has to act."""


class ClassError(GraderError):
    """An input of a class, or its result folder, cannot be used; the user who gave it has to act."""


class VariantError(GraderError):
    """A student's variant cannot be drawn; the user who named the student has to act."""


class KeyFileError(GraderError):
    """A key cannot be used; the user who gave it has to act."""


class EnvironmentFault(GraderError):  # noqa: N818 - named after what it is, like the others of its kind here
    """This machine lacks something that grading needs; its administrator has to act."""


class HarnessError(GraderError):
    """The grader or the machine failed during a run, which is never the student's fault."""
