"""Each row of a table of tests runs in one tier, and those of the earlier tiers are spread over the table."""

from __future__ import annotations

from collections import Counter

import pytest
from tiers import spread, tier_of

TABLES = {(1, 1): (1, 1, 20), (4, 6): (4, 6, 12), (7, 0): (7, 0, 15), (0, 5): (0, 5, 17), (50, 50): (20, 1, 1)}
TABLE = """
@pytest.mark.breadth({default}, {long})
@pytest.mark.parametrize(
    "n", [*range(20), pytest.param(20, marks=pytest.mark.long), pytest.param(21, marks=pytest.mark.nightly)]
)
def test_{default}_{long}(n): ...
"""
OTHER = """
@pytest.mark.parametrize("n", range(3))
def test_other(n): ...
"""


def test_a_table_gives_so_many_rows_to_each_tier(pytester: pytest.Pytester) -> None:
    """Those of a tier are spread over the table, and no other table gives any."""
    tables = "".join(TABLE.format(default=default, long=long) for default, long in TABLES)
    items = pytester.getitems(f"import pytest\n{tables}{OTHER}")
    spread(items)
    found = Counter((item.name.partition("[")[0], tier_of(item)) for item in items)
    for (default, long), expected in TABLES.items():
        assert tuple(found[f"test_{default}_{long}", tier] for tier in ("", "long", "nightly")) == expected
    assert found["test_other", ""] == 3
    first = [item.name for item in items if item.name.startswith("test_4_6") and tier_of(item) == ""]
    assert first == [f"test_4_6[{n}]" for n in (0, 5, 10, 15)]


@pytest.mark.slow
def test_a_group_runs_in_one_process(pytester: pytest.Pytester) -> None:
    """Else each process opens sessions and browsers, and records tables, that one should open for all."""
    pytester.makepyfile("""
        import pytest

        @pytest.mark.xdist_group("one")
        @pytest.mark.parametrize("n", range(8))
        def test_it(n, worker_id):
            print(f"in {worker_id}.")
    """)
    result = pytester.runpytest_subprocess("-n", "2", "--dist=loadgroup", "-p", "no:grader.pytest_plugin", "-rP")
    result.assert_outcomes(passed=8)
    assert len({line for line in result.outlines if line.startswith("in gw")}) == 1
