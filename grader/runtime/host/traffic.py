"""Counts what is published, called, answered and taken, and lets the grader match every endpoint before it is used."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable
from typing import Any

import rclpy.client
import rclpy.executors
import rclpy.publisher
import rclpy.service
import rclpy.subscription
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from .actions import Counted, install_actions
from .clock import VirtualClock
from .endpoints import BACKGROUND, service_name
from .inbox import channel_name, taken_from
from .lifetimes import install_departures, install_endpoints
from .ros_state import RosState

#: The methods with which an executor takes something, and the kinds of its channels.
TAKEN = {"_take_subscription": "topic", "_take_client": "response", "_take_service": "request"}


def install_traffic(  # noqa: PLR0913 - all that the traffic depends on
    ros: RosState,
    clock: VirtualClock,
    settle: Callable[[], None],
    leave: Callable[[], None],
    depart: Callable[[], None],
    give_up: Callable[[], None],
    work_ns: Callable[[], int],
) -> None:
    """Count what is published and taken, and let the grader match every endpoint before it is used.

    Args:
        ros: Keeps the counts.
        clock: Notified of every message.
        settle: Yields to the grader at the same instant.
        leave: The same, but returns only after all sent messages have arrived; called before a sender is destroyed.
        depart: The same, before the process may end at once.
        give_up: Called for an endpoint whose events the middleware times on the real clock.
        work_ns: Returns how much processor time the program has used.
    """
    ros.events.install(BACKGROUND)
    install_endpoints(ros, settle, leave, give_up)
    install_departures(leave, depart, ros.endpoints.remove)

    def counted(name: str, handle: Any, send: Callable[[], Any]) -> Any:
        if name in BACKGROUND:
            return send()
        # Before it is sent: who is not matched yet would miss it, and messages that nobody has taken meanwhile could
        # push each other out of a queue.
        if ros.outbox.must_settle(changed=ros.endpoints.changed):
            settle()
        # The grader does not receive it there, and would wait for it in vain.
        if ros.endpoints.is_elsewhere(handle):
            return send()
        # Time stands still while a program runs: one that only sends would never get further.
        clock.busy_sending()
        early = ros.outbox.early[name]
        ros.note(lambda: f"sends {name}")
        ros.outbox.note_sent(name, handle, work_ns())
        try:
            return send()
        except BaseException:
            ros.outbox.sent[name] -= 1  # nothing was sent, e.g. because the context was shut down
            ros.outbox.early[name] = early
            raise

    publish = rclpy.publisher.Publisher.publish
    call = rclpy.client.Client.call_async
    respond = rclpy.service.Service.send_response

    @functools.wraps(publish)
    def counted_publish(self: Any, msg: Any) -> Any:
        topic = self.topic_name
        if topic in BACKGROUND:
            return publish(self, msg)
        return counted(f"topic {topic}", self.handle, lambda: publish(self, msg))

    @functools.wraps(call)
    def counted_call(self: Any, request: Any) -> Any:
        return counted(f"request {self.service_name}", self.handle, lambda: call(self, request))

    @functools.wraps(respond)
    def counted_respond(self: Any, response: Any, header: Any) -> Any:
        return counted(f"response {service_name(self)}", self.handle, lambda: respond(self, response, header))

    make = rclpy.publisher.Publisher.__init__

    @functools.wraps(make)
    def made(self: Any, *args: Any, **kwargs: Any) -> None:
        make(self, *args, **kwargs)
        ros.outbox.note_created(self, work_ns())

    rclpy.publisher.Publisher.__init__ = made
    rclpy.publisher.Publisher.publish = counted_publish
    rclpy.client.Client.call_async = counted_call
    rclpy.service.Service.send_response = counted_respond
    _install_transitions(ros, counted)
    install_actions(ros, clock, counted, settle=settle, leave=leave)
    for name in TAKEN:
        setattr(rclpy.executors.Executor, name, _counting_take(name, ros, clock, settle))
    _note_timers(ros)


def _note_timers(ros: RosState) -> None:
    """Note each timer that an executor runs."""
    take = rclpy.executors.Executor._take_timer

    @functools.wraps(take)
    def noted(self: Any, timer: Any) -> Any:
        ros.note(lambda: "timer")
        return take(self, timer)

    rclpy.executors.Executor._take_timer = noted


def _install_transitions(ros: RosState, counted: Counted) -> None:
    """Count what the state machines of lifecycle nodes publish, which rclpy's publishers do not see."""
    machines = _rclpy.LifecycleStateMachine
    make = machines.__init__

    def made(self: Any, node: Any, *services: bool) -> None:
        make(self, node, *services)
        # also without services, transitions are published
        topic = _rclpy.rclpy_resolve_name(node, "~/transition_event", False, False)  # noqa: FBT003 - C++
        ros.endpoints.transitions[self] = topic
        ros.endpoints.changed = True

    machines.__init__ = made
    for name in ("trigger_transition_by_id", "trigger_transition_by_label"):
        _count_transitions(machines, name, ros, counted)


