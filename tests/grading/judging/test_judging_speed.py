"""The work of judging grows with a recording, and no faster."""

from __future__ import annotations

import pytest
from tracing import ODOM_TIMES, Recording, position_logs
from wordings import RIGHT, WRONG, Writer
from work import calls_in

from grader.grading.rubrics.exercise_checks import known_checks

PERIOD = known_checks()["log_period"]("odom_subscriber.py", "/odom", 1_000_000_000)
POSITION = known_checks()["logs_position"]("odom_subscriber.py", "/odom")
LONG: dict[str, Writer] = {
    "right": RIGHT["chapter hint"],
    "three records": RIGHT["three records"],
    "unlabelled": RIGHT["stamp before"],
    "swapped": WRONG["swapped"][0],
    "scaled": WRONG["scaled"][0],
    "many numbers": lambda x, y: " ".join(f"{k * x:.2f}" for k in range(20)),
}


def cost(rec: Recording) -> int:
    trace = rec.trace()
    return calls_in(lambda: (POSITION.judge(trace), PERIOD.judge(trace)))


@pytest.mark.breadth(2, 6)
@pytest.mark.parametrize("write", LONG.values(), ids=LONG)
def test_twice_as_many_logs_cost_twice_as_much(write: Writer) -> None:
    """About 430 messages and as many logs; comparing each log with each message would cost four times as much."""
    whole, half = cost(position_logs(write, ODOM_TIMES)), cost(position_logs(write, ODOM_TIMES[::2]))
    assert whole < 2.5 * half
    assert whole < 3_000 * len(ODOM_TIMES)
