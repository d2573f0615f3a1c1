"""An assignment in Moodle, through its web services, for which no Python library is kept up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import requests

from grader.course.classroom.uploading.marks import Account, PlatformError, RefusedMarkError
from grader.course.classroom.uploading.web import Patient, documented

TOKEN = "MOODLE_TOKEN"  # noqa: S105  the name of the variable
#: The functions that the token's service must have.
FUNCTIONS = (
    "mod_assign_get_assignments",
    "core_enrol_get_enrolled_users",
    "mod_assign_get_grades",
    "mod_assign_get_submission_status",
    "mod_assign_save_grade",
)
_PLAIN_TEXT = "2"  # FORMAT_PLAIN of Moodle
_MAX_SAID = 200


class _RefusalError(Exception):
    """Moodle answers with an exception of its own."""

    def __init__(self, code: str, message: str) -> None:
        super().__init__(f"{message} ({code})"[:_MAX_SAID])
        self.code = code


class Moodle:
    """An assignment of a course in Moodle."""

    def __init__(self, url: str, token: str, course: int, assignment: int) -> None:
        """Look up course and assignment, named by the number in its address; raises PlatformError as for Canvas."""
        self._url, self._token, self._course_id = url, token, course
        self._session = requests.Session()
        for scheme in ("https://", "http://"):
            self._session.mount(scheme, Patient())
        with documented(url):
            self._look_up(assignment)

    def _look_up(self, assignment: int) -> None:
        url, course = self._url, self._course_id
        asked = self._asked("mod_assign_get_assignments", {"courseids[0]": course})
        courses = [each for each in asked["courses"] if each["id"] == course]
        if not courses:
            why = "; ".join(str(warning.get("message", "")) for warning in asked.get("warnings", ()))
            hint = "the number is in the address of the course: /course/view.php?id=COURSE"
            raise PlatformError(f"{url}: there is no course {course} for this token: {why}"[:300].rstrip(": "), hint)
        found = [each for each in courses[0]["assignments"] if each["cmid"] == assignment]
        if not found:
            hint = "the number is in the address of the assignment: /mod/assign/view.php?id=ASSIGNMENT"
            raise PlatformError(f"{url}: there is no assignment {assignment} in course {course}", hint)
        self._assignment = int(found[0]["id"])
        self.title = f"{courses[0].get('fullname', course)}: {found[0].get('name', assignment)}"
        most = float(found[0].get("grade", 0))
        self.max_score: float | None = most
        if most <= 0:
            kind = "a scale" if most < 0 else "no grade"
            raise PlatformError(f"{url}: {self.title}: expected an assignment that is graded in points, found {kind}")

    def accounts(self) -> Sequence[Account]:
        """Return everybody in the course; Moodle shows roles only to some."""
        people = self._asked("core_enrol_get_enrolled_users", {"courseid": self._course_id})
        with documented(self._url):
            return [_account(person) for person in people]

    def scores(self) -> Mapping[int, float]:
        """Return the scores of the latest attempts."""
        found = self._asked("mod_assign_get_grades", {"assignmentids[0]": self._assignment})
        with documented(self._url):
            grades = [grade for each in found["assignments"] for grade in each["grades"]]
            latest = sorted(grades, key=lambda grade: int(grade.get("attemptnumber", 0)))
            # Moodle writes -1 for no grade.
            return {int(grade["userid"]): score for grade in latest if (score := float(grade["grade"] or -1)) >= 0}

    def comments(self, account: int) -> Sequence[str]:
        """Return the feedback comment of a student, which Moodle may have turned into HTML."""
        asked = {"assignid": self._assignment, "userid": account}
        status = self._asked("mod_assign_get_submission_status", asked)
        with documented(self._url):
            feedback = status.get("feedback") or {}
            plugins = [plugin for plugin in feedback.get("plugins", ()) if plugin.get("type") == "comments"]
            return [str(field.get("text", "")) for plugin in plugins for field in plugin.get("editorfields", ())]

    def send(self, account: int, score: float, feedback: str) -> None:
        """Set the score, and replace the feedback comment."""
        if self.max_score is not None and score > self.max_score:  # Moodle would ignore the score without a word
            raise RefusedMarkError(f"{score:g} points, where the assignment has {self.max_score:g}")
        values: dict[str, object] = {
            "assignmentid": self._assignment,
            "userid": account,
            "grade": f"{score:.6g}",
            "attemptnumber": -1,  # the latest
            "addattempt": 0,
            "workflowstate": "",
            "applytoall": 0,  # in groups, each has a score of their own
        }
        if feedback:
            values["plugindata[assignfeedbackcomments_editor][text]"] = feedback
            values["plugindata[assignfeedbackcomments_editor][format]"] = _PLAIN_TEXT
        try:
            self._called("mod_assign_save_grade", values)
        except _RefusalError as error:
            if error.code in _OF_ALL:
                raise self._error(error) from None
            raise RefusedMarkError(str(error)) from None

    def _asked(self, function: str, values: Mapping[str, object]) -> Any:
        try:
            return self._called(function, values)
        except _RefusalError as error:
            raise self._error(error, function) from None

    def _called(self, function: str, values: Mapping[str, object]) -> Any:
        """Call a function; the token is in the body, so that no log has it. Raises _RefusalError and PlatformError."""
        call = {**values, "wstoken": self._token, "wsfunction": function, "moodlewsrestformat": "json"}
        try:
            # A redirected POST would arrive as a GET without the values.
            address = f"{self._url}/webservice/rest/server.php"
            answer = self._session.post(address, data=call, allow_redirects=False)
            if answer.is_redirect:
                where = str(answer.headers.get("Location", ""))[:_MAX_SAID]
                raise PlatformError(f"{self._url}: Moodle is at another address: {where}", "name that address in --url")
            answer.raise_for_status()
            found = answer.json()
        except (requests.RequestException, ValueError) as error:
            hint = "check --url and the network, and that web services with REST are switched on"
            text = str(error).replace(self._token, "...")
            raise PlatformError(f"{self._url}: no usable answer: {type(error).__name__}: {text}"[:300], hint) from None
        if isinstance(found, dict) and "exception" in found:
            raise _RefusalError(str(found.get("errorcode", "")), str(found.get("message", "")))
        return found

    def _error(self, refusal: _RefusalError, function: str = "") -> PlatformError:
        if refusal.code == "invalidtoken":
            return PlatformError(f"{self._url}: Moodle does not accept the access token", "create a new one in Moodle")
        asking = f" {function}" if function else ""
        hint = f"the token's service needs the functions {', '.join(FUNCTIONS)}, and its user must be allowed to grade"
        return PlatformError(f"{self._url}: Moodle refuses{asking}: {refusal}", hint)


#: Codes of refusals that concern everybody, not one mark.
_OF_ALL = ("invalidtoken", "accessexception", "servicenotavailable", "enablewsdescription", "requireloginerror")


def _account(person: Mapping[str, Any]) -> Account:
    fields = {"id": "idnumber", "username": "username", "email": "email"}
    ids = {kind: str(person.get(field) or "") for kind, field in fields.items()}
    return Account(int(person["id"]), str(person["fullname"]), {kind: value for kind, value in ids.items() if value})
