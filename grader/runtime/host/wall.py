"""Runs a student's program on the real clock: no clock is replaced, but first and last messages are not lost.

A publisher waits for the grader's subscription before its first message. It waits earlier if it can, before a timer is
created or a node spins: a timer that has begun would come late for the first time and in time for the second.
"""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import weakref
from collections.abc import Callable
from typing import Any

from . import originals
from .link import Link
from .protocol import Claim, EarlyMessage, Parameters, Progress

#: How long, in real time, new publishers wait for the grader's subscriptions, and how the name of the grader's node
#: begins.
MATCH_S, OBSERVER = 2.0, "_ros2cli_daemon_"
#: How long, in real time, to wait until what was sent has arrived before its sender is destroyed.
ACKNOWLEDGED_S = 0.5
#: Nobody would have heard a first message before which its thread has waited for less than this since its publisher was
#: created, without the time for which it waited for a processor: discovery takes some ten milliseconds.
EARLY_S = 0.03
#: The same for work, as in virtual time (`DISCOVERED_NS` in `outbox`).
WORKED_S = 0.2
#: The most such messages that are reported.
MOST_EARLY = 500
#: The most parameters in one report.
MOST_PARAMETERS = 1_000
#: How long the other side may take to pass on a request or a response that it has read: nothing tells when it has.
TAKEN_S = 0.03


class _Existed:
    """Measures what a thread has done since a publisher was created.

    Args:
        host_s: Returns how long this module has made threads of the program wait so far, which is not counted.
    """

    def __init__(self, host_s: Callable[[], float]) -> None:
        self._host_s, self._host_began_s = host_s, host_s()
        self.thread = originals.get_native_id()
        self._began_s, self._worked_s = originals.perf_counter(), originals.thread_time()
        self._starved_ns = originals.starved_ns(self.thread)

    def is_undiscovered(self) -> bool:
        """Return whether the thread, if it is the same, has neither waited nor worked for long."""
        passed_s = originals.perf_counter() - self._began_s - (self._host_s() - self._host_began_s)
        if self.thread != originals.get_native_id():
            return passed_s < EARLY_S
        worked_s = originals.thread_time() - self._worked_s
        starved_s = (originals.starved_ns(self.thread) - self._starved_ns) / 1e9
        return worked_s < WORKED_S and passed_s - worked_s - starved_s < EARLY_S


