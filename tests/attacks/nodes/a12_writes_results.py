"""Writes the results that it would like to have wherever a grader might look for them."""

import json
import os

from attempts import attempt, run
from planted import OUTSIDE, REPORT

RESULT = json.dumps({"score": 100, "max_score": 100, "final": True, "tests": [{"score": 100, "status": "passed"}]})
OWN_COPY = os.path.join(os.path.dirname(os.path.abspath(__file__)), "")
SCRATCH = os.path.dirname(os.environ["HOME"])
PLACES = (REPORT, "/results.json", "/autograder/results/results.json", "/submission/results.json", "/result.xml",
          OUTSIDE + "/results.json", "../results.json", "../../report.json", "/grader_host/results.json")


@attempt
def writes_where_it_should_not(node):
    written = []
    for place in PLACES:
        try:
            os.makedirs(os.path.dirname(place) or ".", exist_ok=True)
            with open(place, "w") as file:
                file.write(RESULT)
        except OSError:
            continue
        written.append(os.path.abspath(place))
    # In its own scratch folders, and in its own copy of the submission, it may write what it likes; whether anything
    # arrived outside is for others to say.
    return [place for place in written if not place.startswith(("/tmp/", SCRATCH, OWN_COPY))]


run(rate_hz=5)
