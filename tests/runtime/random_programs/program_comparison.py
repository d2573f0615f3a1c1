"""Compares what a random program did with what it must do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

from program_description import Program, Spinning
from program_model import Expected, expected_of
from program_text import file_of

from grader.runtime.model.trace import AssessedTrace, Fault, LogRecord, Message, OutputLine
from grader.runtime.plan import Plan
from grader.runtime.session import RecordingSession
from grader.runtime.supervisor.supervisor import Job

NS_PER_MS = 1_000_000
#: By how much a time on the wall clock may be wrong, beyond the late start of its process.
TOLERANCE_NS = 60 * NS_PER_MS
#: Processes with several threads.
SEVERAL = (Spinning.THREAD, Spinning.MULTI)
#: How many entries before and after the first difference are shown.
AROUND = 3
#: What Python says when a program fails; faults are compared instead.
STDERR = "stderr"
#: Where rclpy's warnings go on with the random id of a goal.
GOAL_ID = " Goal ID"
Entries = Mapping[str, Sequence[tuple[int, str]]]


def plan_of(program: Program, folder: Path, clock: str = "virtual") -> Plan:
    """Write the files of a program into a folder, and return the plan to record it."""
    folder.mkdir(exist_ok=True)
    folder.chmod(0o755)
    names = [f"p{number}.py" for number in range(len(program.processes))]
    for name, process in zip(names, program.processes, strict=True):
        (folder / name).write_text(file_of(process), encoding="utf-8")
        (folder / name).chmod(0o644)
    return Plan(
        scenario="random",
        processes=tuple((name, name) for name in names),
        root=str(folder),
        host_seed="ab" * 32,
        duration_ns=program.duration_ms * NS_PER_MS,
        first_message_on="",
        wait_at_most_ns=60_000 * NS_PER_MS,
        clock=clock,
    )


def recorded(session: RecordingSession, program: Program, folder: Path, clock: str = "virtual") -> AssessedTrace:
    """Record a program."""
    return session.recorder.record([Job("random", plan_of(program, folder, clock))], lambda _: None)[0]


def differences_of_each(
    session: RecordingSession, programs: Sequence[Program], folder: Path
) -> Iterator[tuple[Program, list[str]]]:
    """Record programs at the same time, and yield each with how it differs from its model."""
    jobs = [Job("random", plan_of(program, folder / str(number))) for number, program in enumerate(programs)]
    for program, trace in zip(programs, session.recorder.each(jobs, lambda _: None), strict=True):
        yield program, differences_of(program, trace)


def told_by_model(expected: Expected) -> dict[str, list[tuple[int, str]]]:
    """Return what a model expects, by the name of what is compared."""
    told = {f"topic /{topic}": [(t, str(n)) for t, n in entries] for topic, entries in expected.topics.items()}
    told |= {f"log of p{number}.py": list(entries) for number, entries in expected.logs.items()}
    told |= {f"output of p{number}.py": list(entries) for number, entries in expected.lines.items()}
    return told | {f"end of p{n}.py": [(t, f"{e.kind}: {e.text}")] for n, (t, e) in expected.ends.items()}


def told_by_trace(trace: AssessedTrace) -> dict[str, list[tuple[int, str]]]:
    """Return what was recorded, by the name of what is compared."""
    told: dict[str, list[tuple[int, str]]] = {}
    for seen in trace.observations:
        if seen.t_ns < trace.stop_ns and (entry := _entry(seen)) is not None:
            told.setdefault(entry[0], []).append((seen.t_ns, entry[1]))
    return told


def _entry(seen: Any) -> tuple[str, str] | None:
    if isinstance(seen, Message):
        return f"topic {seen.topic}", str(number_in(seen.value))
    if isinstance(seen, LogRecord):
        return f"log of {seen.process}", seen.text.partition(GOAL_ID)[0]
    if isinstance(seen, OutputLine) and seen.stream != STDERR:
        return f"output of {seen.process}", seen.text
    return (f"end of {seen.process}", f"{seen.kind.value}: {seen.text}") if isinstance(seen, Fault) else None


def number_in(value: Mapping[str, Any]) -> Any:
    """Return what a message holds: a number, that of a feedback, or the states of goals."""
    if "status_list" in value:
        return [goal["status"] for goal in value["status_list"]]
    return sum(value["feedback"]["sequence"]) if "feedback" in value else value.get("data")


def problems(trace: AssessedTrace) -> list[str]:
    """Return what a recording itself complains about."""
    return [*trace.notes, *([trace.harness_problem] if trace.harness_problem else [])]


def by_source(told: Entries, program: Program) -> dict[str, Sequence[tuple[int, str]]]:
    """Take the log and output of a process with several threads apart by the names of their callbacks.

    In which order threads do something at one instant is not promised.
    """
    apart: dict[str, list[tuple[int, str]]] = {}
    several = {f"p{n}.py" for n, process in enumerate(program.processes) if process.spinning in SEVERAL}
    for name, entries in told.items():
        kind, _, process = name.partition(" of ")
        for t_ns, text in entries:
            split = process in several and kind != "end"
            apart.setdefault(f"{name}, {text.split()[0]}" if split else name, []).append((t_ns, text))
    return dict(apart)


def differences(expected: Entries, found: Entries) -> list[str]:
    """Return the first difference of each topic, log, output and end."""
    told = []
    for name in sorted({*expected, *found}):
        must, did = list(expected.get(name, ())), list(found.get(name, ()))
        if must != did:
            first = next(
                (n for n, (m, d) in enumerate(zip(must, did, strict=False)) if m != d), min(len(must), len(did))
            )
            part = slice(max(0, first - AROUND), first + AROUND)
            told.append(f"{name}, entry {first}: must be {_shown(must[part])}, was {_shown(did[part])}")
    return told


def _shown(entries: Sequence[tuple[int, str]]) -> str:
    return "; ".join(f"{t / NS_PER_MS:g} ms {text}" for t, text in entries) or "nothing"


def differences_of(program: Program, trace: AssessedTrace) -> list[str]:
    """Return how a recording in virtual time differs from the model of its program."""
    expected, did = told_by_model(expected_of(program)), told_by_trace(trace)
    return [*problems(trace), *differences(by_source(expected, program), by_source(did, program))]


def compared(session: RecordingSession, program: Program, folder: Path) -> list[str]:
    """Record a program in virtual time, and return how it differs from its model, with its files."""
    found = differences_of(program, recorded(session, program, folder))
    return [*found, *(file_of(process) for process in program.processes)] if found else []


def on_the_wall_clock(session: RecordingSession, program: Program, folder: Path) -> list[str]:
    """Record a program of one process on the wall clock, and return how it differs from its model.

    Each callback must say and send the same in the same order, as far as the recording goes: a process starts some
    tenths of a second late. All its times are shifted by the median of the differences, and must then be within
    `TOLERANCE_NS`. What several callbacks do at one instant may come in another order.
    """
    trace = recorded(session, program, folder, "wall")
    every = Program(tuple(replace(p, spinning=Spinning.THREAD) for p in program.processes), program.duration_ms)
    expected, did = (by_source(told, every) for told in (told_by_model(expected_of(program)), told_by_trace(trace)))
    pairs = [(m, d) for name in expected for m, d in zip(expected[name], did.get(name, ()), strict=False)]
    late_ns = round(median(d[0] - m[0] for m, d in pairs)) if pairs else 0
    told = [f"{trace.harness_problem}"] if trace.harness_problem else []
    for name in sorted({*expected, *did}):
        must = [(t + late_ns, text) for t, text in expected.get(name, ())]
        found = did.get(name, ())
        surely = sum(t < trace.stop_ns - TOLERANCE_NS for t, _ in must)
        same = all(m[1] == d[1] and abs(m[0] - d[0]) <= TOLERANCE_NS for m, d in zip(must, found, strict=False))
        if not (same and surely <= len(found) <= len(must)):
            told.append(f"{name}: must be {_shown(must[:12])}, was {_shown(found[:12])}")
    return told
