"""Local stand-ins for Canvas and Moodle: they speak the documented interfaces over HTTP, with errors on request."""

from __future__ import annotations

import html
import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlsplit

TOKEN = "7~secret-token"
COURSE, ASSIGNMENT = 7, 31
#: What Moodle calls the assignment inside, other than in its address.
MOODLE_ID = 900
#: Entries of a page, however many are asked for.
PAGE = 2


@dataclass
class Course:
    """What a platform stores, and how it misbehaves."""

    people: dict[int, dict[str, str]]  # number of the account -> name, email, login and number at the institution
    scores: dict[int, float] = field(default_factory=dict)
    comments: dict[int, list[str]] = field(default_factory=dict)
    writes: list[int] = field(default_factory=list)  # accounts in the order of the requests that changed something
    calls: list[str] = field(default_factory=list)
    stop_after: int | None = None  # writes after which the server fails
    refuse: frozenset[int] = frozenset()  # accounts whose marks are refused
    less: float = 0.0  # taken off what is stored
    points: float = 10.0
    kind: str = "points"
    page_of_errors: bool = False  # whether everything is answered by a web page

    def write(self, account: int, score: float, comment: str | None, *, append: bool) -> None:
        self.writes.append(account)
        self.scores[account] = score - self.less
        if comment is not None:
            self.comments[account] = [*self.comments.get(account, []), comment] if append else [comment]

    @property
    def is_down(self) -> bool:
        return self.stop_after is not None and len(self.writes) >= self.stop_after


class _Handler(BaseHTTPRequestHandler):
    course: Course

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        pass

    def form(self) -> dict[str, str]:
        data = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        return {name: values[-1] for name, values in parse_qs(data.decode(), keep_blank_values=True).items()}

    def answer(self, value: object, status: int = 200, **headers: str) -> None:
        web_page = self.course.page_of_errors
        data = b"<html><body>Maintenance</body></html>" if web_page else json.dumps(value).encode()
        self.send_response(status)
        self.send_header("Content-Type", "text/html" if web_page else "application/json")
        self.send_header("Content-Length", str(len(data)))
        for name, text in headers.items():
            self.send_header(name.replace("_", "-"), text)
        self.end_headers()
        self.wfile.write(data)


class CanvasHandler(_Handler):
    """The parts of https://developerdocs.instructure.com/services/canvas that an upload uses."""

    def do_GET(self) -> None:
        self.respond(self.read)

    def do_PUT(self) -> None:
        self.respond(self.write)

    def respond(self, act: Any) -> None:
        form = self.form()
        parts = urlsplit(self.path)
        self.course.calls.append(f"{self.command} {parts.path}")
        if self.headers["Authorization"] != f"Bearer {TOKEN}":
            errors = {"errors": [{"message": "Invalid access token."}]}
            self.answer(errors, 401, WWW_Authenticate='Bearer realm="canvas-lms"')
            return
        act(parts.path.removeprefix("/api/v1/").rstrip("/"), parse_qs(parts.query), form)

    def read(self, path: str, query: dict[str, list[str]], form: dict[str, str]) -> None:
        course, here = self.course, f"courses/{COURSE}"
        if path == here:
            self.answer({"id": COURSE, "name": "Robotics"})
        elif path == f"{here}/assignments/{ASSIGNMENT}":
            self.answer({"id": ASSIGNMENT, "course_id": COURSE, "name": "Homework",
                         "points_possible": course.points, "grading_type": course.kind})  # fmt: skip
        elif path in (f"{here}/users", f"{here}/search_users"):
            assert query["enrollment_type[]"] == ["student"]
            self.page([self.user(number) for number in course.people], query)
        elif path == f"{here}/assignments/{ASSIGNMENT}/submissions":
            assert query["include[]"] == ["submission_comments"]
            self.page([self.submission(number) for number in course.people], query)
        else:
            self.answer({"errors": [{"message": "The specified resource does not exist."}]}, 404)

    def page(self, entries: list[Any], query: dict[str, list[str]]) -> None:
        number = int(query.get("page", ["1"])[0])
        more = len(entries) > number * PAGE
        host, path = self.headers["Host"], urlsplit(self.path).path
        following = "&".join(f"{k}={v}" for k, values in query.items() if k != "page" for v in values)
        link = {"Link": f'<http://{host}{path}?{following}&page={number + 1}>; rel="next"'} if more else {}
        self.answer(entries[(number - 1) * PAGE : number * PAGE], 200, **link)

    def user(self, number: int) -> dict[str, Any]:
        person = self.course.people[number]
        return {"id": number, "name": person["name"], "sis_user_id": person.get("id"), "login_id": person.get("login"),
                "email": person.get("email")}  # fmt: skip

    def submission(self, number: int) -> dict[str, Any]:
        comments = [{"id": k, "comment": text} for k, text in enumerate(self.course.comments.get(number, []))]
        score = self.course.scores.get(number)
        return {"user_id": number, "assignment_id": ASSIGNMENT, "score": score, "entered_score": score,
                "submission_comments": comments}  # fmt: skip

    def write(self, path: str, query: dict[str, list[str]], form: dict[str, str]) -> None:
        number = int(path.rsplit("/", 1)[1])
        assert path == f"courses/{COURSE}/assignments/{ASSIGNMENT}/submissions/{number}"
        if self.course.is_down:
            self.answer({"errors": [{"message": "down"}]}, 503)
        elif number in self.course.refuse:
            self.answer({"errors": [{"message": "This grading period is <b>closed</b>."}]}, 400)
        else:
            score = float(form["submission[posted_grade]"])
            self.course.write(number, score, form.get("comment[text_comment]"), append=True)
            self.answer(self.submission(number))


