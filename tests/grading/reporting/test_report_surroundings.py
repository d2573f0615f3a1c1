"""What a platform tells beside the report: where the repository is, and what was handed in."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from grader.grading.reporting.formats import repository_folder
from grader.grading.reporting.platforms.classroom50 import VARIABLES, handed_in
from grader.runtime.model.errors import GraderError

CLASSROOM = {
    **{name: f"the {field}" for field, name in VARIABLES.items()},
    "ASSIGNMENT_TYPE": "individual",
    "SUBMISSION_TAG": "submit/1",
    "COMMIT_DATETIME": "2026-01-31T10:00:00+02:00",
}


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    folder = tmp_path / "repository"
    (folder / "hw" / "ada").mkdir(parents=True)
    (folder / "hw" / "ada" / "velocity_publisher.py").touch()
    (folder / "hw" / "ada.zip").touch()
    (folder / ".git").mkdir()
    return folder


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        (".", ""),
        ("hw/ada", "hw/ada"),
        ("hw/ada/velocity_publisher.py", "hw/ada"),
        ("hw/../hw/ada", "hw/ada"),
        ("hw/ada.zip", None),
        ("hw/missing", None),
        ("..", None),
    ],
)
@pytest.mark.parametrize("in_a_job", [True, False])
def test_the_place_in_the_repository(repository: Path, path: str, expected: str | None, in_a_job: bool) -> None:
    """GitHub names files from the root of the checkout, wherever the command was given."""
    environment = {"GITHUB_WORKSPACE": str(repository)} if in_a_job else {}
    found = repository_folder(str(repository / path), environment)
    if path == ".." and not in_a_job:
        assert found != "repository"  # the folder above is no part of this checkout
    else:
        assert found == expected


def test_a_link_into_the_repository_is_followed(repository: Path, tmp_path: Path) -> None:
    """Annotations belong to the file that is there."""
    link = tmp_path / "link"
    link.symlink_to(repository / "hw")
    assert repository_folder(str(link), {}) == "hw"


def test_without_a_checkout_this_folder_is_the_root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A runner starts its steps there."""
    (tmp_path / "ada").mkdir()
    monkeypatch.chdir(tmp_path)
    if not any((folder / ".git").exists() for folder in tmp_path.parents):
        assert repository_folder("ada", {}) == "ada"


def test_what_was_handed_in_comes_from_the_environment() -> None:
    """Each field from the variable that the platform sets for it; the time in UTC."""
    found = handed_in(CLASSROOM)
    assert (found.username, found.review) == ("the username", "the review")
    assert found.datetime == "2026-01-31T08:00:00Z"
    assert handed_in({**CLASSROOM, "COMMIT_DATETIME": "2026-01-31T10:00:00Z"}).datetime == "2026-01-31T10:00:00Z"


def test_the_commit_s_time_may_come_from_the_event(tmp_path: Path) -> None:
    """GitHub writes it beside the job; what was set by hand counts more."""
    event = tmp_path / "event.json"
    event.write_text(json.dumps({"head_commit": {"timestamp": "2026-01-30T23:30:00-01:00"}}))
    environment = {**CLASSROOM, "GITHUB_EVENT_PATH": str(event)}
    assert handed_in(environment).datetime == "2026-01-31T08:00:00Z"
    del environment["COMMIT_DATETIME"]
    assert handed_in(environment).datetime == "2026-01-31T00:30:00Z"


@pytest.mark.parametrize("event", ["", "{", "[]", "null", '{"head_commit": null}', '{"head_commit": {}}'])
@pytest.mark.parametrize("by_hand", ["", "yesterday", "2026-01-31T10:00:00", "2026-01-31"])
def test_a_time_that_cannot_be_known_is_asked_for(tmp_path: Path, event: str, by_hand: str) -> None:
    """The time of grading is no substitute."""
    path = tmp_path / "event.json"
    path.write_text(event)
    environment = {**CLASSROOM, "GITHUB_EVENT_PATH": str(path), "COMMIT_DATETIME": by_hand}
    with pytest.raises(GraderError, match="COMMIT_DATETIME: expected the commit's time") as error:
        handed_in(environment)
    assert "git show" in error.value.hint


@pytest.mark.parametrize("name", VARIABLES.values())
def test_a_missing_variable_is_named(name: str) -> None:
    """All that are missing, in one line."""
    environment = {**CLASSROOM, name: ""}
    with pytest.raises(GraderError, match=f"found no {name}$"):
        handed_in(environment)


@pytest.mark.parametrize(("name", "value"), [("SUBMISSION_TAG", "v1"), ("ASSIGNMENT_TYPE", "solo")])
def test_a_value_that_the_platform_would_refuse_is_refused_here(name: str, value: str) -> None:
    """Before anything is graded."""
    with pytest.raises(GraderError, match=name):
        handed_in({**CLASSROOM, name: value})


def test_nothing_is_read_but_what_is_named() -> None:
    """An event file that is not there is as good as none."""
    environment = {**CLASSROOM, "GITHUB_EVENT_PATH": str(Path("/nowhere/event.json"))}
    assert handed_in(environment).datetime == "2026-01-31T08:00:00Z"
