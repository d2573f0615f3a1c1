"""The nodes and tests on the pages about own nodes, run as a reader would."""

import re
import shutil
from pathlib import Path

import pytest
from places import ROOT
from tiers import each

#: A block that begins with its file's name.
_FILE = re.compile(r"^```python\n# ([\w.]+\.py)\n(.*?)^```", re.MULTILINE | re.DOTALL)
#: How many tests a page has, and how many files; and the tests that make what others of the page need.
PAGES = {"docs/tutorials/first-test.md": (1 + 2 + 5 + 3, 5), "docs/how-to/launch-testing.md": (14, 16)}
#: What the tests of a page need and it does not show: nodes, parameters, and a test that makes a recording.
BESIDE = Path(__file__).parent / "beside_pages"

pytestmark = pytest.mark.ros


@pytest.mark.breadth(0, 1)
@pytest.mark.long
@pytest.mark.parametrize("page", each(PAGES, 2))
def test_what_a_page_shows_works(pytester: pytest.Pytester, page: str) -> None:
    """Every test on it passes, with the nodes on it."""
    passed, files = PAGES[page]
    blocks = _FILE.findall((ROOT / page).read_text(encoding="utf-8"))
    assert len(blocks) == files
    shutil.copytree(BESIDE, pytester.path, dirs_exist_ok=True)
    folder = pytester.path / "test"
    for name, text in blocks:
        (folder / name).write_text(text, encoding="utf-8")
    options = ("-p", "grader.pytest_plugin", "-p", "no:cacheprovider")
    pytester.runpytest_subprocess(*options, "make_corridor.py").assert_outcomes(passed=1)
    if (folder / "test_kept.py").is_file():
        pytester.runpytest_subprocess(*options, "--ros-update", "test/test_kept.py").assert_outcomes(passed=1)
    pytester.runpytest_subprocess(*options, "test").assert_outcomes(passed=passed)
