"""What a program says, sends and how it ends, in a form that does not depend on the clock it ran on."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import Fault, LogRecord, Message, OutputLine, Trace

#: Of the processes, this one is compared; the other one stands beside it.
PROCESS = "a.py"
#: Topics of the other process.
OTHERS = ("/count", "/countdown/_action/feedback", "/countdown/_action/status", "/rosout", "/parameter_events")
#: Parts of texts that belong to the run, and what stands for each.
OF_THE_RUN = {
    r"0x[0-9a-f]+": "ADDRESS",
    r"\[\d{10}\.\d+\]": "[TIME]",
    r"/(?:[\w.-]+/)+(?=[\w.-]+\.py\b)": "",
}
#: A program has ended of itself if it did so this long before the end of the recording.
EDGE_NS = NS_PER_S
Told = dict[str, list[str]]


def told(trace: Trace) -> Told:
    """Return the log records, the lines of each stream, the values on each topic, and the end."""
    found: Told = {}
    for seen in trace.observations:
        if seen.t_ns >= trace.stop_ns:
            continue
        if isinstance(seen, LogRecord) and seen.process == PROCESS:
            found.setdefault("log", []).append(f"{seen.severity} {seen.logger}: {masked(seen.text)}")
        elif isinstance(seen, OutputLine) and seen.process == PROCESS and not of_traceback(seen.text):
            found.setdefault(seen.stream, []).append(masked(seen.text))
        elif isinstance(seen, Message) and seen.topic not in OTHERS:
            found.setdefault(seen.topic, []).append(json.dumps(without_times(seen.value)))
        elif isinstance(seen, Fault) and seen.process == PROCESS and seen.t_ns < trace.stop_ns - EDGE_NS:
            found.setdefault("end", []).append(f"{seen.kind.value}: {masked(seen.text)}")
    return found


def masked(text: str) -> str:
    """Return a text without what belongs to the run."""
    for pattern, word in OF_THE_RUN.items():
        text = re.sub(pattern, word, text)
    return text


def of_traceback(line: str) -> bool:
    """Return whether a line belongs to a traceback, other than its last one, or stands beside a warning."""
    return not line.strip() or line.startswith(("  ", "Traceback ", "During handling", "The above exception"))


def without_times(value: Any) -> Any:
    """Return a message's value without stamps and identifiers."""
    if isinstance(value, Mapping):
        return {name: without_times(part) for name, part in value.items() if name not in ("stamp", "uuid", "timestamp")}
    return (
        [without_times(part) for part in value] if isinstance(value, Sequence) and not isinstance(value, str) else value
    )


def differences(virtual: Told, wall: Told) -> list[str]:
    """Return in which lists the wall clock has something else, or less than half, of what virtual time has.

    On the wall clock, programs start later, and so say less of what goes on until the end.
    """
    found = []
    for name in sorted({*virtual, *wall}):
        first, second = virtual.get(name, []), wall.get(name, [])
        common = min(len(first), len(second))
        ended = "end" in virtual
        if first[:common] != second[:common] or (
            first != second if ended else common < max(len(first), len(second)) / 2
        ):
            found.append(f"{name}: {first} in virtual time, {second} on the wall clock")
    return found
