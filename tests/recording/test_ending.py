"""How an end is worded, and which limit is behind it."""

from __future__ import annotations

import pytest

from grader.model.limits import Limits
from grader.model.quantities import MIB
from grader.model.trace import FaultKind
from grader.recording.ending import ending_fault, limit_behind, reported_fault

LIMITS = Limits(memory_bytes=200 * MIB, processes=50, open_files=77, file_bytes=3 * MIB, scratch_bytes=5 * MIB)


@pytest.mark.parametrize(
    ("text", "limit"),
    [
        ("MemoryError", "200 MiB of memory"),
        ("numpy.core._exceptions._ArrayMemoryError: Unable to allocate 7.45 GiB", "200 MiB of memory"),
        ("OSError: [Errno 12] Cannot allocate memory", "200 MiB of memory"),
        ("RuntimeError: can't start new thread", "50 processes and threads"),
        ("BlockingIOError: [Errno 11] Resource temporarily unavailable", "50 processes and threads"),
        ("OSError: [Errno 24] Too many open files: 'x'", "77 open files"),
        ("OSError: [Errno 27] File too large", "3 MiB in one file"),
        ("OSError: [Errno 28] No space left on device", "5 MiB in one folder"),
    ],
)
def test_an_error_that_a_limit_is_behind_names_it(text, limit):
    """What Python says stays, what it means is added."""
    fault = reported_fault("a.py", 5, {"kind": "exception", "text": text, "file": "a.py", "line": 3}, LIMITS)
    assert (fault.text, fault.file, fault.line) == (f"{text} (the limit is {limit})", "a.py", 3)


def test_other_errors_stay_as_they_are():
    """Most errors have nothing to do with limits."""
    assert reported_fault("a.py", 5, {"text": "ValueError: x"}, LIMITS).text == "ValueError: x"


@pytest.mark.parametrize(
    ("signal", "last", "threads", "said"),
    [
        ("SIGXCPU", b"", 1, "stopped at 120 s of processor time"),
        ("SIGXFSZ", b"", 1, "stopped at 3 MiB in one file"),
        ("SIGPWR", b"", 1, "in one folder"),
        ("SIGABRT", b"terminate called after throwing an instance of 'std::bad_alloc'", 1, "200 MiB of memory"),
        ("SIGABRT", b"", 49, "ended by SIGABRT (the limit is 50 processes and threads)"),
        ("SIGABRT", b"", 20, ""),
        ("SIGKILL", b"std::bad_alloc", 50, ""),
    ],
)
def test_a_signal_that_a_limit_is_behind_names_it(signal, last, threads, said):
    """Where nothing explains the signal, nothing is made up."""
    found = limit_behind(signal, last, threads, LIMITS)
    assert said in found
    assert bool(found) == bool(said)


@pytest.mark.parametrize("code", [True, "0", None, 1.5, [0], 10**30])
def test_an_absurd_exit_is_worded_all_the_same(code):
    """The code of a report is untrusted as everything else in it."""
    fault = ending_fault("a.py", 5, {"code": code}, LIMITS)
    assert fault.kind is FaultKind.EXITED
    assert len(fault.text) < 100
