"""A folder of evidence: what is kept comes back, what belongs to others stays, and damage is refused by name."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from kept_runs import kept_run, velocity_exercise, velocity_run, velocity_trace

from grader.grading.evidence.manifest import scenario_digest
from grader.grading.evidence.store import check_place, first_report, found_under, open_evidence, run_of
from grader.runtime.model.errors import EvidenceError
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.trace import AssessedTrace, Delivery, Message, Request, Response
from grader.runtime.stimuli.messages import MessageStream
from grader.runtime.stimuli.simulation import Simulated

RECORDING = "velocity_publisher.alone/velocity_publisher.alone_0.mcap"
OWN = {"evidence.json", "report.json", RECORDING, "velocity_publisher.alone/metadata.yaml"}


def files(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def without_bytes(trace: AssessedTrace) -> AssessedTrace:
    with_bytes = (Message, Delivery, Request, Response)
    plain = [dataclasses.replace(o, cdr=b"") if isinstance(o, with_bytes) else o for o in trace.observations]
    return dataclasses.replace(trace, observations=tuple(plain))


def test_all_that_judging_reads_comes_back(tmp_path: Path) -> None:
    """The trace, the sources, the submission but for where it lay, the environment, the seed and the notes."""
    run = velocity_run(velocity_trace())
    kept_run(tmp_path, run)
    assert files(tmp_path) == OWN
    found = run_of(open_evidence(tmp_path), [velocity_exercise()])
    assert dict(found.traces) == {key: without_bytes(trace) for key, trace in run.traces.items()}
    same = {f.name for f in dataclasses.fields(run)} - {"submission", "traces"}
    assert {name: getattr(found, name) for name in same} == {name: getattr(run, name) for name in same}
    assert dataclasses.replace(found.submission, root=run.submission.root) == run.submission


def test_a_scenario_that_could_not_be_recorded_stays_so(tmp_path: Path) -> None:
    """A missing file is no damage."""
    kept_run(tmp_path, velocity_run(None))
    found = run_of(open_evidence(tmp_path), [velocity_exercise()])
    assert found.traces == {}
    assert found.submission.files["velocity_publisher.py"].found is None


def test_the_same_run_gives_the_same_files(tmp_path: Path) -> None:
    """Byte for byte, so that evidence can be compared."""
    for name in ("a", "b"):
        kept_run(tmp_path / name, velocity_run(velocity_trace()))
    assert {n: (tmp_path / "a" / n).read_bytes() for n in OWN} == {n: (tmp_path / "b" / n).read_bytes() for n in OWN}


def test_what_was_kept_before_is_replaced_and_nothing_else(tmp_path: Path) -> None:
    """Recordings that the new run lacks are gone; files of others stay as they are."""
    kept_run(tmp_path, velocity_run(velocity_trace()))
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "velocity_publisher.alone" / "mine.txt").write_text("mine")
    kept_run(tmp_path, velocity_run(None))
    assert files(tmp_path) == {"evidence.json", "report.json", "notes.txt", "velocity_publisher.alone/mine.txt"}


@pytest.mark.parametrize("name", ["evidence.json", "report.json"])
def test_files_of_others_are_refused_before_grading(tmp_path: Path, name: str) -> None:
    """What is not the grader's is never replaced, whatever it is called."""
    (tmp_path / name).write_text("{}")
    with pytest.raises(EvidenceError, match=f"{name}: expected nothing or kept evidence"):
        check_place(tmp_path)
    assert (tmp_path / name).read_text() == "{}"


def test_a_recording_of_others_is_refused(tmp_path: Path) -> None:
    """Also where it has the very name of a recording, or is reached through a link."""
    (tmp_path / "a" / RECORDING).parent.mkdir(parents=True)
    (tmp_path / "a" / RECORDING).write_text("mine")
    with pytest.raises(EvidenceError, match="found another file"):
        kept_run(tmp_path / "a", velocity_run(velocity_trace()))
    assert (tmp_path / "a" / RECORDING).read_text() == "mine"
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "velocity_publisher.alone").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(EvidenceError, match="expected a folder, found a link"):
        kept_run(tmp_path / "b", velocity_run(velocity_trace()))
    assert files(tmp_path / "elsewhere") == set()


