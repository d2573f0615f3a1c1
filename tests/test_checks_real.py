"""Every check is tried on golden traces and on real nodes: the table says where, and these are the real runs."""

from functools import lru_cache
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from grader.app.grade import Request, grade
from grader.judging.asking import check_name
from grader.judging.checks import CHECKS
from grader.rubrics.loader import read_rubric

ROOT = Path(__file__).resolve().parent.parent
REAL = ROOT / "tests" / "real_checks"
NODES = ROOT / "tests" / "execution" / "service_nodes"
TABLE = YAML(typ="safe").load((ROOT / "tests" / "checks_real.yaml").read_text(encoding="utf-8"))


@lru_cache
def asked_in(rubric):
    """Return the names of the checks that a rubric asks, in its order."""
    return [check_name(criterion) for criterion in read_rubric(rubric).criteria]


def test_the_table_misses_no_check():
    """A new check needs golden traces and a real run, or a reason why it has none."""
    assert list(TABLE) == list(CHECKS)
    assert all(set(row) in ({"golden", "real"}, {"golden", "not_real"}) for row in TABLE.values())


@pytest.mark.parametrize("name", TABLE)
def test_the_table_tells_the_truth(name):
    """The module knows the check, and a criterion of the rubric asks it."""
    row = TABLE[name]
    golden = (ROOT / row["golden"]).read_text(encoding="utf-8")
    assert CHECKS[name].__name__ in golden
    if "real" in row:
        assert name in asked_in(ROOT / row["real"])


def outcomes(folder, rubric):
    """Grade a folder and return the outcome of each criterion by its check's name, with its reason."""
    report = grade(Request(str(folder), rubrics=(REAL / rubric,), clock="virtual"), lambda _: None)
    verdicts = report.exercises[0].verdicts
    told = {v.id: v.reason for v in verdicts}
    return [(name, v.outcome.value) for name, v in zip(asked_in(REAL / rubric), verdicts, strict=True)], told


@pytest.mark.ros
@pytest.mark.parametrize(
    ("folder", "rubric"), [(REAL / "right", "guide.yaml"), (NODES, "living.yaml"), (NODES, "counting.yaml")]
)
def test_a_real_node_that_does_it_right_meets_every_check(folder, rubric):
    """Topics, logs, reactions, parameters, policies, actions, lifecycles, ends: recorded and judged."""
    pytest.importorskip("test_msgs")
    found, told = outcomes(folder, rubric)
    assert {outcome for _, outcome in found} == {"met"}, told


@pytest.mark.ros
def test_a_real_node_that_does_it_wrong_meets_none():
    """But that it lives; what it does after Ctrl-C is a question of its own."""
    found, told = outcomes(REAL / "astray", "guide.yaml")
    assert [name for name, outcome in found if outcome != "not_met"] == ["no_fault"], told
