"""The nodes and tests on the pages about own nodes, run as a reader would."""

import re

import pytest
from places import ROOT
from tiers import each

#: A block that begins with its file's name.
_FILE = re.compile(r"^```python\n# (\w+\.py)\n(.*?)^```", re.MULTILINE | re.DOTALL)
PAGES = {"docs/tutorials/first-test.md": (1 + 2 + 5, 4), "docs/how-to/launch-testing.md": (8, 10)}

pytestmark = pytest.mark.ros


@pytest.mark.breadth(0, 1)
@pytest.mark.long
@pytest.mark.parametrize("page", each(PAGES, 2))
def test_what_a_page_shows_works(pytester: pytest.Pytester, page: str) -> None:
    """Every test on it passes, with the nodes on it."""
    passed, files = PAGES[page]
    blocks = _FILE.findall((ROOT / page).read_text(encoding="utf-8"))
    assert len(blocks) == files
    for name, text in blocks:
        (pytester.path / name).write_text(text, encoding="utf-8")
    pytester.runpytest_subprocess("-p", "grader.pytest_plugin").assert_outcomes(passed=passed)
