"""Measures what a class costs besides grading each submission, for any number of submissions.

Usage: python benchmarks/capacity.py [--similarity] [--dask] [--keep FOLDER] COUNT...

Grades twelve mixed submissions once. For each COUNT it makes that many submissions, each a copy of one of the twelve
with another comment, and a roster. Then a process of its own does everything for that class but grade: whatever would
grade a submission copies the result of the one that it is a copy of. So the figures hold what grows with the class:
reading submissions, handing out work, storing results, the gradebook, the pages.

Prints for each COUNT and run the real time and the processor seconds of that process, its most memory, the size and
number of the files in the results folder, and the size of the class page. The runs are the first, a second with
nothing to do, and a third with `--rerun all`.

--similarity   compare the submissions with each other too
--dask         hand the work out by a Dask scheduler with four workers in the same process, instead of local processes
--keep FOLDER  leave submissions and results there, to look at them
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import msgspec
from class_of_100 import kinds, make_class
from distributed import LocalCluster

from grader.course.classroom import receiving as remote
from grader.course.classroom import store as kept
from grader.course.classroom.class_run import grade_class
from grader.course.classroom.cluster.dispatcher import connected
from grader.course.classroom.grading import ALL, CHANGED, ClassRequest, handed_in_digest
from grader.course.classroom.intake import HandedInEntry
from grader.course.classroom.local import LocalScheduler, MakeScheduler, Task
from grader.course.classroom.messages import GradingJob, JobResult, Terms, plain_files
from grader.course.classroom.store import ResultStatus
from grader.course.classroom.watching import Watcher
from grader.course.classroom.worker import PARTS
from grader.course.similarity.finding import read_templates
from grader.grading.app.grade import read_exercises, wanted_files
from grader.grading.app.request import GradeRequest
from grader.runtime.shipped import shipped
from grader.runtime.temp_dirs import scratch_folder

GRADE = str(Path(sys.executable).with_name("grade"))
#: Submissions that are graded in truth; at least one of each kind.
GRADED = 12


def main() -> None:
    """Print the table, or be one of the processes of a class."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("counts", nargs="*", type=int, metavar="COUNT")
    parser.add_argument("--similarity", action="store_true")
    parser.add_argument("--dask", action="store_true")
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--run", nargs=3, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.serve is not None:
        serve(given.serve)
    elif given.run is not None:
        folder, graded, rerun = given.run
        run(Path(folder), Path(graded), rerun, similarity=given.similarity, dask=given.dask)
    else:
        with tempfile.TemporaryDirectory() as scratch:
            table(given.counts, given.keep or Path(scratch), similarity=given.similarity, dask=given.dask)


def table(sizes: list[int], folder: Path, *, similarity: bool, dask: bool) -> None:
    """Measure classes of these sizes below a folder, and print a line for each run."""
    samples, graded = folder / "samples", folder / "graded"
    make_class(samples, list(kinds(GRADED)))
    command = [GRADE, "batch", str(samples), "-o", str(graded), "--no-progress"]
    subprocess.run(command, stdout=subprocess.DEVNULL, check=False)
    print("   size run        real s    CPU s  peak MiB  results MiB    files  page KiB")
    for size in sizes:
        place = folder / str(size)
        copies(samples, place, size)
        for rerun in ("first", CHANGED, ALL):
            options = [*(["--similarity"] if similarity else []), *(["--dask"] if dask else [])]
            arguments = [sys.executable, __file__, *options, "--run", str(place), str(graded), rerun]
            print(f"{size:>7} {rerun:<8} {subprocess.check_output(arguments, text=True).strip()}", flush=True)


def copies(samples: Path, place: Path, size: int) -> None:
    """Write so many copies of the samples, each with a comment of its own, and a roster that names everybody."""
    originals = sorted(samples.iterdir())
    rows = ["name,id,email"]
    for number in range(size):
        original = originals[number % len(originals)]
        student = place / "submissions" / f"student_{number:06}"
        student.mkdir(parents=True)
        for file in original.iterdir():
            (student / file.name).write_bytes(file.read_bytes() + f"\n# copy {number}\n".encode())
        rows.append(f"Student {number:06},student_{number:06},student_{number:06}@example.org")
    (place / "roster.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")


