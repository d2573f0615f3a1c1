"""What programs of a stepped run have done, step by step: who has sent and read what, in which order."""

from __future__ import annotations

from typing import NamedTuple


class StepEvent(NamedTuple):
    """Something that a node does in a step, or that is done to it.

    Attributes:
        node: The full name of the node, or the name of a program that has none yet.
        does: It `reads` or `sends` a message, `finds` or `misses` a server, runs a `timer`, `offers` something to the
            graph; and what a fault does to it: it `loses` a message, a message to it is `late`, it is `paused` or
            `killed`.
        what: The channel, such as `topic /x`, `request /y` or `response /y`; of `offers` the kind and the name; the
            seconds of `late` and `paused` come before the channel.
        others: The nodes on the other side: the sender of what is read, or the receivers of what is sent.
    """

    node: str
    does: str
    what: str = ""
    others: tuple[str, ...] = ()


class ProgramStep(NamedTuple):
    """One step of a program: it runs until nothing is left for it to do at this instant.

    Attributes:
        t_ns: When.
        process: The name of the program.
        name: The name of the step, as in `drawn_steps` of a plan; empty for a fault.
        deviates: Whether anything was drawn otherwise than it would have been without a seed.
        events: What happened in it, in order.
    """

    t_ns: int
    process: str
    name: str
    deviates: bool
    events: tuple[StepEvent, ...]