class WallTime:
    """The real clock, with the same interface as `VirtualTime`.

    Args:
        link: The connection to the grader.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._publishing: weakref.WeakSet[Any] = weakref.WeakSet()
        self._unwatched: weakref.WeakSet[Any] = weakref.WeakSet()
        self._patience: Any = None
        self._exchanged = False
        self._early_reports = 0
        #: The parameters that were reported, by their identity: a new value is a new object.
        self._reported: tuple[int, ...] = ()
        self.waited_s = 0.0
        self.domain = 0
        #: As in `VirtualTime`.
        self.before_stop: Callable[[], None] = lambda: None

    def install_ros(self) -> None:
        """Make every publisher wait for the grader's subscription, so that its first message is recorded."""
        import rclpy.client
        import rclpy.publisher
        import rclpy.service
        from rclpy.duration import Duration

        from . import lifetimes
        from .endpoints import BACKGROUND
        from .qos import is_latched

        publish, make = rclpy.publisher.Publisher.publish, rclpy.publisher.Publisher.__init__
        time = self
        existed_s: weakref.WeakKeyDictionary[Any, _Existed] = weakref.WeakKeyDictionary()
        self._patience = Duration(seconds=ACKNOWLEDGED_S)

        @functools.wraps(make)
        def made(self: Any, *args: Any, **kwargs: Any) -> None:
            make(self, *args, **kwargs)
            if self.topic_name not in BACKGROUND:
                time._unwatched.add(self)
            if not is_latched(self):
                existed_s[self] = _Existed(lambda: time.waited_s)

        @functools.wraps(publish)
        def publish_when_matched(self: Any, msg: Any) -> Any:
            if self not in time._publishing and self.topic_name not in BACKGROUND:
                existed = existed_s.pop(self, None)
                early = existed is not None and existed.is_undiscovered()
                time._await_watched()
                time._publishing.add(self)
                if early:
                    began_ns = originals.time_ns()
                    try:
                        return publish(self, msg)
                    finally:
                        time.report_early(self.topic_name, began_ns)
            return publish(self, msg)

        def when_heard(destroy: Callable[..., None]) -> Callable[..., None]:
            @functools.wraps(destroy)
            def destroy_when_heard(sender: Any) -> None:
                self._leave()
                destroy(sender)

            return destroy_when_heard

        def noting(send: Callable[..., Any]) -> Callable[..., Any]:
            @functools.wraps(send)
            def noted(*args: Any, **kwargs: Any) -> Any:
                self._exchanged = True
                return send(*args, **kwargs)

            return noted

        self._install_waits(existed_s)
        rclpy.publisher.Publisher.__init__ = made
        rclpy.publisher.Publisher.publish = publish_when_matched
        for sender in (rclpy.publisher.Publisher, rclpy.client.Client, rclpy.service.Service):
            sender.destroy = when_heard(sender.destroy)
        rclpy.client.Client.call_async = noting(rclpy.client.Client.call_async)
        rclpy.service.Service.send_response = noting(rclpy.service.Service.send_response)
        lifetimes.note_nodes()
        lifetimes.note_other_domains(lambda: self.domain, self._link.send)
        lifetimes.install_departures(self._leave, self._leave)

    def _await_watched(self) -> None:
        """Wait until the grader hears each new publisher; a thread that comes meanwhile waits as well.

        In another domain there are no subscriptions: waiting would only delay the program.
        """
        if not self._unwatched:
            return
        from .endpoints import is_in
        from .lifetimes import MADE_NODES

        new, began_s = list(self._unwatched), originals.perf_counter()
        owners = [(_owner_of(publisher, MADE_NODES), publisher) for publisher in new]
        here = [(owner, publisher) for owner, publisher in owners if owner is None or is_in(self.domain, owner)]
        originals.wait_until(lambda: all(_is_watched(*pair) for pair in here), MATCH_S, pause_s=0.002)
        self._unwatched.difference_update(new)
        self.waited_s += originals.perf_counter() - began_s

    def _install_waits(self, existed: weakref.WeakKeyDictionary[Any, _Existed]) -> None:
        """Forget the new publishers of a thread that spins, or that has found a subscription or a server."""
        import rclpy.client
        import rclpy.executors
        import rclpy.publisher
        import rclpy.timer

        count, ready = rclpy.publisher.Publisher.get_subscription_count, rclpy.client.Client.service_is_ready
        look, make_timer = rclpy.executors.Executor._wait_for_ready_callbacks, rclpy.timer.Timer.__init__

        def waited() -> None:
            thread = originals.get_native_id()
            for publisher in [one for one, since in list(existed.items()) if since.thread == thread]:
                existed.pop(publisher, None)

        def finding(found: Callable[..., Any]) -> Callable[..., Any]:
            @functools.wraps(found)
            def looked(self: Any) -> Any:
                answer = found(self)
                if answer:
                    waited()
                return answer

            return looked

        @functools.wraps(look)
        def looking(executor: Any, timeout_sec: Any = None, *args: Any, **kwargs: Any) -> Any:
            self._await_watched()
            self._report_parameters()
            timeout_s = getattr(timeout_sec, "timeout", timeout_sec)  # rclpy also passes an object that counts down
            if timeout_s is None or timeout_s > 0:
                waited()
            return look(executor, timeout_sec, *args, **kwargs)

        @functools.wraps(make_timer)
        def timing(timer: Any, *args: Any, **kwargs: Any) -> None:
            self._await_watched()
            make_timer(timer, *args, **kwargs)

        rclpy.timer.Timer.__init__ = timing
        rclpy.publisher.Publisher.get_subscription_count = finding(count)
        rclpy.client.Client.service_is_ready = finding(ready)
        rclpy.executors.Executor._wait_for_ready_callbacks = looking

    def _report_parameters(self) -> None:
        """Report the parameters of all nodes, if any is new."""
        from .endpoints import is_in, parameters_of
        from .lifetimes import MADE_NODES
        from .node_parts import declared_by

        nodes = [node for one in MADE_NODES if (node := one()) is not None and is_in(self.domain, node)]
        now = tuple(id(one) for node in nodes for one in declared_by(node).values())
        if now == self._reported:
            return
        self._reported = now
        claims: list[Claim] = []
        for node in nodes:
            with contextlib.suppress(Exception):  # it is being destroyed
                claims += parameters_of(node)
        self._link.send(Parameters(claims[:MOST_PARAMETERS]))

    def report_early(self, topic: str, began_ns: int) -> None:
        """Report that what was sent on a topic was sent before anybody could have discovered its publisher.

        Args:
            topic: The topic.
            began_ns: When sending began, by the system clock.
        """
        if self._early_reports < MOST_EARLY:
            self._early_reports += 1
            self._link.send(EarlyMessage(topic, began_ns, originals.time_ns()))

    def _leave(self) -> None:
        """Wait until published messages have arrived, since they are lost when their publisher is destroyed."""
        for publisher in list(self._publishing):
            with contextlib.suppress(Exception):  # it has been destroyed, or its context has been shut down
                publisher.wait_for_all_acked(self._patience)
        if self._exchanged:
            self._exchanged = False
            originals.wait_until(lambda: not originals.unread_bytes(), ACKNOWLEDGED_S)
            originals.sleep(TAKEN_S)

    def finish(self) -> None:
        """Wait until published messages have arrived, before the publishers are freed with the student's modules."""
        self._report_parameters()
        self._leave()

    def end(self) -> bool:
        """Wait until published messages have arrived; the process leaves the graph when it ends."""
        self._leave()
        return False

    def start(self, now_ns: int, steady_ns: int) -> None:
        """Start waiting for the grader's next answer, which is the request to stop."""
        del now_ns, steady_ns
        self.domain = int(os.environ.get("ROS_DOMAIN_ID", "0"))
        originals.start_new_thread(self._await_stop, ())

    def _await_stop(self) -> None:
        self._link.next_answer()
        self.before_stop()
        originals.kill(os.getpid(), signal.SIGINT)

    def progress(self) -> Progress:
        """Return what the last report says of the program's progress: nothing."""
        return Progress()


def _is_watched(node: Any, publisher: Any) -> bool:
    """Return whether a publisher of a node is matched, and the grader's subscription is in the graph.

    Without a node to ask, or for a publisher that has been destroyed, return whether it is matched, or cannot be.
    """
    from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

    from .node_parts import seen_by

    try:
        with publisher.handle:
            if not publisher.handle.get_subscription_count():  # unlike the program's own question, this does not wait
                return False
        known = seen_by(node, "subscription", publisher.topic_name) if node is not None else []
    except (_rclpy.InvalidHandle, _rclpy.RCLError):
        return True
    return node is None or any(one.node_name.startswith(OBSERVER) for one in known)


def _owner_of(publisher: Any, made: list[weakref.ref[Any]]) -> Any:
    """Return the node of a publisher; None if that cannot be determined."""
    from .node_parts import publishers_of

    with contextlib.suppress(Exception):  # a node may be being destroyed
        nodes = [node for reference in made if (node := reference()) is not None]
        return next(node for node in nodes if any(publisher is own for own in publishers_of(node)))
    return None
