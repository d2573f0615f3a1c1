"""A real node graded by its student's variant, with a result that waits: graded, judged again, and handed back."""

import json
from pathlib import Path

import jsonschema
import pytest
from click.testing import CliRunner, Result
from report_samples import report_schema

from grader.cli import main
from grader.grading.rubrics.builtin import builtin_rubrics
from grader.runtime.shipped import shipped

SOLUTION = shipped("rubrics").parent / "reference_solutions" / "velocity_publisher.py"


def run(*words: str) -> Result:
    """Return what a command comes to."""
    return CliRunner().invoke(main.app, list(map(str, words)), catch_exceptions=False)


@pytest.mark.ros
def test_a_student_is_graded_by_their_own_values_and_sees_only_what_is_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Following the task sheet has full marks; evidence needs no key; what waits is in nothing handed back."""
    monkeypatch.chdir(tmp_path)
    text = builtin_rubrics()["velocity_publisher"].read_text(encoding="utf-8")
    variants = "\nvariants:\n  rate: {choose: [8 Hz, 12.5 Hz]}\n  speed: {between: [0.2, 0.4], step: 0.05}\nscenarios:"
    text = text.replace("\nscenarios:", variants, 1).replace("rate: 20 Hz,", "rate: {variant: rate},")
    text = text.replace("linear.x: 0.5,", "linear.x: {variant: speed},")
    waits = "    title: Turns at 0.1 rad/s\n    feedback: {show: nothing, until: 2026-12-01}\n"
    (tmp_path / "r.yaml").write_text(text.replace("    title: Turns at 0.1 rad/s\n", waits), encoding="utf-8")
    (tmp_path / "variant.key").write_text("a variant key of enough bytes\n", encoding="utf-8")
    sheet = run("rubric", "variant", "r.yaml", "--variant-key", "variant.key", "--student", "Ada", "--format", "json")
    values = json.loads(sheet.stdout)["values"]
    program = SOLUTION.read_text(encoding="utf-8")
    program = program.replace("RATE_HZ = 20", f"RATE_HZ = {values['rate'].split()[0]}")
    program = program.replace("FORWARD_MPS = 0.5", f"FORWARD_MPS = {values['speed']}")
    (tmp_path / "velocity_publisher.py").write_text(program, encoding="utf-8")

    whose = ["--rubric", "r.yaml", "--student", "ada ", "--variant-key", "variant.key"]
    graded = run("velocity_publisher.py", *whose, "-o", "json=graded.json", "-o", "evidence=kept", "--no-progress")
    report = json.loads((tmp_path / "graded.json").read_text(encoding="utf-8"))
    assert (graded.exit_code, report["score"], report["max_score"]) == (0, 30, 30)
    jsonschema.validate(report, report_schema())
    assert report["exercises"][0]["variant"] == {"student": "ada", "values": values}
    assert report["reproduce"]["command"].endswith("--student ada --variant-key variant.key")

    (tmp_path / "variant.key").unlink()
    assert run("rejudge", "kept", "--rubric", "r.yaml", "-o", "json=again.json").exit_code == 0
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "graded.json").read_bytes()

    student = ["--audience", "student", "--json", "--as-of"]
    before = json.loads(run("rejudge", "kept", "--rubric", "r.yaml", *student, "2026-12-01").stdout)
    after = json.loads(run("rejudge", "kept", "--rubric", "r.yaml", *student, "2026-12-02").stdout)
    assert (before["score"], before["max_score"]) == (25, 25)
    assert "angular_velocity" not in json.dumps(before)
    jsonschema.validate(before, report_schema())
    assert any(note.startswith("graded by the variant of ada: rate") for note in before["exercises"][0]["notes"])
    assert after == report
