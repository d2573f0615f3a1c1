"""Makes the figures of a run that a test stepped: its steps above what programs did, and the values of every topic."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice

from grader.grading.judging.charts import Lanes
from grader.grading.judging.figures import picture_of, playback
from grader.grading.judging.plots import Drawing, Plot, drawn_chart
from grader.grading.judging.values import HIDDEN_TOPICS
from grader.grading.model.chart import Chart, Panel, Playback, ShownStep, Stretch, Tone, VerticalLine
from grader.grading.model.tested_run import NotedCall, SideOfTest
from grader.runtime.model.quantities import counted, seconds
from grader.runtime.model.trace import Delivery, Endpoint, Message, Request, Trace

#: What both sides are named, in the words of a test.
SIDES_OF_TEST = {"grader": "test", "student": "program"}
#: Maximum number of charts of topics, of charts of services and actions, of rows for messages, and of marked steps.
_MOST_TOPICS, _MOST_CALLED, _MOST_ROWS, _MOST_STRETCHES = 12, 8, 8, 40
#: Of messages that are larger, such as images, only the times are shown.
_LARGE_BYTES = 64 * 1024
#: The id of the run, which its charts share.
RUN = "run"


def played_test(trace: Trace, test: SideOfTest, processes: Sequence[str]) -> Playback:
    """Return the run of a test to play: its steps are above what the programs logged, and its ends in the graph."""
    lanes = Lanes(sides=SIDES_OF_TEST)
    if test.calls or test.failed_at:
        lanes.add("the test: steps")
        lanes.dots("step", ((call.begin_ns, _step_said(test, call)) for call in test.calls), Tone.SECOND)
        failed = [] if test.failed_at is None else [(test.end_ns, f"{_place(test, *test.failed_at)} failed")]
        lanes.dots("failed", failed, Tone.BAD)
    run = playback(trace, RUN, processes, lanes=lanes, beside=test.ends)
    timeline = run.timeline
    timeline = replace(
        timeline,
        title="Steps of the test, logs, calls and faults over time",
        about=f"{_steps_said(test)}{timeline.about}",
        panels=(*timeline.panels, *_messages(trace, test)),
        moments=(*timeline.moments, *_failure(test)),
        cases=tuple(islice(_stretches(test), _MOST_STRETCHES)),
    )
    shown = (topic for topic in run.topics if "/_" not in topic.topic)
    topics = tuple(
        replace(topic, sender=_sender(topic.topic, test) if topic.sender == "grader" else SIDES_OF_TEST[topic.sender])
        for topic in shown
    )
    return replace(run, timeline=timeline, topics=topics, about=f"{_steps_said(test)}{run.about}")


def value_charts(trace: Trace, test: SideOfTest) -> tuple[Chart, ...]:
    """Return charts of topics, those first that the test looked at, of services and actions, and of simulations."""
    charts = [chart for topic in _topics(trace, test) if (chart := drawn_chart(_values_of(topic, test), trace))]
    charts += islice(_called(trace), _MOST_CALLED)
    if test.sketches:
        charts.append(picture_of(test.sketches, "Seen from above"))
    found = []
    for number, chart in enumerate(charts, 1):
        faults = [moment for moment in chart.moments if moment.tone is Tone.BAD]
        moments = () if chart.square else (*faults, *_failure(test))
        found.append(replace(chart, id=f"values-{number}", scenario=RUN, moments=moments))
    return tuple(found)


def _values_of(topic: str, test: SideOfTest) -> Drawing:
    return Drawing((Plot(topic),), came=f"published by the {_sender(topic, test)} on")


def _sender(topic: str, test: SideOfTest) -> str:
    """Return who has published what programs did not: the test, or a simulation that it lets take part."""
    publishers = (end for _, end in test.ends if isinstance(end, Endpoint) and end.kind == "publisher")
    nodes = (end.node for end in publishers if end.topic == topic)
    return next(nodes, SIDES_OF_TEST["grader"]).removeprefix("the ")


def shown_steps(test: SideOfTest, failing: str) -> tuple[ShownStep, ...]:
    """Return the calls of a test, and where it failed.

    Args:
        test: What it did.
        failing: The line of source at which it failed; empty if it did not, or if nobody knows.
    """
    calls = [
        ShownStep(
            seconds(c.begin_ns), seconds(c.end_ns), _place(test, c.file, c.line), c.text or c.name, _ends(test, c)
        )
        for c in test.calls
    ]
    if test.failed_at is not None and not (calls and calls[-1].failed):
        end_s = seconds(test.end_ns)
        calls.append(ShownStep(end_s, end_s, _place(test, *test.failed_at), failing, failed=True))
    return tuple(calls)


def _ends(test: SideOfTest, call: NotedCall) -> bool:
    """Return whether a call is what failed the test."""
    return call.failed and call is test.calls[-1] and (call.file, call.line) == test.failed_at


def _step_said(test: SideOfTest, call: NotedCall) -> str:
    return f"{_place(test, call.file, call.line)}: {call.text or call.name}"


def _place(test: SideOfTest, file: str, line: int) -> str:
    """Return a line, with the name of its file if the test has steps in several."""
    files = {call.file for call in test.calls} | ({test.failed_at[0]} if test.failed_at else set())
    return f"{file.rpartition('/')[2]}, line {line}" if len(files) > 1 else f"line {line}"


def _steps_said(test: SideOfTest) -> str:
    if not test.calls:
        return ""
    where = "" if test.failed_at is None else f", failed in {_place(test, *test.failed_at)}"
    return f"the test: {counted(len(test.calls) + test.omitted, 'step')}{where}; "


def _failure(test: SideOfTest) -> tuple[VerticalLine, ...]:
    if test.failed_at is None:
        return ()
    return (VerticalLine(seconds(test.end_ns), f"{_place(test, *test.failed_at)} failed", Tone.BAD),)


def _stretches(test: SideOfTest) -> Iterator[Stretch]:
    """Yield the steps in which time passed."""
    for call in test.calls:
        if call.end_ns > call.begin_ns:
            yield Stretch(seconds(call.begin_ns), seconds(call.end_ns), _place(test, call.file, call.line))


def _sent(trace: Trace) -> Mapping[str, list[Message | Delivery]]:
    """Return what was published on each topic, without what every node and every action has."""
    sent: dict[str, list[Message | Delivery]] = {}
    for one in trace.observations:
        if isinstance(one, (Message, Delivery)) and one.topic not in HIDDEN_TOPICS and "/_" not in one.topic:
            sent.setdefault(one.topic, []).append(one)
    return sent


def _topics(trace: Trace, test: SideOfTest) -> Iterator[str]:
    sent = _sent(trace)
    small = [topic for topic, found in sent.items() if max(len(one.cdr) for one in found) <= _LARGE_BYTES]
    looked_at = [topic for topic in test.looked_at if topic in small]
    return islice(dict.fromkeys((*looked_at, *small)), _MOST_TOPICS)


def _messages(trace: Trace, test: SideOfTest) -> Iterator[Panel]:
    """Yield a panel with the time of each message, a row for each topic, if there are any."""
    lanes = Lanes()
    for topic, found in islice(_sent(trace).items(), _MOST_ROWS):
        lanes.add(topic)
        for kind, name, tone in (
            (Delivery, f"message of the {_sender(topic, test)}", Tone.SECOND),
            (Message, "message of a program", Tone.MAIN),
        ):
            lanes.dots(name, ((one.t_ns, "") for one in found if isinstance(one, kind)), tone)
    if lanes.names:
        yield lanes.panel("messages")


def _called(trace: Trace) -> Iterator[Chart]:
    """Yield the charts of actions and services between the test and programs."""
    names = dict.fromkeys(one.service for one in trace.of(Request))
    for name in names:
        action, _, part = name.partition("/_action/")
        if part in ("", "send_goal"):
            drawing = Drawing(action=action) if part else Drawing(services=(name,))
            chart = drawn_chart(replace(drawing, sides=SIDES_OF_TEST), trace)
            if chart is not None:
                yield chart
