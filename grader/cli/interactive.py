"""What only people at a terminal use: the folder they are in, the page in a browser, and grading again on each save."""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Generator
from pathlib import Path

import click

from grader.cli.options import complain
from grader.grading.submissions.collected import PAGE_NAME
from grader.runtime.model.errors import GraderError

#: Where `grade --open` writes the page, unless `-o html=PATH` says otherwise: browsers in containers read neither
#: temporary nor hidden folders.
PAGE = Path(PAGE_NAME)
#: Where the files of an exercise may be, from the folder of a homework or a workspace; and from that of a package.
_LAYOUTS, _IN_PACKAGE = ("{}", "src/*/{}", "src/*/*/{}"), "*/{}"
#: Other .py files in this folder that are searched for rclpy, and the length of each that is read, in bytes.
_MOST_FILES, _MOST_BYTES = 50, 1 << 20
_EXAMPLES = """\
  grade                         in a folder that holds exercise files
  grade velocity_publisher.py   one file, while you work on it
  grade homework --exercise 1   one exercise of a folder or an archive
"""
#: Silence after a change before grading, and the longest wait for it, in milliseconds: editors write in several steps.
_SETTLE_MS, _LONGEST_MS = 100, 1500
#: How often it is checked whether the folder is still the same, in milliseconds.
_CHECK_MS = 250
#: An earlier start of the process than this, in seconds, is not believed.
_LONGEST_START_S = 60.0


def folder_at_hand(rubrics: tuple[Path, ...]) -> str | None:
    """Return `.` if the current folder holds files of an exercise, or other programs that use rclpy.

    Otherwise, print an error with examples of commands, and return None.
    """
    from grader.grading.app.grade import read_exercises, wanted_files
    from grader.grading.app.request import GradeRequest

    wanted = wanted_files(read_exercises(GradeRequest(submission="", rubrics=rubrics, every=True)))
    here = Path()
    layouts = (*_LAYOUTS, _IN_PACKAGE) if (here / "package.xml").exists() else _LAYOUTS
    if any(next(here.glob(layout.format(name)), None) for name in wanted for layout in layouts) or _uses_ros(here):
        return "."
    complain(f"expected a submission: this folder holds no exercise file, such as {wanted[0]}", kind="error")
    click.echo(_EXAMPLES, nl=False, err=True)
    complain("grade --help lists the options", kind="hint")
    return None


def _uses_ros(folder: Path) -> bool:
    return any(b"rclpy" in _start_of(path) for path in sorted(folder.glob("*.py"))[:_MOST_FILES])


def _start_of(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(_MOST_BYTES)
    except OSError:
        return b""


def open_page(path: Path) -> None:
    """Open a page in a browser, and say where it is; without a browser, say what to do with it."""
    import webbrowser

    where = path.resolve()
    desktop = any(os.environ.get(name) for name in ("BROWSER", "DISPLAY", "WAYLAND_DISPLAY"))
    try:
        opened = desktop and webbrowser.open(where.as_uri())
    except webbrowser.Error:
        opened = False
    complain(str(where), kind="page")
    if not opened:
        complain("no browser could be opened here; open the page in one, on any computer", kind="note")


def saves(submission: Path) -> Generator[bool]:
    """Yield False at once, when no later save can be missed, then True after each save of a submission's programs.

    A file, or the folder itself, may be replaced, removed and created again. Raises GraderError if changes cannot be
    watched, and KeyboardInterrupt.
    """
    from watchfiles import Change, DefaultFilter, watch

    only = None if submission.is_dir() else submission.name
    folder, usual = submission if only is None else submission.parent, DefaultFilter()

    def matters(change: Change, path: str) -> bool:
        return usual(change, path) and is_reason(Path(path).name, only)

    news: bool | None = False
    while True:
        here = _identity(folder)
        try:
            # Editors save by renaming another file to this one, so that its folder is watched.
            for changed in watch(
                folder,
                watch_filter=matters,
                debounce=_LONGEST_MS,
                step=_SETTLE_MS,
                rust_timeout=_CHECK_MS,
                yield_on_timeout=True,
                recursive=only is None,
            ):
                news = True if changed and news is None else news
                if news is not None:
                    yield news
                    news = None
                if _identity(folder) != here:
                    break
        except OSError as error:
            if _identity(folder) is not None:
                text = f"{folder}: changes cannot be watched: {error.strerror or error}"
                raise GraderError(text, "set WATCHFILES_FORCE_POLLING=1") from error
        news = True
        while _identity(folder) is None:
            time.sleep(_CHECK_MS / 1000)


def is_reason(name: str, only: str | None) -> bool:
    """Return whether a change of a file of this name is a reason to grade again; `only` is a submission of one file."""
    return name == only if only is not None else name.endswith(".py")


def _identity(folder: Path) -> tuple[int, int] | None:
    try:
        found = folder.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def process_start() -> float:
    """Return when this command began, as `time.monotonic` counts; now where Linux does not tell.

    Called before this command starts any process. A shell that runs its last command in its own place, as in
    `bash -c 'sleep 9 && grade x'`, hands on its age; that it has waited for others shows.
    """
    now = time.monotonic()
    if resource.getrusage(resource.RUSAGE_CHILDREN).ru_minflt:
        return now - time.process_time()
    try:
        started = int(Path("/proc/self/stat").read_text(encoding="ascii").rpartition(")")[2].split()[19])
        age = time.clock_gettime(time.CLOCK_BOOTTIME) - started / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError, AttributeError):
        return now
    return now - age if 0 <= age < _LONGEST_START_S else now