def _count_transitions(machines: Any, name: str, ros: RosState, counted: Counted) -> None:
    trigger = getattr(machines, name)

    def triggered(self: Any, transition: Any, telling: bool) -> Any:
        if not telling or self not in ros.endpoints.transitions:
            return trigger(self, transition, telling)
        return counted(f"topic {ros.endpoints.transitions[self]}", self, lambda: trigger(self, transition, telling))

    setattr(machines, name, triggered)


def _counting_take(name: str, ros: RosState, clock: VirtualClock, settle: Callable[[], None]) -> Callable[..., Any]:
    take = getattr(rclpy.executors.Executor, name)

    def counted_take(self: Any, receiver: Any) -> Any:
        clock.busy()
        # One that was destroyed since it was ready has no name, and nothing is taken from it.
        with contextlib.suppress(_rclpy.InvalidHandle):
            ros.note(lambda: f"reads {TAKEN[name]} {channel_name(receiver)}")
        # What the process itself has sent since may push out what is kept: the queue is the same as without the grader
        # only once that has arrived.
        if name == "_take_subscription" and _may_be_pushed_out(ros, receiver):
            settle()
        # The inbox has counted it when it took it ahead of time.
        if name == "_take_subscription" and (kept := ros.inbox.kept(receiver)):
            return _handing_over(receiver, kept.popleft(), clock)
        # rclpy would hand over the times of the middleware, which are those of the real clock.
        if name == "_take_subscription" and not _takes_message_only(receiver):
            taken = _taken_with_info(receiver, clock)
        else:
            taken = take(self, receiver)
        ros.inbox.took(receiver)
        return taken

    return counted_take


def _may_be_pushed_out(ros: RosState, subscription: Any) -> bool:
    """Return whether this process has sent messages, not announced yet, after others that are kept."""
    return bool(ros.inbox.kept(subscription)) and ros.outbox.sent[f"topic {subscription.topic_name}"] > 0


def _takes_message_only(subscription: Any) -> bool:
    return bool(subscription._callback_type is rclpy.subscription.Subscription.CallbackType.MessageOnly)


def _taken_with_info(subscription: Any, clock: VirtualClock) -> Callable[[], Any] | None:
    """Take a message for a callback that also wants its times, as an executor does."""
    with contextlib.suppress(_rclpy.InvalidHandle):
        found = taken_from(subscription)
        if found is not None:
            return _handing_over(subscription, found, clock)
    return None


def _handing_over(subscription: Any, found: tuple[Any, Any], clock: VirtualClock) -> Callable[[], Any]:
    """Return the coroutine function that an executor runs for a message, as in rclpy itself."""
    arguments: tuple[Any, ...] = found[:1]
    if not _takes_message_only(subscription):
        info = found[1]
        times = {name: clock.at(info[name]) for name in ("source_timestamp", "received_timestamp") if name in info}
        arguments += ({**info, **times},)

    async def execute() -> None:
        await rclpy.executors.await_or_execute(subscription.callback, *arguments)

    return execute
