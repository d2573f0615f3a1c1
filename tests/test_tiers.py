"""Each row of a table of tests runs in one tier, and those of the earlier tiers are spread over the table."""

from __future__ import annotations

from collections import defaultdict

import pytest
from tiers import spread

TABLE = """
import pytest

@pytest.mark.breadth({default}, {long})
@pytest.mark.parametrize(
    "n", [*range(20), pytest.param(20, marks=pytest.mark.long), pytest.param(21, marks=pytest.mark.nightly)]
)
def test_table(n): ...

@pytest.mark.parametrize("n", range(3))
def test_other(n): ...
"""


def tiers_of(items: list[pytest.Item]) -> dict[str, list[str]]:
    found = defaultdict(list)
    for item in items:
        tier = next((name for name in ("nightly", "long") if item.get_closest_marker(name)), "default")
        found[tier].append(item.name)
    return found


@pytest.mark.parametrize(
    ("default", "long", "expected"),
    [(1, 1, (1, 1, 20)), (4, 6, (4, 6, 12)), (7, 0, (7, 0, 15)), (0, 5, (0, 5, 17)), (50, 50, (20, 1, 1))],
)
def test_a_table_gives_so_many_rows_to_each_tier(
    pytester: pytest.Pytester, default: int, long: int, expected: tuple[int, int, int]
) -> None:
    """And no other table gives any."""
    items = pytester.getitems(TABLE.format(default=default, long=long))
    spread(items)
    found = tiers_of(items)
    others = {f"test_other[{n}]" for n in range(3)}
    assert others <= set(found["default"])
    assert (len(found["default"]) - 3, len(found["long"]), len(found["nightly"])) == expected


def test_the_rows_of_a_tier_are_spread(pytester: pytest.Pytester) -> None:
    """The first, and then at equal distances."""
    items = pytester.getitems(TABLE.format(default=4, long=0))
    spread(items)
    assert [name for name in tiers_of(items)["default"] if "table" in name] == [
        f"test_table[{n}]" for n in (0, 5, 10, 15)
    ]


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