class MoodleHandler(_Handler):
    """The web service functions of Moodle that an upload uses; errors come with status 200, as in Moodle."""

    def do_POST(self) -> None:
        form = self.form()
        function = form["wsfunction"]
        self.course.calls.append(function)
        assert self.path == "/webservice/rest/server.php"
        assert form["moodlewsrestformat"] == "json"
        if form["wstoken"] != TOKEN:
            self.refuse("invalidtoken", "Invalid token - token not found")
            return
        self.answer_to(function, form)

    def refuse(self, code: str, message: str) -> None:
        self.answer({"exception": "core\\exception\\moodle_exception", "errorcode": code, "message": message})

    def answer_to(self, function: str, form: dict[str, str]) -> None:
        course = self.course
        if function == "mod_assign_get_assignments":
            self.answer(self.assignments(int(form["courseids[0]"])))
        elif function == "core_enrol_get_enrolled_users":
            self.answer([self.user(number) for number in course.people])
        elif function == "mod_assign_get_grades":
            assert form["assignmentids[0]"] == str(MOODLE_ID)
            grades = [
                {"userid": n, "attemptnumber": 0, "grade": f"{course.scores.get(n, -1):.5f}"} for n in course.people
            ]
            self.answer({"assignments": [{"assignmentid": MOODLE_ID, "grades": grades}], "warnings": []})
        elif function == "mod_assign_get_submission_status":
            texts = [html.escape(text) for text in course.comments.get(int(form["userid"]), [])]
            fields = [{"name": "comments", "text": text, "format": 1} for text in texts]
            self.answer({"feedback": {"plugins": [{"type": "comments", "editorfields": fields}]}, "warnings": []})
        else:
            self.save(form)

    def assignments(self, course: int) -> dict[str, Any]:
        if course != COURSE:
            why = "User is not enrolled or does not have requested capability"
            return {"courses": [], "warnings": [{"item": "course", "itemid": course, "message": why}]}
        most = self.course.points if self.course.kind == "points" else -3
        made = {"id": MOODLE_ID, "cmid": ASSIGNMENT, "name": "Homework", "grade": most}
        return {"courses": [{"id": COURSE, "fullname": "Robotics", "assignments": [made]}], "warnings": []}

    def user(self, number: int) -> dict[str, Any]:
        person = self.course.people[number]
        found = {"id": number, "fullname": person["name"], "idnumber": person.get("id"),
                 "username": person.get("login"), "email": person.get("email")}  # fmt: skip
        return {name: value for name, value in found.items() if value is not None}

    def save(self, form: dict[str, str]) -> None:
        assert form["wsfunction"] == "mod_assign_save_grade"
        assert (form["assignmentid"], form["attemptnumber"]) == (str(MOODLE_ID), "-1")
        number = int(form["userid"])
        if self.course.is_down:
            self.answer({}, 503)
        elif number in self.course.refuse:
            self.refuse("nopermission", "This grading period is <b>closed</b>.")
        else:
            text = form.get("plugindata[assignfeedbackcomments_editor][text]")
            self.course.write(number, float(form["grade"]), text, append=False)
            self.answer(None)


HANDLERS = {"canvas": CanvasHandler, "moodle": MoodleHandler}


@contextmanager
def serving(platform: str, course: Course) -> Iterator[str]:
    """Serve a course on this machine; yield the address of the platform."""
    handler = type("Handler", (HANDLERS[platform],), {"course": course})
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()
