"""Random programs that once did something else than the model says, as small as hypothesis could make them."""

from __future__ import annotations

from program_description import (
    ActionClient,
    ActionServer,
    Ask,
    Await,
    Client,
    End,
    Ending,
    Every,
    Finish,
    Fixed,
    Group,
    Heard,
    Keep,
    Loop,
    Nap,
    Node,
    Process,
    Program,
    Publish,
    Rest,
    Runs,
    Say,
    SendGoal,
    Server,
    Spinning,
    Statement,
    Subscription,
    Timer,
    Write,
)

#: Says what it hears.
SAYS: tuple[Statement, ...] = (Say(Heard()),)

#: Does nothing that anybody notices.
KEEPS: tuple[Statement, ...] = (Keep(0, Runs(), adds=False),)
#: Publishes, pauses and ends its program, or in a pool only its callback.
EXITS: tuple[Statement, ...] = (Publish("a", Runs()), Nap(50), End(Ending.EXIT))


def alone(node: Node, spinning: Spinning = Spinning.SPIN) -> Program:
    """Return a program of one node."""
    return Program((Process((node,), spinning),), 2000)


def raising(number: int, spinning: Spinning) -> Process:
    """Return a process that answers each message of both processes, and raises at the fifth answer."""
    timer = Timer(f"t{number}0", 50, (Publish("b", Fixed(0)),))
    answers = Subscription(f"s{number}1", "b", 2, (Publish("d", Fixed(7)), Publish("d", Heard())))
    raises = Subscription(f"s{number}0", "d", 10, (Say(Heard()), Every(5, (End(Ending.RAISE),))))
    return Process((Node(f"n{number}", 1, (timer,), (raises, answers)),), spinning)


def sending_goals(number: int, period_ms: int) -> Node:
    """Return a node that sends goals, and says what becomes of them."""
    send = SendGoal(f"g{number}0", Fixed(number), None, SAYS, SAYS)
    client = ActionClient(f"g{number}0", "y")
    return Node(f"n{number}", 1, (Timer(f"t{number}0", period_ms, (send,)),), (), action_clients=(client,))


