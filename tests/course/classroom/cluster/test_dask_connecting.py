"""Before a cluster is used: what is missing is said at once, with what to do."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from grader.cli.main import app
from grader.course.classroom.cluster.dispatcher import connected, scheduler_address
from grader.runtime.model.errors import EnvironmentFault


def test_without_the_library_nothing_begins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Exit code 2 and what to install, before the class is looked at; environments of uv have no pip."""
    monkeypatch.setitem(sys.modules, "pip", None)
    monkeypatch.setitem(sys.modules, "distributed", None)
    done = CliRunner().invoke(
        app, ["batch", str(tmp_path / "none"), "-o", str(tmp_path / "o"), "--scheduler", "tcp://x:1"]
    )
    assert done.exit_code == 2
    assert done.stderr.splitlines() == [
        "error: --scheduler: expected the package distributed of the extra 'dask', found none",
        f"hint: uv pip install --python {sys.executable} 'distributed<2027,>=2024.9'",
    ]
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "127.0.0.1:9"])
def test_a_scheduler_that_does_not_answer_is_waited_for_a_while(address: str) -> None:
    """Then it is named."""
    with (
        pytest.raises(EnvironmentFault, match=f"--scheduler {address}: expected a Dask scheduler, found none") as error,
        connected(address, None, lambda line: None, timeout_s=0.2),
    ):
        pass
    assert "dask scheduler" in error.value.hint


def test_an_address_of_no_known_kind_is_refused() -> None:
    """With the kinds that there are."""
    with pytest.raises(EnvironmentFault, match="unknown address scheme"), connected("foo://x:1", None, print):
        pass


def test_encryption_needs_certificates() -> None:
    """They are asked for before anybody is called."""
    with (
        pytest.raises(EnvironmentFault, match="expected certificates in Dask's configuration, found none"),
        connected("tls://127.0.0.1:9", None, print),
    ):
        pass


def test_a_scheduler_file_holds_the_address(tmp_path: Path) -> None:
    """As `dask scheduler --scheduler-file` writes it."""
    path = tmp_path / "scheduler.json"
    path.write_text(json.dumps({"address": "tcp://10.0.0.1:8786", "workers": {}}), encoding="utf-8")
    assert scheduler_address(str(path)) == "tcp://10.0.0.1:8786"
    assert scheduler_address("tls://h:1") == "tls://h:1"


@pytest.mark.parametrize("content", [None, "", "[]", "{}", "[" * 100_000])
def test_another_file_is_refused(tmp_path: Path, content: str | None) -> None:
    """One that is not there, too: nobody waits for it to appear."""
    path = tmp_path / "scheduler.json"
    if content is not None:
        path.write_text(content, encoding="utf-8")
    with pytest.raises(EnvironmentFault, match=r"--scheduler .*scheduler\.json: expected"):
        scheduler_address(str(path))
