"""Limits of what others hand in, and of the students' processes in one scenario, with their words for messages.

A limit of a single module is beside what it bounds; `docs/reference/limits.md` lists all of them.
"""

from __future__ import annotations

from typing import Annotated

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import GIB, KIB, MIB, NS_PER_S, Bytes, DurationNs, Least, duration, size

#: Default limit, in seconds of real time, for all recordings of one submission together; an ordinary submission takes
#: 3 to 10 s.
TIME_BUDGET_S = 300.0

# What others hand in. The grader reads it in processes of its own, so these bound what a single submission, rubric or
# evidence can cost. The largest of the test submissions has 6 files and 22 KiB, the largest rubric 11 KiB.

#: The most files of a submission. Each is copied and hashed, and is there for every process of the student's.
MAX_FILES = 2_000
#: The most bytes of all its files together. Staged copies lie in memory where the temporary folder does.
MAX_TOTAL_BYTES = 50 << 20
#: The most bytes of one of them.
MAX_FILE_BYTES = 8 << 20
#: The most bytes of the recordings that students hand in for one submission, where a rubric asks for one: what
#: `size` may be at most. They are read into memory while a submission is copied.
MAX_BAG_BYTES = 512 << 20
#: The most folders in each other.
MAX_DEPTH = 20
#: Entries of any kind that are examined before a folder or an archive is rejected as not being a submission. They are
#: more than the files, because folders, hidden files and what a build leaves behind count too.
MAX_ENTRIES = 20_000
#: The longest path inside a submission: with the staging folder in front, the system rejects longer ones than 4,096.
MAX_PATH_BYTES = 2_000
#: The longest name of one file or folder on Linux (NAME_MAX).
MAX_NAME_BYTES = 255
#: The most nodes that a launch file may start: each is a process with a sandbox and a DDS participant.
MOST_LAUNCHED = 16
#: The most parts of a launch file that are reported as left out: each becomes a sentence.
MOST_LEFT_OUT = 50

#: The most bytes of an archive, which is read into memory.
MAX_ARCHIVE_BYTES = 64 << 20
#: The most bytes of an unpacked tar archive, with headers and skipped files: a little more than `MAX_TOTAL_BYTES`.
MAX_UNPACKED_BYTES = 64 << 20
#: The most bytes of content per byte of archive, once the content exceeds `RATIO_FREE_BYTES`. Deflate packs programs to
#: a quarter, and a bomb to a thousandth, which is as much as it can.
MAX_RATIO = 200
#: So much may come of an archive of any size: an empty map or log of an honest student shrinks like a bomb.
RATIO_FREE_BYTES = 4 << 20
#: The largest header that only describes the next member of a tar archive.
MAX_EXTENDED_BYTES = 64 << 10
#: The most compressed streams behind each other; parallel compressors write several.
MAX_STREAMS = 100
#: The memory of the xz decompressor; `xz -9` needs 65 MiB.
MAX_XZ_BYTES = 128 << 20

#: Longer program files are not read: for checks and hints they do not exist, and they count as files that look into
#: their own process.
MAX_SOURCE_BYTES = 1 << 20
#: The most bytes of all files that are searched for names by which a program looks into its own process; one with more
#: counts as such.
MAX_PROGRAM_BYTES = 4 << 20
#: Longer programs are not parsed before they run, because nobody writes one by hand. Parsing takes up to 500 bytes of
#: memory for each byte, in a process that is trusted.
MAX_PARSED_BYTES = 256 << 10

#: The largest rubric file.
MAX_RUBRIC_BYTES = 256 << 10
#: The most cases in a list of a stimulus, and repetitions of one case. A plan holds every one of them.
MAX_CASES = 1_000
#: The most clients of the grader that call at the same instant; each is an endpoint of its node.
MAX_CLIENTS = 20
#: The most calls of each.
MAX_CALLS = 1_000

#: The grader never writes a longer manifest of evidence, a longer recording, or a longer trace in one.
MAX_MANIFEST_BYTES = 64 << 20
#: The same of a recording.
MAX_RECORDING_BYTES = 512 << 20
#: The same of the trace in a recording, unpacked: as much as the largest answer of a worker.
MAX_TRACE_BYTES = 256 << 20

# What a student's process may use.

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