COUNTER_EXAMPLES: dict[str, Program] = {
    # The grader was not told how late it was, and recorded the end at the last time that it knew.
    "leaves_at_once_after_saying_nothing": alone(
        Node("n0", 1, (Timer("t00", 50, (Every(3, (End(Ending.LEAVE_AT_ONCE),)),)),), ())
    ),
    # A loop that polls without blocking, and looks at no clock, let 10 ms pass at a time, and its timers were late.
    "polls_a_timer_without_blocking": alone(
        Node("n0", 1, (Timer("t00", 4, (Say(Runs()),)), Timer("t01", 125, (Say(Runs()),))), ()), Spinning.ONCE
    ),
    # A coroutine that waits makes each call of spin_once return at once.
    "polls_a_timer_beside_a_coroutine": alone(
        Node(
            "n0",
            1,
            (Timer("t00", 4, (Say(Runs()),)), Timer("t01", 100, (Await("c00", Fixed(1)),), group=1)),
            (),
            clients=(Client("c00", "p"),),
            groups=(Group.EXCLUSIVE,),
        ),
        Spinning.ONCE,
    ),
    # Of three messages, the eighth in a row was announced on its own, and handed over although the last one had pushed
    # it out of the queue.
    "queue_of_one_for_three_messages_of_its_own": alone(
        Node(
            "n0",
            1,
            (Timer("t00", 100, tuple(Publish("a", Fixed(number)) for number in range(3))),),
            (Subscription("s00", "a", 1, SAYS),),
        )
    ),
    "queue_of_two_for_three_messages_of_its_own": alone(
        Node(
            "n0",
            1,
            (Timer("t00", 100, tuple(Publish("a", Fixed(number)) for number in range(3))),),
            (Subscription("s00", "a", 2, SAYS),),
        )
    ),
    # The same where the later message is sent in the callback before, after a single look for work.
    "queue_of_one_behind_a_slow_timer": alone(
        Node(
            "n0",
            1,
            (Timer("t00", 100, (Nap(120), Publish("a", Runs()))),),
            (Subscription("s00", "a", 1, SAYS),),
        )
    ),
    # The model did not know that a response wakes every client of the service.
    "client_that_has_not_asked_is_woken": Program(
        (
            Process((Node("n0", 1, (), (), clients=(Client("c00", "p"),)),), Spinning.ONCE, timeout_ms=333, turns=3),
            Process((Node("n1", 1, (), (), clients=(Client("c10", "p"),)),), Spinning.UNTIL, turns=1),
            Process((Node("n2", 1, (), (), servers=(Server("v20", "p", (), Fixed(3)),)),), Spinning.SPIN),
        ),
        2000,
    ),
    # Both end at one instant: what the second had removed was waited for, while it was about to leave.
    "two_processes_that_end_at_one_instant": Program((raising(0, Spinning.SPIN), raising(1, Spinning.EXECUTOR)), 2000),
    # The processes drew the same ids for their goals, so that the server rejected those of the second one.
    "two_processes_that_send_goals": Program(
        (
            Process((sending_goals(0, 100),), Spinning.SPIN),
            Process((sending_goals(1, 125),), Spinning.SPIN),
            Process(
                (
                    Node(
                        "n2",
                        1,
                        (),
                        (),
                        action_servers=(ActionServer("e20", "y", SAYS, Runs(), Finish.SUCCEED, cancels=False),),
                    ),
                ),
                Spinning.SPIN,
            ),
        ),
        500,
    ),
    # The model did not know that the middleware sends no response to a client that has left, and so wakes no other one.
    "client_that_has_left_before_the_response": Program(
        (
            Process(
                (
                    Node(
                        "n0",
                        1,
                        (Timer("t00", 100, (Ask("c00", Fixed(1), ()), End(Ending.RAISE))),),
                        (),
                        clients=(Client("c00", "q"),),
                    ),
                ),
                Spinning.SPIN,
            ),
            Process(
                (
                    Node(
                        "n1",
                        1,
                        (Timer("t10", 50, (Say(Runs()),)),),
                        (),
                        servers=(Server("v10", "q", (), Fixed(3)),),
                        clients=(Client("c10", "q"),),
                    ),
                ),
                Spinning.ASYNCIO,
                timeout_ms=70,
                loop=Loop("m", 3, (Rest(30),)),
            ),
        ),
        2000,
    ),
    # rclpy's looks at the locks of a coroutine that waits made time pass before a busy loop had taken the response.
    "coroutine_in_a_busy_loop": Program(
        (
            Process(
                (Node("n0", 1, (), (), servers=(Server("v00", "p", (), Fixed(0), 1),), groups=(Group.REENTRANT,)),),
                Spinning.MULTI,
                threads=3,
            ),
            Process(
                (
                    Node(
                        "n1",
                        1,
                        (Timer("t10", 100, (Await("c10", Fixed(4)), Ask("c10", Runs(), SAYS)), group=2),),
                        (),
                        clients=(Client("c10", "p", 1),),
                        groups=(Group.EXCLUSIVE, Group.EXCLUSIVE),
                    ),
                ),
                Spinning.ONCE,
            ),
        ),
        2000,
    ),
    # rclpy leaves a task for each callback that ran while a call was pending. These tasks, and rclpy's looks at them,
    # counted as polls of a busy loop, which made the next response late.
    "many_callbacks_before_a_response": Program(
        (
            Process(
                (
                    Node(
                        "n0", 1, (Timer("t00", 10, (Keep(0, Runs(), adds=False),)),), (), clients=(Client("c00", "p"),)
                    ),
                ),
                Spinning.UNTIL,
                turns=3,
            ),
            Process(
                (Node("n1", 1, (), (), servers=(Server("v10", "p", (Every(2, (Nap(2500),)),), Fixed(3)),)),),
                Spinning.EXECUTOR,
            ),
        ),
        6000,
    ),
    # The same looks, at callbacks of a pool that ended by sys.exit and stay among its tasks.
    "callbacks_that_exit_in_a_pool": Program(
        (
            Process(
                (
                    Node(
                        "n0",
                        1,
                        (Timer("t00", 50, (Write(Fixed(0)), Every(2, EXITS))),),
                        (Subscription("s01", "a", 10, (Write(Runs()),)),),
                    ),
                ),
                Spinning.MULTI,
                threads=4,
            ),
        ),
        2500,
    ),
    # A message that was taken ahead of time was ready at a poll that had taken place before it arrived.
    "two_subscriptions_in_a_busy_loop": Program(
        (
            Process((Node("n0", 1, (Timer("t00", 50, (Publish("a", Fixed(1)),)),), ()),), Spinning.SPIN),
            Process(
                (
                    Node(
                        "n1",
                        1,
                        (),
                        (Subscription("s10", "a", 2, SAYS), Subscription("s11", "a", 1, (Say(Runs()), Nap(20)))),
                    ),
                ),
                Spinning.ONCE,
            ),
        ),
        1000,
    ),
}
