"""Makes the pictures of README and site from real gradings: a terminal, a report and the page of a class.

Usage: python docs/pictures/make.py     needs Chromium, and `pip install -e '.[dev]'`
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.append(str(ROOT / "tests" / "support"))
from sample_folders import folder_of  # noqa: E402  where the test submissions are

#: Whose files the report shows: right ones, but for these.
MISTAKES = ("wrong/velocity_10_hz", "wrong/odom_swapped_xy")
CLASS = {
    "ada": "correct/velocity_class",
    "bob": "wrong/velocity_10_hz",
    "cleo": "wrong/velocity_swapped_fields",
    "dan": "correct/velocity_while_sleep",
    "eva": "wrong/velocity_10_hz",
    "finn": "broken/syntax_error",
}
COMMAND = "grade maria -o html=report.html"
#: Types the command as a person does, runs it, and leaves its output to be read. Without a display of progress, the
#: recorder shortens the time in which the nodes run.
SCRIPT = f"""printf '$ '
typed='{COMMAND}'
for ((i = 0; i < ${{#typed}}; i++)); do printf '%s' "${{typed:i:1}}"; sleep 0.05; done
echo; $typed --no-progress; sleep 1
"""


def main() -> None:
    """Grade in a temporary folder, and write the pictures beside this file."""
    programs = str(Path(sys.executable).parent)
    env = {**os.environ, "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    with tempfile.TemporaryDirectory() as temporary, sync_playwright() as playwright:
        folder = Path(temporary)
        shutil.copytree(ROOT / "reference_solutions", folder / "maria")
        for mistake in MISTAKES:
            shutil.copytree(folder_of(mistake), folder / "maria", dirs_exist_ok=True)
        for name, source in CLASS.items():
            shutil.copytree(folder_of(source), folder / "class" / name)
        (folder / "typed").write_text(SCRIPT, encoding="utf-8")
        words = ["termtosvg", str(HERE / "terminal.svg"), "-c", "bash typed", "-g", "92x32", "-t", "window_frame"]
        with subprocess.Popen(
            [*words, "-M", "1500", "-D", "8000"], cwd=folder, env=env, stdin=subprocess.PIPE
        ) as recorder:
            recorder.wait()  # its input stays open: at the end of the input it would stop
        # The template draws bold green in a grey that nobody can read.
        drawn = (HERE / "terminal.svg").read_text(encoding="utf-8")
        readable = drawn.replace(".color10 {fill: #383830}", ".color10 {fill: #a6e22e}")
        (HERE / "terminal.svg").write_text(readable, encoding="utf-8")
        batch = ["grade", "batch", "class", "-o", "results", "--exercise", "velocity_publisher"]
        subprocess.run(batch, cwd=folder, env=env, check=False)
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium") or shutil.which("google-chrome"))
        shoot(browser, folder / "report.html", "report_light.png", 1230)
        shoot(browser, folder / "report.html", "report_dark.png", 900, at="#odom_subscriber .recording")
        shoot(browser, folder / "results" / "index.html", "class_index.png", 1400)
        browser.close()


def shoot(browser: Browser, page: Path, name: str, height: int, at: str = "") -> None:
    """Write a picture of the first window of a page, or of the one that begins at the first element of a kind."""
    context = browser.new_context(
        viewport={"width": 1000, "height": height}, color_scheme="dark" if "dark" in name else "light"
    )
    tab = context.new_page()
    tab.goto(page.as_uri())
    tab.wait_for_timeout(1500)
    if at:
        tab.locator(at).first.evaluate("e => e.scrollIntoView({block: 'start', behavior: 'instant'})")
        tab.wait_for_timeout(1000)
    tab.screenshot(path=HERE / name)
    context.close()


if __name__ == "__main__":
    main()
