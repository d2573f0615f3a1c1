"""Measures how long the HTML report of real runs takes to make, and how large it is, alone and with shared files.

Usage: python benchmarks/html_report.py [SUBMISSION...]    by default the reference solutions
"""

from __future__ import annotations

import statistics
import sys
import time
from pathlib import Path

from grader.grading.app.request import GradeRequest
from grader.grading.app.start import grade_once
from grader.grading.reporting.html.assets import bundle
from grader.grading.reporting.html.render import render_html

ROOT = Path(__file__).resolve().parent.parent
ROUNDS = 20


def main() -> None:
    """Print one line a submission."""
    submissions = sys.argv[1:] or [str(ROOT / "reference_solutions")]
    for submission in submissions:
        report = grade_once(GradeRequest(submission), lambda _: None)
        started = time.perf_counter()
        render_html(report)
        first_ms = 1000 * (time.perf_counter() - started)
        times = []
        for _ in range(ROUNDS):
            started = time.perf_counter()
            page = render_html(report)
            times.append(1000 * (time.perf_counter() - started))
        alone, linked = len(page.encode()), len(render_html(report, assets="assets").encode())
        print(
            f"{Path(submission).name}: first {first_ms:.0f} ms, then median {statistics.median(times):.1f} ms; "
            f"{alone / 1e6:.2f} MB alone, {linked / 1e3:.0f} kB beside shared files"
        )
    print(
        f"shared files: {sum(map(len, bundle().files.values())) / 1e6:.2f} MB, of which script {len(bundle().script)}"
    )


if __name__ == "__main__":
    main()
