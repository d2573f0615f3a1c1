"""The folder for results: whole or not at all, whenever a run is stopped."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from grader.course.classroom.store import ResultStatus, State, Store, dump_status, load_status, open_store
from grader.runtime.model.errors import HarnessError


def status(state: State = State.GRADED, score: float = 1.0, key: str = "k") -> ResultStatus:
    return ResultStatus(state, key, "sha256:1", "ada", score=score, max_score=10.0)


def commit(store: Store, new: ResultStatus, name: str = "ada", text: str = "report") -> bool | None:
    """Commit a result with one file."""
    fresh = store.fresh(name)
    fresh.mkdir()
    (fresh / "report.json").write_text(text, encoding="utf-8")
    return store.commit(name, fresh, new)


def result_of(store: Store) -> ResultStatus:
    result = store.kept("ada").result
    assert result is not None
    return result


def leftovers(store: Store) -> list[str]:
    return [path.name for path in (store.folder / "students").iterdir() if path.name.startswith(".")]


def test_a_new_result_takes_the_place_of_the_old_one(tmp_path: Path) -> None:
    """Nothing of the old one stays."""
    with open_store(tmp_path) as store:
        assert commit(store, status(score=1.0), text="old")
        assert commit(store, status(score=2.0), text="new")
        assert result_of(store).score == 2.0
        assert (store.place("ada") / "report.json").read_text(encoding="utf-8") == "new"
        assert leftovers(store) == []


@pytest.mark.parametrize("step", range(1, 12))
def test_whenever_a_replacement_stops_one_of_both_results_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: int
) -> None:
    """The machine stops at the n-th change of the disk; the next run finds the old result or the new one, whole."""
    with open_store(tmp_path) as store:
        commit(store, status(score=1.0), text="old")
        calls = [0]

        def stopping(function: Callable[..., Any]) -> Callable[..., Any]:
            def wrapped(*arguments: Path | int | str, **named: int | None) -> object:
                calls[0] += 1
                if calls[0] == step:
                    raise KeyboardInterrupt
                return function(*arguments, **named)

            return wrapped

        with monkeypatch.context() as patched:
            for owner, name in ((os, "rename"), (os, "replace"), (os, "fsync"), (os, "rmdir"), (os, "unlink")):
                patched.setattr(owner, name, stopping(getattr(owner, name)))
            with contextlib.suppress(KeyboardInterrupt):
                commit(store, status(score=2.0), text="new")
    with open_store(tmp_path) as store:
        found = (result_of(store).score, (store.place("ada") / "report.json").read_text(encoding="utf-8"))
        assert found in [(1.0, "old"), (2.0, "new")]
        assert leftovers(store) == []


def test_an_unfinished_result_is_none(tmp_path: Path) -> None:
    """What a killed run left behind is removed, and the submission has no result."""
    with open_store(tmp_path) as store:
        fresh = store.fresh("ada")
        fresh.mkdir()
        (fresh / "report.json").write_text("half", encoding="utf-8")
    with open_store(tmp_path) as store:
        assert (store.names(), leftovers(store)) == ([], [])
        assert store.kept("ada").result is None


def test_a_stopped_run_tidies_up(tmp_path: Path) -> None:
    """What was being written is gone at once, not only when the command is given again."""

    def stopped() -> None:
        with open_store(tmp_path) as store:
            store.fresh("ada").mkdir()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert leftovers(Store(tmp_path)) == []


def test_a_worse_attempt_is_noted_and_a_better_one_forgets_it(tmp_path: Path) -> None:
    """The result stays, what was tried last is known."""
    with open_store(tmp_path) as store:
        commit(store, status(score=5.0))
        assert not commit(store, status(State.FAILED))
        kept = store.kept("ada")
        assert kept.result is not None
        assert kept.attempt is not None
        assert kept.last is not None
        assert (kept.result.score, kept.attempt.state, kept.last.state) == (5.0, State.FAILED, State.FAILED)
        assert commit(store, status(score=6.0))
        assert store.kept("ada").attempt is None


def test_what_cannot_be_written_leaves_the_result_of_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A full disk is the machine's fault, and asks to run the same command again."""
    with open_store(tmp_path) as store:
        commit(store, status(score=5.0), text="old")

        def full(*arguments: int) -> None:
            raise OSError(28, "No space left on device")

        with monkeypatch.context() as patched:
            patched.setattr(os, "fsync", full)
            with pytest.raises(HarnessError, match="No space left on device") as error:
                commit(store, status(score=6.0), text="new")
        assert "run the same command again" in error.value.hint
        assert result_of(store).score == 5.0


@pytest.mark.parametrize("data", [b"", b"{", b"[]", b'{"schema": "grader/batch-result/v1"}', b"\xff", b"[" * 5000])
def test_a_damaged_standing_is_none(data: bytes) -> None:
    """The submission is then graded again."""
    assert load_status(data) is None


def test_a_standing_survives_names_that_are_no_text() -> None:
    """Undecodable bytes in the name of a folder; otherwise it would be graded again for ever."""
    odd = ResultStatus(State.REFUSED, "k", "d", "ad\udcffa", "\u202e\x00\ud800")
    read = load_status(dump_status(odd))
    assert read is not None
    assert read.state is State.REFUSED


def test_a_standing_of_another_version_is_none() -> None:
    """It is not guessed at."""
    assert load_status(dump_status(status())) == status()
    assert load_status(dump_status(status()).replace(b"batch-result/v1", b"batch-result/v2")) is None


@pytest.mark.parametrize("cut", [b"", b'"bo', b"\xff\n", b"[1]\n"])
def test_what_is_pending_shrinks_by_a_line_for_each_submission(tmp_path: Path, cut: bytes) -> None:
    """A line that a stopped run could not write whole leaves its submission to be graded once more."""
    with open_store(tmp_path) as store:
        store.note_pending("all", ["ada", "bob", "cleo"])
        size = (tmp_path / ".pending.json").stat().st_size
        store.note_done("cleo", last=False)
        assert (tmp_path / ".pending.json").stat().st_size == size + len('"cleo"\n')
        with (tmp_path / ".pending.json").open("ab") as note:
            note.write(cut)
        assert store.pending("all") == {"ada", "bob"}
        assert store.pending("failed") is None
        store.note_done("ada", last=True)
        assert store.pending("all") is None
