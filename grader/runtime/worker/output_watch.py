"""Watches, in a thread, the outputs and sockets of students' processes, for a runner that waits for messages."""

from __future__ import annotations

import select
import threading
from collections.abc import Callable, Sequence

from grader.runtime.worker.student_process import NodeProcess

#: How long one wait takes at most, and the pause after one that found something, in which the runner reads it.
WAIT_MS, PAUSE_S = 50, 0.0005


class OutputWatch:
    """A context manager with a thread that notices when a process writes, reports or ends.

    Args:
        students: The processes, which have been started.
        wake: Called, in the thread, until what was noticed has been read.
        also: Descriptors of others that the runner reads from.
    """

    def __init__(self, students: Sequence[NodeProcess], wake: Callable[[], None], also: Sequence[int] = ()) -> None:
        self._students = students
        self._wake = wake
        self._also = also
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="outputs", daemon=True)

    def __enter__(self) -> OutputWatch:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._over.is_set():
            ready = select.poll()
            of_students = (descriptor for student in self._students for descriptor in student.descriptors())
            for descriptor in (*self._also, *of_students):
                ready.register(descriptor, select.POLLIN)
            if ready.poll(WAIT_MS):
                self._wake()
                self._over.wait(PAUSE_S)
