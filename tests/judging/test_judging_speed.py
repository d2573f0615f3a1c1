"""Judging takes tens of milliseconds."""

from __future__ import annotations

import time

import pytest
from tracing import ODOM_TIMES, Recording, position_logs
from wordings import RIGHT, WRONG, Writer

from grader.judging.checks.odometry import LogPeriod, LogsPosition

PERIOD = LogPeriod("odom_subscriber.py", "/odom", 1_000_000_000)
POSITION = LogsPosition("odom_subscriber.py", "/odom")
LONG: dict[str, Writer] = {
    "right": RIGHT["chapter hint"],
    "three records": RIGHT["three records"],
    "unlabelled": RIGHT["stamp before"],
    "swapped": WRONG["swapped"][0],
    "scaled": WRONG["scaled"][0],
    "many numbers": lambda x, y: " ".join(f"{k * x:.2f}" for k in range(40)),
}


def quickest(rec: Recording) -> float:
    trace = rec.trace()
    took = []
    for _ in range(3):
        start = time.process_time()
        POSITION.judge(trace)
        PERIOD.judge(trace)
        took.append(time.process_time() - start)
    return min(took)


@pytest.mark.parametrize("write", LONG.values(), ids=LONG)
def test_a_log_for_every_message_is_judged_quickly(write: Writer) -> None:
    """About 430 messages and as many logs; processor time, with room for a slow machine."""
    assert quickest(position_logs(write, ODOM_TIMES)) < 1.0