def test_a_forged_manifest_makes_nothing_ours(tmp_path: Path) -> None:
    """Names that the grader never writes are not removed, whatever a manifest claims."""
    kept_run(tmp_path / "a", velocity_run(velocity_trace()))
    manifest = json.loads((tmp_path / "a" / "evidence.json").read_text())
    manifest["files"] += ["../mine.txt", "mine.txt", "/etc/passwd"]
    (tmp_path / "a" / "evidence.json").write_text(json.dumps(manifest))
    for mine in (tmp_path / "mine.txt", tmp_path / "a" / "mine.txt"):
        mine.write_text("mine")
    kept_run(tmp_path / "a", velocity_run(None))
    assert (tmp_path / "mine.txt").exists()
    assert (tmp_path / "a" / "mine.txt").exists()


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    """The mistake is told before anything runs."""
    (tmp_path / "file").write_text("")
    with pytest.raises(EvidenceError, match="expected a folder for the evidence, found a file"):
        check_place(tmp_path / "file")


def refused(folder: Path, *, verify: bool = False) -> str:
    with pytest.raises(EvidenceError) as error:
        run_of(open_evidence(folder), [velocity_exercise()], verify=verify)
    return error.value.message


@pytest.mark.parametrize(
    ("name", "damage", "said"),
    [
        (RECORDING, lambda data: data[:-1], f"{RECORDING}: expected the recording sha256:"),
        (RECORDING, lambda data: data.replace(b"ros2msg", b"ros3msg"), f"{RECORDING}: expected the recording"),
        (RECORDING, None, f"{RECORDING}: expected a file of kept evidence, found nothing there"),
        ("evidence.json", None, "evidence.json: expected a file of kept evidence, found nothing there"),
        ("evidence.json", lambda data: data[:-9], "evidence.json: expected grader/evidence/v1, found something else"),
        ("evidence.json", lambda data: b"[" * 100_000, "expected grader/evidence/v1, found something else"),
        (
            "evidence.json",
            lambda data: data.replace(b"evidence/v1", b"evidence/v2"),
            "found the format grader/evidence/v2",
        ),
        ("evidence.json", lambda data: data.replace(b'"seed": 7', b'"seed": "7"'), "found something else"),
        ("evidence.json", lambda data: data.replace(b'"complete": true', b'"complete": false'), "unfinished evidence"),
    ],
    ids=["cut", "changed", "gone", "no manifest", "cut manifest", "deep", "version", "wrong type", "unfinished"],
)
def test_damage_is_refused_by_name(tmp_path: Path, name: str, damage: Callable[..., Any] | None, said: str) -> None:
    """The file is named, and what was expected of it."""
    kept_run(tmp_path, velocity_run(velocity_trace()))
    path = tmp_path / name
    data = path.read_bytes()
    path.unlink()
    if damage is not None:
        path.write_bytes(damage(data))
    message = refused(tmp_path)
    assert said in message
    assert str(tmp_path) in message


def test_a_recording_that_shows_something_else_is_found(tmp_path: Path) -> None:
    """Who changes what other tools see, and fixes the digest, is found by comparing it with what is judged."""
    kept_run(tmp_path / "a", velocity_run(velocity_trace()))
    kept_run(tmp_path / "b", velocity_run(velocity_trace(forward=0.7)))
    one, other = ((tmp_path / n / RECORDING).read_bytes() for n in "ab")
    assert run_of(open_evidence(tmp_path / "a"), [velocity_exercise()], verify=True)
    forged = spliced(one, other)
    old, new = (json.loads((tmp_path / "a" / "evidence.json").read_text()) for _ in "ab")
    from grader.grading.evidence.manifest import sha256

    new["exercises"][0]["recordings"][0]["digest"] = sha256(forged)
    assert new != old
    (tmp_path / "a" / "evidence.json").write_text(json.dumps(new))
    (tmp_path / "a" / RECORDING).write_bytes(forged)
    assert "found one that shows something else" in refused(tmp_path / "a", verify=True)


