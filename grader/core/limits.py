"""Limits of the students' processes in one scenario, and their descriptions for messages."""

from __future__ import annotations

from typing import Annotated

from grader.core.dataclass import dataclass
from grader.core.quantities import GIB, KIB, MIB, NS_PER_S, Bytes, DurationNs, Least, duration, size

#: Default limit, in seconds of real time, for all recordings of one submission together; an ordinary submission takes
#: 3 to 10 s.
TIME_BUDGET_S = 300.0

#: Address space beyond the memory limit: libraries, and thread stacks and memory pools that stay empty.
ADDRESS_SPACE_BEYOND = 3 * GIB // 2


@dataclass(frozen=True, slots=True)
class Limits:
    """What each student process and its children may use, and how much of their behaviour is recorded.

    The report says if a limit is reached, and the recording up to then is judged. The first group applies to each
    student process with its children, the second to each file or folder, the third to the scenario. The defaults are
    well above the most that any of the 170 correct programs of our test set needed, given in parentheses: each alone,
    for ten seconds of virtual time, on two processors. A rubric cannot set a limit below the needs of an idle node.

    Attributes:
        memory_bytes: Memory used, without pages mapped from files such as libraries (45 MiB).
        processor_ns: Processor time of all threads together (6.3 s, by a loop that only reads the clock).
        processes: Processes and threads (16).
        output_bytes: Output kept of each of standard output and standard error; the rest is read and discarded.
        lines: Log records and lines of output that are kept (200).
        open_files: Open file descriptors of one process (33).
        file_bytes: Size of one file.
        scratch_bytes: Total size of the files in one of the folders that the process may write to.
        wall_ns: Real time of the recording (80 s, by our longest scenario on the wall clock).
        messages: Messages on one topic; more end the recording (400).
        message_bytes: Largest message whose content is kept (76 bytes); of a larger one, only time and topic are kept.
        traffic_bytes: Total size of the messages kept; more end the recording (25 KiB).
        participants: DDS participants; a process has one for each ROS context; more end the recording.
    """

    memory_bytes: Annotated[Bytes, Least(128 * MIB), "memory filled, as in 512 MiB"] = 512 * MIB
    processor_ns: Annotated[DurationNs, Least(10 * NS_PER_S), "of all threads together"] = 120 * NS_PER_S
    processes: Annotated[int, Least(32), "processes and threads"] = 64
    output_bytes: Annotated[Bytes, Least(KIB), "kept of each output stream"] = 4 * MIB
    lines: Annotated[int, Least(1), "log records and lines that are kept"] = 50_000

    open_files: Annotated[int, Least(64), "descriptors of one process"] = 128
    file_bytes: Annotated[Bytes, Least(KIB), "of one file"] = 32 * MIB
    scratch_bytes: Annotated[Bytes, Least(MIB), "of all files in a folder"] = 16 * MIB

    wall_ns: Annotated[DurationNs, Least(10 * NS_PER_S), "of one scenario, on either clock"] = 150 * NS_PER_S
    messages: Annotated[int, Least(1), "on one topic"] = 20_000
    message_bytes: Annotated[Bytes, Least(64), "of a message that is read"] = 64 * KIB
    traffic_bytes: Annotated[Bytes, Least(KIB), "of all messages that are kept"] = 16 * MIB
    participants: Annotated[int, Least(1), "DDS participants of the scenario"] = 16

    @property
    def processor_s(self) -> int:
        """Processor time in whole seconds, rounded up, at least 1."""
        return max(1, -(-self.processor_ns // NS_PER_S))

    @property
    def address_space_bytes(self) -> int:
        """Address space of one process, whether used or not; the kernel enforces this limit immediately."""
        return self.memory_bytes + ADDRESS_SPACE_BEYOND

    def memory_words(self) -> str:
        """Describe the memory limit."""
        return f"{size(self.memory_bytes)} of memory"

    def processor_words(self) -> str:
        """Describe the limit of processor time."""
        return f"{duration(self.processor_ns)} of processor time"

    def wall_words(self) -> str:
        """Describe the limit of real time."""
        return f"{duration(self.wall_ns)} of real time"

    def processes_words(self) -> str:
        """Describe the limit of processes and threads."""
        return f"{self.processes:,} processes and threads"
