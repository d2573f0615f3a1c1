"""The thread that wakes the runner of the wall clock, with pipes instead of processes."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import cast

import pytest

from grader.runtime.worker.output_watch import OutputWatch
from grader.runtime.worker.student_process import NodeProcess


@dataclass
class Writer:
    """Stands for a process with one output."""

    pipe: tuple[int, int] = field(default_factory=os.pipe)
    ended: bool = False
    asked: threading.Event = field(default_factory=threading.Event)

    def descriptors(self) -> tuple[int, ...]:
        self.asked.set()
        return () if self.ended else self.pipe[:1]


@pytest.fixture
def writer() -> Iterator[Writer]:
    made = Writer()
    yield made
    for descriptor in made.pipe:
        os.close(descriptor)


def test_output_wakes_until_it_is_read(writer: Writer) -> None:
    """Also what comes later."""
    woken = threading.Event()
    with OutputWatch([cast("NodeProcess", writer)], woken.set):
        assert not woken.wait(0.2)
        for _ in range(2):
            os.write(writer.pipe[1], b"x")
            assert woken.wait(60)
            os.read(writer.pipe[0], 1)
            writer.asked.clear()
            assert writer.asked.wait(60)  # whatever it noticed before the read, it has told by now
            woken.clear()
            assert not woken.wait(0.2)


def test_what_has_ended_wakes_nobody(writer: Writer) -> None:
    """Its socket stays readable for good, and would keep the runner busy."""
    os.write(writer.pipe[1], b"x")
    writer.ended = True
    woken = threading.Event()
    with OutputWatch([cast("NodeProcess", writer)], woken.set):
        assert not woken.wait(0.2)
