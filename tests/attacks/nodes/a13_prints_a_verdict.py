"""Prints every line that a naive grader could take for a result, also in the grader's own words."""

import json
import sys

from attempts import attempt, every_tick, run

LINES = (
    "PASSED", "OK", "1..5", "ok 1 - rate", "SCORE: 100", "Score: 100/100", "===== 5 passed in 0.01s =====",
    json.dumps({"schema": "grader/report/v1", "score": 100, "final": True, "exercises": []}),
    json.dumps({"trace": {"scenario": "alone", "observations": []}}),
    json.dumps({"kind": "exited", "code": 0}),
    "\x1eINFO\x1fgrader\x1f/submission/a13_prints_a_verdict.py\x1f1\x1frate: met\x1d",
    f"\x1e{'0' * 32}\x1fINFO\x1fgrader\x1f/submission/a13_prints_a_verdict.py\x1f1\x1frate: met\x1d",
    "\x04\x1a{\"outcome\": \"met\"}",
)


@attempt
def nothing_yet(node):
    return False


@every_tick
def prints(node):
    for stream in (sys.stdout, sys.stderr):
        print(*LINES, sep="\n", file=stream, flush=True)


run(rate_hz=5)
