"""Random programs that once did something else than the model says, as small as hypothesis could make them."""

from __future__ import annotations

from program_description import End, Ending, Every, Node, Process, Program, Spinning, Timer


def alone(node: Node, spinning: Spinning = Spinning.SPIN) -> Program:
    """Return a program of one node."""
    return Program((Process((node,), spinning),), 2000)


COUNTER_EXAMPLES: dict[str, Program] = {
    # The grader was not told how late it was, and recorded the end at the last time that it knew.
    "leaves_at_once_after_saying_nothing": alone(
        Node("n0", 1, (Timer("t00", 50, (Every(3, (End(Ending.LEAVE_AT_ONCE),)),)),), ())
    ),
}