def spliced(shown: bytes, judged: bytes) -> bytes:
    """Return a recording that shows the messages of one, and holds the trace of another."""
    import io

    from mcap.reader import make_reader
    from mcap.writer import Writer

    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start(profile="ros2", library="forger")
    ids = {}
    for schema, channel, message in make_reader(io.BytesIO(shown)).iter_messages(log_time_order=False):
        assert schema is not None
        if channel.id not in ids:
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            ids[channel.id] = writer.register_channel(channel.topic, "cdr", number, channel.metadata)
        writer.add_message(ids[channel.id], message.log_time, message.data, message.publish_time, message.sequence)
    for attachment in make_reader(io.BytesIO(judged)).iter_attachments():
        writer.add_attachment(0, 0, attachment.name, attachment.media_type, attachment.data)
    writer.finish()  # type: ignore[no-untyped-call]
    return stream.getvalue()


def test_a_pipe_in_the_place_of_a_file_is_refused(tmp_path: Path) -> None:
    """Reading does not wait for a writer."""
    kept_run(tmp_path, velocity_run(velocity_trace()))
    (tmp_path / RECORDING).unlink()
    os.mkfifo(tmp_path / RECORDING)
    assert "expected a regular file, found something else" in refused(tmp_path)


def test_a_recording_answers_only_what_was_asked(tmp_path: Path) -> None:
    """A scenario that a rubric describes otherwise now forbids judging and says why."""
    kept_run(tmp_path, velocity_run(velocity_trace()))
    exercise = velocity_exercise()
    longer = dataclasses.replace(exercise.scenarios[0], span=Span(20 * 10**9))
    found = run_of(open_evidence(tmp_path), [dataclasses.replace(exercise, scenarios=(longer,))])
    (trace,) = found.traces.values()
    assert "has changed the scenario alone since it was recorded" in trace.harness_problem


def test_the_digest_of_a_scenario_is_of_what_differs_from_defaults() -> None:
    """A new field with a default does not make all evidence worthless."""
    scenario = velocity_exercise().scenarios[0]
    assert scenario_digest(scenario) == scenario_digest(dataclasses.replace(scenario, stimuli=()))
    assert scenario_digest(scenario) != scenario_digest(dataclasses.replace(scenario, processes=("x.py",)))


def test_the_digest_of_a_scenario_knows_the_text_of_a_simulation() -> None:
    """An author's simulation is part of what was recorded."""
    scenario = velocity_exercise().scenarios[0]
    texts = (b"class A: pass", b"class A: pass", b"class B: pass")
    digests = [
        scenario_digest(dataclasses.replace(scenario, stimuli=(Simulated("a", {}, "a.py", text),))) for text in texts
    ]
    assert digests[0] == digests[1] != digests[2]


def test_the_first_report_may_be_gone(tmp_path: Path) -> None:
    """Judging does not need it."""
    kept_run(tmp_path, velocity_run(velocity_trace()))
    first = first_report(open_evidence(tmp_path))
    assert first is not None
    assert first["score"] == 30
    for content in ("[]", "{", None):
        (tmp_path / "report.json").unlink()
        if content is not None:
            (tmp_path / "report.json").write_text(content)
        assert first_report(open_evidence(tmp_path)) is None


def test_evidence_is_found_at_any_depth(tmp_path: Path) -> None:
    """Also what lost its manifest, which is then refused by name and not passed over."""
    for name in ("b/evidence", "a", "c/d/e"):
        kept_run(tmp_path / name, velocity_run(velocity_trace()))
    (tmp_path / "c/d/e/evidence.json").unlink()
    (tmp_path / "empty").mkdir()
    assert found_under(tmp_path) == [tmp_path / name for name in ("a", "b/evidence", "c/d/e")]


def test_nothing_of_the_machine_is_kept(tmp_path: Path) -> None:
    """The folder that the submission was staged in is no part of evidence."""
    run = velocity_run(velocity_trace())
    secret = Path("/somewhere/on/this/machine")
    kept_run(tmp_path, dataclasses.replace(run, submission=dataclasses.replace(run.submission, root=secret)))
    assert [name for name in files(tmp_path) if b"somewhere" in (tmp_path / name).read_bytes()] == []


def test_scenarios_with_messages_have_digests_too() -> None:
    """Fields of messages are mappings; the same ones give the same digest, others another."""
    spans = [{"data": "a"}, {"data": "a"}, {"data": "b"}]
    streams = [MessageStream("/t", "std_msgs/msg/String", (value,), period_ns=1) for value in spans]
    first, same, other = (scenario_digest(Scenario("s", ("a.py",), Span(1), (stream,))) for stream in streams)
    assert first == same != other
