"""The program that records submissions once, in the conditions that it was started in, for `grade verify`.

Usage: python -m grader.grading.app.recorded_again, with a `Recordings` as JSON on standard input. Writes a line of
JSON for the sandbox, for each trace, and for each submission that was recorded or could not be.
"""

from __future__ import annotations

import gc
import json
import os
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from grader.grading.app.grade import prepared_run
from grader.grading.app.request import request_of
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import GraderError
from grader.runtime.recording.codec import from_json, trace_to_json
from grader.runtime.session import AUTO, RecordingSession, open_session

#: As the command line does: imports make many objects and no garbage.
COLLECT_AFTER = 200_000


@dataclass(frozen=True, slots=True)
class WantedRecording:
    """One submission to record."""

    path: str  # of a folder that may be read
    seed: int
    request: str  # JSON of `request_to_json`
    rubrics: tuple[str, ...] = ()
    # Exercise and scenario of the recordings to make; empty for all
    scenarios: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Recordings:
    """What to record, and how."""

    wanted: tuple[WantedRecording, ...]
    isolation: str
    # Whether to record on one processor, one scenario at a time with the last one first, and to execute each process
    changed: bool = False


def main() -> None:
    """Record what standard input asks for."""
    gc.set_threshold(COLLECT_AFTER)
    lines = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what others print is not a line of JSON
    recordings: Recordings = from_json(Recordings, json.load(sys.stdin))
    if recordings.changed:
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    lock = threading.Lock()

    def tell(line: Mapping[str, Any]) -> None:
        with lock:
            lines.write(json.dumps(line) + "\n")
            lines.flush()

    try:
        for line in _lines(recordings):
            tell(line)
    except GraderError as error:
        tell({"problem": error.message, "hint": error.hint})


def _lines(recordings: Recordings) -> Iterator[Mapping[str, Any]]:
    workers = 1 if recordings.changed else None
    numbers = range(len(recordings.wanted))
    order = numbers[::-1] if recordings.changed else numbers
    # Workers end with the thread that started them: this one outlives the session.
    with open_session(recordings.isolation, workers, executes=recordings.changed) as session:
        yield {"isolation": session.isolation.name}
        with ThreadPoolExecutor(1 if recordings.changed else len(os.sched_getaffinity(0))) as pool:
            yielded = pool.map(lambda number: _recorded(session, recordings, number), order)
            for lines in yielded:
                yield from lines


def _recorded(session: RecordingSession, recordings: Recordings, number: int) -> Sequence[Mapping[str, Any]]:
    """Record one submission and return its lines."""
    wanted = recordings.wanted[number]
    request = request_of(
        json.loads(wanted.request), submission=wanted.path, seed=wanted.seed, rubrics=tuple(map(Path, wanted.rubrics))
    )
    try:
        with prepared_run(session, request, lambda _: None, time.perf_counter()) as ready:
            keys = [key for key in ready.jobs if not wanted.scenarios or key in wanted.scenarios]
            jobs = {key: ready.jobs[key] for key in (reversed(keys) if recordings.changed else keys)}
            traces = session.record(jobs, AUTO, lambda _: None, on_wall=False)
            tests = {key: job for key, job in ready.tests.items() if not wanted.scenarios or key in wanted.scenarios}
            traces |= session.record_tests(tests, lambda _: None)
            lines = [
                {
                    "number": number,
                    "exercise": exercise,
                    "scenario": scenario,
                    "trace": trace_to_json(trace, aside=True),
                }
                for (exercise, scenario), trace in traces.items()
            ]
            return [
                *lines,
                {"number": number, "sources": {name: str(text) for name, text in ready.run.sources.items()}},
            ]
    except GraderError as error:
        return [{"number": number, "problem": error.message, "hint": error.hint}]


if __name__ == "__main__":
    main()