def run(place: Path, graded: Path, rerun: str, *, similarity: bool, dask: bool) -> None:
    """Grade one class in this process, and print what that took."""
    results = place / "results"
    course = ClassRequest(
        sources=(place / "submissions",),
        results=results,
        roster=place / "roster.csv",
        grading=GradeRequest(""),
        jobs=2,
        rerun=CHANGED if rerun == "first" else rerun,
        given=read_templates((shipped("student_template"),)) if similarity else None,
    )
    command = [sys.executable, __file__, "--serve", str(graded)]
    with dask_scheduler(graded) if dask else nullcontext(partial(LocalScheduler, command=command)) as make:
        started, before_s = time.perf_counter(), time.process_time()
        grade_class(course, Watcher(lambda _: None), lambda _: None, make)
        took_s, processor_s = time.perf_counter() - started, time.process_time() - before_s
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    sizes = [path.stat().st_size for path in results.rglob("*") if path.is_file()]
    mib, page_kib = sum(sizes) / 2**20, (results / "index.html").stat().st_size / 1024
    print(f"{took_s:>8.1f} {processor_s:>8.1f} {peak_mib:>9.0f} {mib:>12.0f} {len(sizes):>8} {page_kib:>9.0f}")


@contextmanager
def dask_scheduler(graded: Path) -> Iterator[MakeScheduler]:
    """Yield what makes the scheduler of a cluster, four of whose workers copy results in this process."""

    def grade_job(terms: Terms, job: GradingJob, machine: str, on_step: Callable[[str], None]) -> JobResult:  # noqa: ARG001  the interface of what it replaces
        with scratch_folder() as scratch:
            task = remote.write_task(terms, job, scratch)
            status = copied(task, graded)
            return JobResult(machine, kept.dump_status(status), plain_files(task.into))

    remote.grade_job = grade_job
    with (
        LocalCluster(n_workers=4, threads_per_worker=1, processes=False, dashboard_address=None) as cluster,
        connected(cluster.scheduler_address, None, lambda _: None) as scheduler,
    ):
        yield lambda _: scheduler


def serve(graded: Path) -> None:
    """Take tasks from standard input as the process that grades does, and copy their results."""
    for line in sys.stdin.buffer:
        request = json.loads(line)
        os.chdir(request["folder"])
        task = msgspec.convert(request["task"], Task, dec_hook=lambda type_, value: type_(value))
        status = copied(task, graded)
        sys.stdout.write(json.dumps({"done": json.loads(kept.dump_status(status))}) + "\n")
        sys.stdout.flush()


def copied(task: Task, graded: Path) -> ResultStatus:
    """Copy the result of the submission that a task's is a copy of; return its status with the digest of the copy."""
    names = sorted(path.name for path in (graded / "students").iterdir())
    found = graded / "students" / names[int(task.name.rsplit("_", 1)[1]) % len(names)]
    task.into.mkdir()
    for name in PARTS:
        source = found / name
        if source.is_dir():
            shutil.copytree(source, task.into / name)
        elif source.is_file():
            shutil.copyfile(source, task.into / name)
    status = kept.load_status((found / kept.RESULT).read_bytes())
    assert status is not None
    with tempfile.TemporaryDirectory() as scratch:
        digest, _ = handed_in_digest(HandedInEntry(task.name, task.label, task.submission), Path(scratch), wanted())
    return replace(
        status,
        key=task.conditions.key(digest),
        recorded=task.conditions.recorded(digest),
        digest=digest,
        label=task.label,
    )


@cache
def wanted() -> tuple[str, ...]:
    """Return the names of the files that the exercises of the chapter ask for."""
    return tuple(wanted_files(read_exercises(GradeRequest(""))))


if __name__ == "__main__":
    main()
