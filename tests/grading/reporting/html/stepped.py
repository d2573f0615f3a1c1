"""The page of a failed test, from a run that is built in code: topics, a service, an action, a program that fails."""

from __future__ import annotations

from tracing import FLOAT32, Recording

from grader.grading.judging.figures_of_test import played_test, shown_steps, value_charts
from grader.grading.model.chart import Excerpt
from grader.grading.model.tested_run import NotedCall, SideOfTest
from grader.grading.reporting.html.render import render_run
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import Endpoint, ServiceEnd


def page_of_failed_test(text: str = "fine", omitted: int = 3) -> str:
    """Return a page all of whose texts are the one given; so many steps are left out of it."""
    rec = Recording(4, process=text).endpoint("publisher", f"/{text}", FLOAT32, node=f"/{text}").log(1, text, "WARN")
    rec.service("client", f"/add{text}", text, node=f"/{text}")
    for k in range(8):
        rec.deliver(k / 2, "/a", {"data": float(k), "name": text}).number(k / 2, f"/{text}", 2.0 * k)
    rec.request(3, f"/add{text}", 1, value={"a": text}).response(3, f"/add{text}", 1, {"sum": text})
    rec.request(1, "/go/_action/send_goal", 1, "student", {"goal_id": {"uuid": [1]}, "goal": {"where": text}})
    rec.response(1, "/go/_action/send_goal", 1, {"accepted": True}, "grader")
    rec.crashed(3.5, text, line=6)
    calls = (
        NotedCall("run", text, 5, 0, 0, failed=False, text=text),
        NotedCall("advance", f"/{text}.py", 6, 0, 4 * NS_PER_S, failed=True, text=text),
    )
    ends = (
        (0, Endpoint("publisher", "/a", FLOAT32, "the test", -1, "reliable", "volatile")),
        (NS_PER_S, ServiceEnd("service", f"/add{text}", text, "the test")),
    )
    side = SideOfTest(calls, omitted, ends, (f"/{text}",), (f"/{text}.py", 6))
    excerpts = (Excerpt(text, 6, 5, (text, text)),)
    trace, facts = rec.trace(), {"seed": text}
    run, charts, steps = played_test(trace, side, [text]), value_charts(trace, side), shown_steps(side, text)
    return render_run(text, text, run, facts, charts, steps, side.omitted, excerpts)
