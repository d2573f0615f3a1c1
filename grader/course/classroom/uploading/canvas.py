"""An assignment in Canvas, through its REST interface and the library canvasapi."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import requests
from canvasapi.assignment import Assignment
from canvasapi.course import Course
from canvasapi.exceptions import (
    BadRequest,
    CanvasException,
    Forbidden,
    InvalidAccessToken,
    RateLimitExceeded,
    ResourceDoesNotExist,
    Unauthorized,
    UnprocessableEntity,
)
from canvasapi.requester import Requester

from grader.course.classroom.uploading.marks import Account, PlatformError, RefusedMarkError, platform_words
from grader.course.classroom.uploading.web import Patient, documented

TOKEN = "CANVAS_TOKEN"  # noqa: S105  the name of the variable
_POINTS = ("points", "percent", "letter_grade", "gpa_scale")
_Made = TypeVar("_Made")


class Canvas:
    """An assignment of a course in Canvas."""

    def __init__(self, url: str, token: str, course: int, assignment: int) -> None:
        """Look up course and assignment; raises PlatformError if the token or one of them cannot be used."""
        requester = Requester(url, token)
        for scheme in ("https://", "http://"):  # the library itself waits forever
            requester._session.mount(scheme, Patient())  # noqa: SLF001
        self._url = url
        self._course = self._found(f"course {course}", lambda: Course(requester, _json(requester, f"courses/{course}")))
        self._assignment: Assignment = self._found(
            f"assignment {assignment} in course {course}", lambda: self._course.get_assignment(assignment)
        )
        self._submissions: dict[int, Any] = {}
        kind = str(getattr(self._assignment, "grading_type", ""))
        name, possible = str(self._assignment.name), getattr(self._assignment, "points_possible", None)
        self.title = f"{getattr(self._course, 'name', course)}: {name}"
        self.max_score: float | None = None if possible is None else float(possible)
        if kind not in _POINTS:
            raise PlatformError(f"{url}: {name}: expected an assignment that is graded in points, found {kind}")

    def accounts(self) -> Sequence[Account]:
        """Return the students of the course."""
        people = self._asked(lambda: list(self._course.get_users(enrollment_type=["student"], include=["email"])))
        with documented(self._url):
            return [_account(person) for person in people]

    def scores(self) -> Mapping[int, float]:
        """Return the scores as entered, before Canvas takes off anything for being late."""
        found = self._asked(lambda: list(self._assignment.get_submissions(include=["submission_comments"])))
        with documented(self._url):
            self._submissions = {int(submission.user_id): submission for submission in found}
            scores = {account: _score(submission) for account, submission in self._submissions.items()}
            return {account: float(score) for account, score in scores.items() if score is not None}

    def comments(self, account: int) -> Sequence[str]:
        """Return the comments on a submission, as read with the scores."""
        with documented(self._url):
            comments = getattr(self._submissions.get(account), "submission_comments", None) or ()
            return [str(comment.get("comment") or "") for comment in comments]

    def send(self, account: int, score: float, feedback: str) -> None:
        """Set the score; add the feedback as a comment, unless the submission has the same one already."""
        values: dict[str, Any] = {"submission": {"posted_grade": f"{score:.6g}"}}
        if feedback and feedback not in self.comments(account):
            values["comment"] = {"text_comment": feedback}
        submission = self._submissions.get(account)
        if submission is None:
            submission = self._asked(lambda: self._assignment.get_submission(account))
        try:
            self._asked(lambda: submission.edit(**values), passed=(BadRequest, UnprocessableEntity))
        except (BadRequest, UnprocessableEntity) as error:
            raise RefusedMarkError(platform_words(str(error).encode())) from None

    def _found(self, what: str, ask: Callable[[], _Made]) -> _Made:
        try:
            return self._asked(ask, passed=(ResourceDoesNotExist,))
        except ResourceDoesNotExist:
            hint = "the numbers are in the address: /courses/COURSE/assignments/ASSIGNMENT"
            raise PlatformError(f"{self._url}: there is no {what} for this token", hint) from None

    def _asked(self, ask: Callable[[], _Made], passed: tuple[type[CanvasException], ...] = ()) -> _Made:
        """Return the answer; raises PlatformError for all errors but those to be passed on."""
        try:
            return ask()
        except passed:
            raise
        except InvalidAccessToken:
            hint = "create one in Canvas: Account, Settings, New Access Token"
            raise PlatformError(f"{self._url}: Canvas does not accept the access token", hint) from None
        except RateLimitExceeded:
            raise PlatformError(f"{self._url}: too many requests", "run the same command again later") from None
        except (Unauthorized, Forbidden) as error:
            hint = "use a token of somebody who may grade in this course"
            raise PlatformError(f"{self._url}: not allowed: {platform_words(str(error).encode())}", hint) from None
        except (CanvasException, requests.RequestException, ValueError) as error:
            hint = "check --url and the network; run the same command again to continue"
            raise PlatformError(f"{self._url}: no usable answer: {type(error).__name__}: {error}"[:300], hint) from None


def _json(requester: Requester, path: str) -> dict[str, Any]:
    found: dict[str, Any] = requester.request("GET", path).json()
    return found


def _score(submission: Any) -> Any:
    entered = getattr(submission, "entered_score", None)
    return getattr(submission, "score", None) if entered is None else entered


def _account(person: Any) -> Account:
    fields = {"canvas": "id", "id": "sis_user_id", "username": "login_id", "email": "email"}
    ids = {kind: str(getattr(person, field, None) or "") for kind, field in fields.items()}
    return Account(int(person.id), str(person.name), {kind: value for kind, value in ids.items() if value})
