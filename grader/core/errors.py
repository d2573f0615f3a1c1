"""The errors of the grader, drawn by who must act.

    GraderError
      ├─ RubricError       the author of the rubric
      ├─ SubmissionError   the student, or whoever named the path
      ├─ RecordingError    whoever named the /odom recording
      ├─ EvidenceError     whoever named the evidence
      ├─ ClassError        whoever describes a class: its submissions, roster, late days, places for results
      ├─ VariantError      whoever names the student whose variant is meant
      ├─ KeyFileError      whoever names the course key or the seed key
      ├─ EnvironmentFault  whoever set up this machine (ROS, sandbox)
      └─ HarnessError      us or the machine, during a run

A student's crash is none of these: it is a Fault in the trace.
"""


class GraderError(Exception):
    """A problem with a place and a remedy.

    Args:
        message: `where: what was expected, what was found`, one line.
        hint: One thing to do, without the word "hint"; empty if there is none.
    """

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint


class RubricError(GraderError):
    """A rubric cannot be used; its author must act."""


class SubmissionError(GraderError):
    """A submission cannot be used; the student, or whoever named the path, must act."""


class RecordingError(GraderError):
    """An /odom recording cannot be used; whoever named it must act."""


class EvidenceError(GraderError):
    """Kept evidence cannot be used; whoever named it must act."""


class ClassError(GraderError):
    """What describes a class, or the place for its results, cannot be used; whoever named it must act."""


class VariantError(GraderError):
    """A student's variant cannot be drawn; whoever named the student must act."""


class KeyFileError(GraderError):
    """A key cannot be used; whoever named it must act."""


class EnvironmentFault(GraderError):  # noqa: N818 - named after what it is, like the others of its kind here
    """This machine lacks something that grading needs; whoever set it up must act."""


class HarnessError(GraderError):
    """The grader or the machine failed during a run; never the student's fault."""
