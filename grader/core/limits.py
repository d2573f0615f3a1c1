"""Limits: what the students' processes of one scenario may use, and the words for a limit that was reached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from grader.core.quantities import GIB, KIB, MIB, NS_PER_S, Bytes, DurationNs, Least, duration, size

#: Real time, in seconds, that all recordings of one submission may take together unless told otherwise; those of an
#: ordinary submission take 3 to 10 s.
TIME_BUDGET_S = 300.0

#: What a process may map beyond what it may fill: libraries, thread stacks and pools that stay empty.
ADDRESS_SPACE_BEYOND = 3 * GIB // 2


@dataclass(frozen=True, slots=True)
class Limits:
    """What each student process may use with everything it starts, and how much of what it does is looked at.

    Reaching a limit is told to the student, and what was recorded before is judged. The first group is of each student
    process with everything it starts, the second of each file or folder, the third of the scenario. The defaults leave
    room above what any of the 170 right programs of our test set needed, in brackets: each by itself, for ten seconds
    of virtual time, on two processors. A rubric may set each to no less than a node that does nothing needs.

    Attributes:
        memory_bytes: Memory filled, without what is read from files such as libraries (45 MiB).
        processor_ns: Processor time, all threads together (6.3 s, of a loop that only looks at the clock).
        processes: Processes and threads (16).
        output_bytes: Output that is kept, of standard output and of standard error; more is read and dropped.
        lines: Log records and lines of output that are kept (200).
        open_files: Descriptors of one process (16).
        file_bytes: Size of one file.
        scratch_bytes: All files in one of the folders that the process may write to.
        wall_ns: Real time of the recording; on the wall clock our longest scenario takes up to 80 s.
        messages: Messages on one topic; more end the recording (400).
        message_bytes: Size of a message whose content is kept (76 bytes); of a larger one only time and topic are.
        traffic_bytes: Size of all messages kept; more end the recording (25 KiB).
        participants: DDS participants, of which a process has one for each ROS context; more end the recording.
    """

    memory_bytes: Annotated[Bytes, Least(128 * MIB), "memory filled, as in 512 MiB"] = 512 * MIB
    processor_ns: Annotated[DurationNs, Least(10 * NS_PER_S), "of all threads together"] = 120 * NS_PER_S
    processes: Annotated[int, Least(32), "processes and threads"] = 64
    output_bytes: Annotated[Bytes, Least(KIB), "kept of each output stream"] = 4 * MIB
    lines: Annotated[int, Least(1), "log records and lines that are kept"] = 50_000

    open_files: Annotated[int, Least(64), "descriptors of one process"] = 256
    file_bytes: Annotated[Bytes, Least(KIB), "of one file"] = 32 * MIB
    scratch_bytes: Annotated[Bytes, Least(MIB), "of all files in a folder"] = 16 * MIB

    wall_ns: Annotated[DurationNs, Least(10 * NS_PER_S), "of one scenario, on either clock"] = 150 * NS_PER_S
    messages: Annotated[int, Least(1), "on one topic"] = 20_000
    message_bytes: Annotated[Bytes, Least(64), "of a message that is read"] = 64 * KIB
    traffic_bytes: Annotated[Bytes, Least(KIB), "of all messages that are kept"] = 16 * MIB
    participants: Annotated[int, Least(1), "DDS participants of the scenario"] = 16

    @property
    def processor_s(self) -> int:
        """Processor time in whole seconds, at least 1, as the system counts it."""
        return max(1, -(-self.processor_ns // NS_PER_S))

    @property
    def address_space_bytes(self) -> int:
        """Memory that one process may map, filled or not: what the system itself enforces at once."""
        return self.memory_bytes + ADDRESS_SPACE_BEYOND

    def memory_words(self) -> str:
        """Say how much memory there is."""
        return f"{size(self.memory_bytes)} of memory"

    def processor_words(self) -> str:
        """Say how much processor time there is."""
        return f"{duration(self.processor_ns)} of processor time"

    def wall_words(self) -> str:
        """Say how much real time there is."""
        return f"{duration(self.wall_ns)} of real time"

    def processes_words(self) -> str:
        """Say how many processes and threads there are."""
        return f"{self.processes:,} processes and threads"
