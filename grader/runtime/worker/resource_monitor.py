"""Monitors, in the worker, what students' processes use; kills a process that reaches a limit and names the limit.

The kernel's own limits apply to the address space and processor time of single processes. They miss the sum of several
processes and the kernel's memory in sockets and pipes, and they count memory that is only mapped. The monitor adds up
real usage. It notices a limit with a delay of a few polling intervals; the kernel's limits remain as a second line of
defence.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Sequence
from dataclasses import replace

from grader.runtime import usage
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import MIB, NS_PER_S, size
from grader.runtime.model.trace import AssessedTrace, ClockKind
from grader.runtime.usage import FULL_BYTES, FULL_CODE, Kernel, Usage, processor_words
from grader.runtime.worker.computing import ComputingProcesses
from grader.runtime.worker.socket_memory import MANY_DESCRIPTORS, KernelMemory, SocketMemory, descriptors
from grader.runtime.worker.student_process import NodeProcess

#: The polling interval, and the number of polls between two searches for new child processes.
LOOK_S = 0.025
SEARCH_EVERY = 10
#: An interval may be so many times longer while nothing grows by more than GROWTH_BYTES: on the wall clock, this thread
#: costs as much of a processor as the runner's. Memory fills at 1 GiB a second at most, so that a look comes 100 MiB
#: late.
LONGEST, GROWTH_BYTES = 4, MIB
#: Allowance for the sandbox's own processes, which the kernel's limit does not count, with some margin so that the
#: kernel's limit is hit first.
WRAPPERS = 16
#: The most files and folders in one scratch folder; an ordinary node creates about a dozen.
MOST_NAMES = 10_000
#: The most sockets and pipes of a node, which has 12 of both usually: four nodes together stay below the number of
#: pipes that are full-sized for an ordinary user (`fs.pipe-user-pages-soft`). The most memory in them: the kernel takes
#: it from what all programs of the machine may have (`net.ipv4.udp_mem`, `tcp_mem`).
MOST_SOCKETS, MOST_PIPES, IN_SOCKETS_BYTES = 500, 250, 128 * MIB
#: The number of polls between two looks at connections of TCP, if there are any.
TCP_EVERY = 4
#: How much memory the worker may use beyond its size at the start: what it has recorded, which takes 160 MiB at most,
#: and received messages that were not yet taken.
UNREAD_BYTES = 224 * MIB
#: If real time runs out after the nodes spent more than STARVED_SHARE of it waiting for a processor, the machine was
#: too busy; but not if the nodes themselves used more than OWN_SHARE of all processor time.
STARVED_SHARE, OWN_SHARE = 0.25, 0.5
#: Threads and children that together use more than the busiest thread, and more of all processors than this, while the
#: nodes do not wait for one, may be why they have to. The threads of the middleware use a tenth of that.
OTHERS_SHARE = 0.05


@dataclass(frozen=True, slots=True)
class Budget:
    """The rest of the real time that a submission may take.

    Attributes:
        left_ns: Real time that is left.
        words: The reason to give when a recording is ended because the time is used up.
    """

    left_ns: int
    words: str

    def after(self, started_ns: int) -> Budget:
        """Return what is left of it if it has been in use since a reading of `time.monotonic_ns`."""
        return replace(self, left_ns=self.left_ns - (time.monotonic_ns() - started_ns))


class ResourceMonitor:
    """A context manager with a thread that polls the usage of processes, next to the runner's thread.

    Args:
        students: The processes to monitor.
        limits: Limits of each process.
        budget: Real time that is left for the submission, if it is limited.
        sockets: Looks at the sockets of the processes.
        own_s: Seconds of processor time that this process may use itself; as much as a node by default.
        kernel: Reads what processes use.
    """

    def __init__(  # noqa: PLR0913 - whom it watches, what they may use, and how it looks
        self,
        students: Sequence[NodeProcess],
        limits: Limits,
        budget: Budget | None = None,
        *,
        sockets: SocketMemory,
        own_s: int | None = None,
        kernel: Kernel = usage,
    ) -> None:
        self._kernel = kernel
        self._own_s = limits.processor_s if own_s is None else own_s
        self._students = students
        self._limits = limits
        self._budget = budget
        self._families: dict[int, set[int]] = {}
        self._computing = ComputingProcesses(kernel)
        self._sockets = sockets
        self._held: dict[int, KernelMemory] = {}
        self._last_pid = ""
        self._started_ns = time.monotonic_ns()
        # What this process has filled and used before is not due to these nodes.
        self._own_bytes = kernel.usage([os.getpid()]).memory_bytes
        self._own_ns = time.process_time_ns()
        self._over = threading.Event()
        self._starved = False
        self._ending = False
        self._polls = self._search_at = 0  # counted in polling intervals
        self._used_bytes = 0
        self._used_ns = self._waited_ns = self._most_starved_ns = 0
        self._others_ns = self._busiest_ns = 0
        self._own_waited_ns = self._own_waiting_ns()
        self._thread = threading.Thread(target=self._watch, name="guard", daemon=True)

    def __enter__(self) -> ResourceMonitor:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def reviewed(self, trace: AssessedTrace) -> AssessedTrace:
        """Add to a trace how long threads waited, and a harness problem if waiting used up the time."""
        if trace.clock is ClockKind.WALL:
            self._look_for_waiting()
            most_ns = 0 if self.fills_machine else self._most_starved_ns
            own_ns = self._own_waiting_ns() - self._own_waited_ns
            # On a busy machine the same work takes a smaller share of the time.
            own_time_ns = self.real_ns - min(self._waited_ns, self.real_ns)
            trace = replace(
                trace,
                most_starved_ns=most_ns,
                all_starved_ns=self.starved_ns + max(0, own_ns) if most_ns else 0,
                suspected=self._others_ns > max(self._busiest_ns, OTHERS_SHARE * self._processors * own_time_ns),
            )
        return replace(trace, harness_problem=trace.harness_problem or self.problem)

    @property
    def problem(self) -> str:
        """Why the end of the time is not the nodes' fault; empty if it is, or if there is time left."""
        busy = "the machine was too busy: the nodes waited for a processor until their time ran out"
        return busy if self._starved else ""

    @property
    def real_ns(self) -> int:
        """Real time since the start, in nanoseconds."""
        return time.monotonic_ns() - self._started_ns

    @property
    def starved_ns(self) -> int:
        """Real time that the nodes have lost to other programs on this machine, in nanoseconds."""
        return 0 if self.fills_machine else min(self._waited_ns, self.real_ns)

    @property
    def fills_machine(self) -> bool:
        """Whether the nodes use so much of the machine that they wait for each other, which is their own doing."""
        return self._used_ns > OWN_SHARE * self._processors * self.real_ns

    @property
    def _processors(self) -> int:
        return len(os.sched_getaffinity(0))

    def _own_waiting_ns(self) -> int:
        return sum(self._kernel.threads_starved_ns([os.getpid()]).values())

    def _watch(self) -> None:
        intervals = 1
        while not self._over.wait(intervals * LOOK_S):
            intervals = self.poll(intervals)

    def poll(self, intervals: int = 1) -> int:
        """Stop what has reached a limit; called by the monitor's own thread.

        Args:
            intervals: How many polling intervals have passed since the last poll.

        Returns:
            After how many of them the next poll is due.
        """
        self._polls += intervals
        search = self._polls >= self._search_at
        if search:
            self._search_at = self._polls + SEARCH_EVERY
            self._look_for_children()
            self._look_for_names()
            self._look_for_waiting()
        much = self._look_at_sockets(search=search)
        before, self._used_bytes = self._used_bytes, self._look()
        # Rarely while nothing grows, so that the looks cost nodes no time; at once again when something does.
        return 1 if much or self._used_bytes > before + GROWTH_BYTES else min(2 * intervals, LONGEST)

    def _look_at_sockets(self, *, search: bool) -> bool:
        """Find out what the processes hold in sockets and pipes, if it may be much; return whether it may be."""
        many, connections = self._sockets.may_be_much()
        tcp = connections and self._polls % TCP_EVERY == 0
        pids = [pid for family in self._families.values() for pid in family]
        if many or tcp or (search and descriptors(pids) > MANY_DESCRIPTORS):
            found = self._sockets.look(self._families.values(), tcp=connections)
            self._held = dict(zip(self._families, found, strict=True))
        elif not connections:
            self._held = {}
        return many or connections or bool(self._held)

    def _look_for_children(self) -> None:
        """Find the families of processes; they are as before if nothing has been started since."""
        last = self._kernel.last_pid()  # before the search, which may miss what is started meanwhile
        if not last or last != self._last_pid:
            students = [*self._students]  # the runner's thread may add one meanwhile
            found = self._kernel.families([root for s in students for root in s.roots])
            self._families = {s.process.pid: set().union(*(found[root] for root in s.roots)) for s in students}
            self._last_pid = last

    def _look(self) -> int:
        """Stop what has reached a limit, and return the memory of the processes and of this one in bytes."""
        used_bytes = 0
        for student in self._students:
            held = self._held.get(student.process.pid, KernelMemory())
            used = self._kernel.usage(self._families.get(student.process.pid, ()))
            used = replace(used, memory_bytes=used.memory_bytes + held.memory_bytes)
            # Sockets before memory, in which they are counted too: the limit that is named is the one to do something
            # about.
            self._hold(student, _held_too_much(held))
            student.most_threads = max(student.most_threads, used.threads)
            student.most_bytes = max(student.most_bytes, used.memory_bytes)
            # The largest of all looks: what a child has used leaves the sum when it ends and nobody waits for it.
            student.used_ns = max(student.used_ns, used.processor_ns)
            self._hold(student, self._reached(used))
            used_bytes += used.memory_bytes
        self._look_at_time()
        return used_bytes + self._look_at_itself()

    def _look_at_itself(self) -> int:
        """Stop all processes at a limit of the worker itself, which only messages can cause; return its memory."""
        own_bytes = self._kernel.usage([os.getpid()]).memory_bytes
        if own_bytes > FULL_BYTES:
            os._exit(FULL_CODE)  # the middleware may go on filling it when the nodes have ended
        filled_bytes = own_bytes - self._own_bytes
        if filled_bytes > UNREAD_BYTES:
            self._hold_all(f"stopped at {size(UNREAD_BYTES)} of messages in transit at once")
        if time.process_time_ns() - self._own_ns > self._own_s * NS_PER_S:
            self._hold_all(f"stopped at {processor_words(self._own_s)} to receive what was sent")
        return own_bytes

    def _look_at_time(self) -> None:
        if self._ending:
            return
        real_ns = self.real_ns
        # The budget of the submission first: the limit of a scenario says nothing when hardly any of it was left.
        if self._budget is not None and real_ns > self._budget.left_ns:
            self._end_time(self._budget.words)
        elif real_ns > self._limits.wall_ns:
            self._end_time(f"stopped after {self._limits.wall_words()}")

    def _look_for_waiting(self) -> None:
        pids = [pid for family in self._families.values() for pid in family]
        self._used_ns = max(self._used_ns, self._kernel.usage(pids).processor_ns)
        look = self._computing.look(pids, time.monotonic_ns())
        # For each program alone: the first threads of several programs are not the second thread of one.
        used = [
            (self._kernel.usage(family).processor_ns, self._kernel.busiest_thread_ns(family.difference(look.computing)))
            for family in self._families.values()
        ]
        self._busiest_ns = max(self._busiest_ns, max((most_ns for _, most_ns in used), default=0))
        self._others_ns = max(self._others_ns, sum(max(0, whole_ns - most_ns) for whole_ns, most_ns in used))
        self._waited_ns = max(self._waited_ns, sum(look.waited_ns))
        self._most_starved_ns = max(self._most_starved_ns, max(look.waited_ns, default=0))

    def _look_for_names(self) -> None:
        for student in self._students:
            if self._kernel.scratch_names(self._families.get(student.process.pid, ())) > MOST_NAMES:
                self._hold(student, f"stopped at {MOST_NAMES:,} files in one folder")

    def _reached(self, used: Usage) -> str:
        """Describe the limit that was reached; empty if none was."""
        limits = self._limits
        if used.memory_bytes > limits.memory_bytes:
            return f"stopped at {limits.memory_words()}"
        if used.processor_ns > limits.processor_ns:
            return f"stopped at {limits.processor_words()}"
        if used.halted:
            return "stopped: a signal had halted it for good"
        if used.threads > limits.processes + WRAPPERS:
            return f"stopped at {limits.processes_words()}"
        return ""

    def _end_time(self, why: str) -> None:
        self._look_for_waiting()
        if any(not s.ended and not s.stopped for s in self._students):
            self._starved = self.starved_ns > STARVED_SHARE * self.real_ns
        self._hold_all(why)

    def _hold_all(self, why: str) -> None:
        self._ending = True
        for student in self._students:
            self._hold(student, why)

    def _hold(self, student: NodeProcess, why: str) -> None:
        if why and not student.stopped:
            student.stop(why, self._families.get(student.process.pid, set()))


def _held_too_much(held: KernelMemory) -> str:
    """Describe the limit that sockets and pipes have reached; empty if they reached none."""
    if held.memory_bytes > IN_SOCKETS_BYTES:
        return f"stopped at {size(IN_SOCKETS_BYTES)} of memory in sockets and pipes"
    if held.sockets > MOST_SOCKETS:
        return f"stopped at {MOST_SOCKETS} open sockets"
    if held.pipes > MOST_PIPES:
        return f"stopped at {MOST_PIPES} open pipes"
    return ""
